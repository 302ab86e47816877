//! The stick-slip cycle as the spectrum reads it, against the sticks of the simulation that it is of:
//! `cargo run --release --example cycles`.
//!
//! Each scene is recorded by two cameras, at 10,000 frames/s with 0.5 um of noise and at 5,000 frames/s with
//! 2 um, and read in windows of several lengths between a release and the next hold. The truth is counted: the
//! ends of the sticks are whole cycles apart. Windows in which a beat is dropped are left out: the oscillation
//! goes on where a stick is missing. The last two columns are the windows whose slips are counted in the path
//! of the tip, and those in which this count differs from that of the sticks between its first and last slip.

mod count;

use count::Count;
use wiperlab::simulate::scene::Scene;

const SCENES: [(&str, &str); 4] = [
    ("light blade", include_str!("../../data/scenes/light-blade.toml")),
    ("actual blade", include_str!("../../data/scenes/actual-blade.toml")),
    ("another blade", include_str!("../../data/scenes/another-blade.toml")),
    ("published experiment", include_str!("../../data/scenes/published-experiment.toml")),
];
/// Frames per second, 1/s, and noise, m.
const CAMERAS: [(f64, f64); 2] = [(10_000.0, 5e-7), (5_000.0, 2e-6)];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!(
        "| scene | frames/s | windows with a cycle | named | mean within two deviations | largest | drifting | ends within two deviations | rms Hz | largest Hz | counted | miscounted |"
    );
    println!("|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|");
    let mut all = Count::default();
    for (name, text) in SCENES {
        let scene = Scene::parse(name, text)?;
        for (frame_rate_hz, noise_m) in CAMERAS {
            let count = Count::of(&scene, frame_rate_hz, noise_m)?;
            println!("{}", row(&count, name, &frame_rate_hz.to_string()));
            all.add(count);
        }
    }
    println!("{}", row(&all, "all", ""));
    Ok(())
}

fn row(count: &Count, name: &str, frames_per_s: &str) -> String {
    let largest = |values: &[f64]| values.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let rms = match count.ends_hz.len() {
        0 => 0.0,
        ends => (count.ends_hz.iter().map(|x| x * x).sum::<f64>() / ends as f64).sqrt(),
    };
    let [means, ends] = count.within();
    format!(
        "| {name} | {frames_per_s} | {} | {} | {means} of {} | {:.1} | {} | {ends} of {} | {rms:.1} | {:.1} | {} | {} |",
        count.windows,
        count.named,
        count.means.len(),
        largest(&count.means),
        count.ends.len() / 2,
        count.ends.len(),
        largest(&count.ends_hz),
        count.counted,
        count.miscounted
    )
}
