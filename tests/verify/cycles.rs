//! The cycle of a simulation as the spectrum reads it, against its sticks; the table of all scenes is that of
//! `cargo run --release --example cycles`.

use crate::cycle_count::Count;
use wiperlab::simulate::scene::Scene;

#[test]
fn the_cycle_is_named_and_its_mean_and_range_are_known_to_their_deviations() {
    let text = include_str!("../../data/scenes/light-blade.toml");
    let scene = Scene::parse("light-blade.toml", text).unwrap();
    let mut count = Count::of(&scene, 10_000.0, 5e-7).unwrap();
    count.add(Count::of(&scene, 5_000.0, 2e-6).unwrap());
    assert!(count.windows > 50 && count.ends.len() > 80, "{} windows", count.windows);
    assert_eq!(count.named, count.windows);
    let [means, ends] = count.within();
    let enough = |within: usize, of: usize| 20 * within >= 19 * of;
    assert!(enough(means, count.means.len()), "means: {means} of {}", count.means.len());
    assert!(enough(ends, count.ends.len()), "ends: {ends} of {}", count.ends.len());
}
