//! Compares the speed at which steady sliding of random blades becomes stable, from eigenvalues, with the
//! speed at which perturbations of simulated runs stop growing.
//!
//! `cargo run --release --example sliding -- [BLADES]`

#[path = "../../tests/common/blade.rs"]
#[allow(dead_code)]
mod blade;
mod growth;

use blade::{Parts, STROKE};
use growth::simulated_end;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use wiperlab::stability::speed_intervals::unstable_range;
use wiperlab::stability::steady_sliding::SlideFinder;

/// Highest speed, m/s.
const TOP: f64 = 2.0;

fn main() {
    let count: usize = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(200);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let (mut compared, mut worst, mut stable, mut at_top, mut not_smooth) = (0, 0f64, 0, 0, 0);
    for _ in 0..count {
        let scene = Parts::random(&mut rng).scene(STROKE);
        let intervals = SlideFinder::new(&scene.linkage, 1.0).find_intervals([0.0, TOP], 100);
        let Some([_, end]) = unstable_range(&intervals) else {
            stable += 1;
            continue;
        };
        if end >= TOP {
            at_top += 1;
            continue;
        }
        match simulated_end(&scene, [0.97 * end, 1.03 * end]) {
            Some(found) => {
                compared += 1;
                worst = worst.max((found / end - 1.0).abs());
            }
            // a run has a transition, or the blade cannot slide steadily near the end
            None => not_smooth += 1,
        }
    }
    println!("blades {count}: never unstable {stable}, unstable up to {TOP} m/s {at_top}");
    println!(
        "compared {compared}: largest relative difference of the end {worst:.1e}; not comparable {not_smooth}"
    );
}
