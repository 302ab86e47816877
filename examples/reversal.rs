//! How fast one reversal runs, and whether its transitions depend on the tolerance.
//!
//! `cargo run --release --example reversal [-- SCENE [taylor|runge-kutta]]`

use std::time::Instant;
use wiperlab::simulate::outputs::Transitions;
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::{IntegrationMethod, SolverOptions, run_scene_with};

/// Runs timed at each tolerance; the shortest and the median are shown.
const RUNS: usize = 51;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "data/scenes/light-blade.toml".to_owned());
    let scene = Scene::parse(&path, &std::fs::read_to_string(&path)?)?;
    println!("{}: {} s to {} s", scene.title(), scene.start_s, scene.run.stop_s);
    println!(
        "{:>9} {:>12} {:>8} {:>14} {:>9} {:>10} {:>16}",
        "tolerance", "transitions", "steps", "rhs/transition", "least, ms", "median, ms", "shift of times, s"
    );
    let method = match std::env::args().nth(2).as_deref() {
        Some("runge-kutta") => IntegrationMethod::RungeKutta,
        _ => IntegrationMethod::Taylor,
    };
    let mut finer: Option<Transitions> = None;
    for exponent in (4..=13).rev() {
        let effort = SolverOptions { method, ..SolverOptions::new(10f64.powi(-exponent)) };
        let mut list = Transitions::default();
        let run = run_scene_with(&scene, effort, &mut list);
        let mut times: Vec<f64> = (0..RUNS)
            .map(|_| {
                let clock = Instant::now();
                run_scene_with(&scene, effort, &mut ());
                1e3 * clock.elapsed().as_secs_f64()
            })
            .collect();
        times.sort_by(f64::total_cmp);
        let per_transition = run.work.rhs_evaluations as f64 / run.transitions.max(1) as f64;
        let shift = finer.as_ref().map_or("reference".to_owned(), |finer| shift(finer, &list));
        println!(
            "{:>9.0e} {:>12} {:>8} {per_transition:>14.1} {:>9.2} {:>10.2} {shift:>16}",
            effort.relative_tolerance,
            run.transitions,
            run.work.steps,
            times[0],
            times[RUNS / 2]
        );
        finer.get_or_insert(list);
    }
    Ok(())
}

/// Largest difference of transition times from the reference, if the lists agree in kind.
fn shift(reference: &Transitions, list: &Transitions) -> String {
    let same = reference.0.len() == list.0.len()
        && reference.0.iter().zip(&list.0).all(|(a, b)| (a.from, a.to) == (b.from, b.to));
    if !same {
        return "another list".to_owned();
    }
    let largest =
        reference.0.iter().zip(&list.0).map(|(a, b)| (a.time_s - b.time_s).abs()).fold(0.0, f64::max);
    format!("{largest:.1e}")
}
