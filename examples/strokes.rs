//! How long the strokes of a scene take at each tolerance, and how far their transitions are from a list of
//! exact ones.
//!
//! `cargo run --release --example strokes -- [REFERENCE.csv [SCENE.toml [REPETITIONS]]]`

use std::time::Instant;
use wiperlab::simulate::outputs::Transitions;
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::{IntegrationMethod, SolverOptions, Transition, run_scene_with};

const METHODS: [(&str, IntegrationMethod); 2] =
    [("wiperlab-taylor", IntegrationMethod::Taylor), ("wiperlab-runge-kutta", IntegrationMethod::RungeKutta)];

/// A transition of the reference: time, s, and both modes.
struct Exact {
    time_s: f64,
    from: String,
    to: String,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let reference = arguments.next().unwrap_or_else(|| "benches/peers/reference/transitions.csv".to_owned());
    let path = arguments.next().unwrap_or_else(|| "data/scenes/light-blade-strokes.toml".to_owned());
    let repetitions: usize = arguments.next().map_or(Ok(5), |n| n.parse())?;
    let reference = exact(&std::fs::read_to_string(&reference)?)?;
    let scene = Scene::parse(&path, &std::fs::read_to_string(&path)?)?;
    println!(
        "method,tolerance,wall_s,rhs_evaluations,steps,status,transitions,missed,invented,worst_error_s,median_error_s"
    );
    for (name, method) in METHODS {
        for exponent in 4..=12 {
            let effort = SolverOptions { method, ..SolverOptions::new(10f64.powi(-exponent)) };
            let mut list = Transitions::default();
            let run = run_scene_with(&scene, effort, &mut list);
            let wall_s = (0..repetitions).map(|_| seconds(&scene, effort)).fold(f64::INFINITY, f64::min);
            let (missed, invented, errors) = compare(&list.0, &reference);
            let (worst, median) = (
                errors.last().copied().unwrap_or(f64::NAN),
                errors.get(errors.len() / 2).copied().unwrap_or(f64::NAN),
            );
            let (evaluations, steps, status) = (run.work.rhs_evaluations, run.work.steps, run.status.name());
            let found = list.0.len();
            println!(
                "{name},1e-{exponent},{wall_s:.6e},{evaluations},{steps},{status},{found},{missed},{invented},{worst:.6e},{median:.6e}"
            );
        }
    }
    Ok(())
}

fn seconds(scene: &Scene, effort: SolverOptions) -> f64 {
    let clock = Instant::now();
    run_scene_with(scene, effort, &mut ());
    clock.elapsed().as_secs_f64()
}

fn exact(text: &str) -> Result<Vec<Exact>, Box<dyn std::error::Error>> {
    let row = |line: &str| match line.split(',').collect::<Vec<_>>()[..] {
        [time_s, from, to] => Ok(Exact { time_s: time_s.parse()?, from: from.to_owned(), to: to.to_owned() }),
        _ => Err(format!("`{line}` is not a row of time_s,from,to").into()),
    };
    text.lines().skip(1).map(row).collect()
}

/// Counts of missed and invented transitions, and the errors of the others in rising order, s. Every exact
/// transition owns the time halfway to its neighbours; the nearest one of its kind found there is it.
fn compare(found: &[Transition], exact: &[Exact]) -> (usize, usize, Vec<f64>) {
    let halfway = |i: usize| 0.5 * (exact[i].time_s + exact[i + 1].time_s);
    let mut errors: Vec<f64> = (0..exact.len())
        .filter_map(|i| {
            let low = if i > 0 { halfway(i - 1) } else { f64::NEG_INFINITY };
            let high = if i + 1 < exact.len() { halfway(i) } else { f64::INFINITY };
            let (first, end) =
                (found.partition_point(|t| t.time_s < low), found.partition_point(|t| t.time_s < high));
            let same = found[first..end]
                .iter()
                .filter(|t| t.from.name() == exact[i].from && t.to.name() == exact[i].to);
            same.map(|t| (t.time_s - exact[i].time_s).abs()).min_by(f64::total_cmp)
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    (exact.len() - errors.len(), found.len() - errors.len(), errors)
}
