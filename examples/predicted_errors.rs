//! Compares the predicted errors of transition times with the errors against a run at a tolerance of 1e-13,
//! for random blades of several classes, at nine tolerances.
//!
//! `cargo run --release --example predicted_errors -- [BLADES]`

#[path = "../tests/common/blade.rs"]
#[allow(dead_code)]
mod blade;

use blade::{Parts, STROKE};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use wiperlab::simulate::predicted_error::run_with_predicted_errors;
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::{SolverOptions, Transition};

/// Relative tolerance of the runs that count as exact.
const EXACT: f64 = 1e-13;
/// Exponents of the tolerances.
const EXPONENTS: std::ops::RangeInclusive<i32> = 4..=12;
/// Changes a usual blade; the second argument is a random number from 0 to 1.
type BladeChange = fn(&mut Parts, f64);
/// Classes of blades, with the change that each makes to a usual one.
const CLASSES: [(&str, BladeChange); 5] = [
    ("usual", |_, _| ()),
    ("light lip", |parts, x| {
        let factor = 10f64.powf(-3.0 * x);
        (parts.m[2], parts.j[1]) = (parts.m[2] * factor, parts.j[1] * factor);
    }),
    ("steep friction", |parts, x| parts.friction[1] = 15.0 * 10f64.powf(x)),
    ("stiff shoulder", |parts, x| {
        let stiffness = parts.k[1] * 10f64.powf(1.0 + 4.0 * x);
        parts.shoulder = Some([0.02 + 0.2 * x, stiffness, parts.c[1]]);
    }),
    ("little damping", |parts, x| parts.c = parts.c.map(|c| c * 10f64.powf(-3.0 * x))),
];

fn main() {
    let count: usize = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(500);
    println!(
        "| blades | tolerance | transitions | error > prediction | prediction <= 30 errors | wrong order | flagged before the difference | right order | flagged in vain |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let mut all: Vec<Count> = EXPONENTS.map(|_| Count::default()).collect();
    for (name, change) in CLASSES {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
        let scenes: Vec<Scene> = (0..count / CLASSES.len())
            .map(|_| {
                let mut parts = Parts::random(&mut rng);
                change(&mut parts, rng.random());
                parts.scene(STROKE)
            })
            .collect();
        let exact: Vec<Vec<Transition>> =
            scenes.par_iter().map(|scene| predict(scene, EXACT).transitions()).collect();
        for (exponent, all) in EXPONENTS.zip(&mut all) {
            let tolerance = 10f64.powi(-exponent);
            let one = |(scene, exact): (&Scene, &Vec<Transition>)| {
                let mut count = Count::default();
                count.add(exact, &predict(scene, tolerance));
                count
            };
            let counts = scenes.par_iter().zip(&exact).map(one).reduce(Count::default, Count::plus);
            println!("| {name} | 1e-{exponent} {}", counts.cells());
            *all = all.plus(counts);
        }
    }
    for (exponent, counts) in EXPONENTS.zip(&all) {
        println!("| all | 1e-{exponent} {}", counts.cells());
    }
    println!("| all | all {}", all.into_iter().fold(Count::default(), Count::plus).cells());
}

/// Transitions of a run with their predicted errors, s.
struct Predicted {
    times: Vec<(Transition, Option<f64>)>,
    undetermined_after_s: Option<f64>,
}

impl Predicted {
    fn transitions(self) -> Vec<Transition> {
        self.times.into_iter().map(|(transition, _)| transition).collect()
    }
}

fn predict(scene: &Scene, tolerance: f64) -> Predicted {
    let mut times = Vec::new();
    let receive = |transition: &Transition, error_s| times.push((*transition, error_s));
    let run = run_with_predicted_errors(scene, SolverOptions::new(tolerance), &mut (), receive);
    Predicted { times, undetermined_after_s: run.undetermined_after_s }
}

#[derive(Debug, Clone, Copy, Default)]
struct Count {
    transitions: usize,
    /// Errors above the predicted ones.
    above: usize,
    /// Errors above 100 units in the last place, and those with a prediction of at most 30 times the error.
    resolved: usize,
    close: usize,
    /// Runs with another order of transitions, and those that say so before the first difference.
    wrong: usize,
    found: usize,
    /// Runs with the right order, and those that are called undetermined.
    right: usize,
    alarms: usize,
}

impl Count {
    fn add(&mut self, exact: &[Transition], run: &Predicted) {
        /// Smallest error that counts, in units of the last place of the time.
        const ROUNDINGS: f64 = 100.0;
        /// Largest ratio of a predicted error to the error.
        const CLOSE: f64 = 30.0;
        // a transition that is farther from its partner than from its neighbours has another partner
        let gap_s = |k: usize| {
            let near = [k.checked_sub(1), Some(k + 1)].into_iter().flatten().filter_map(|j| exact.get(j));
            near.map(|other| (other.time_s - exact[k].time_s).abs()).fold(f64::INFINITY, f64::min)
        };
        let is_same = |k: &usize| {
            let (a, b) = (&exact[*k], &run.times[*k].0);
            (a.from, a.to) == (b.from, b.to) && (a.time_s - b.time_s).abs() < 2.0 * gap_s(*k)
        };
        let same = (0..exact.len().min(run.times.len())).take_while(is_same).count();
        let is_right = same == exact.len() && same == run.times.len();
        let undetermined = run.undetermined_after_s.unwrap_or(f64::INFINITY);
        if is_right {
            self.right += 1;
            self.alarms += usize::from(undetermined.is_finite());
        } else {
            self.wrong += 1;
            let first = [exact.get(same), run.times.get(same).map(|(transition, _)| transition)];
            let difference_s =
                first.into_iter().flatten().fold(f64::INFINITY, |t, other| t.min(other.time_s));
            self.found += usize::from(undetermined <= difference_s);
        }
        for (exact, (found, predicted)) in exact.iter().zip(&run.times).take(same) {
            let Some(predicted) = predicted.filter(|_| found.time_s <= undetermined) else { break };
            let error = (found.time_s - exact.time_s).abs();
            self.transitions += 1;
            self.above += usize::from(error > predicted);
            if error > ROUNDINGS * f64::EPSILON * found.time_s {
                self.resolved += 1;
                self.close += usize::from(predicted <= CLOSE * error);
            }
        }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            transitions: self.transitions + other.transitions,
            above: self.above + other.above,
            resolved: self.resolved + other.resolved,
            close: self.close + other.close,
            wrong: self.wrong + other.wrong,
            found: self.found + other.found,
            right: self.right + other.right,
            alarms: self.alarms + other.alarms,
        }
    }

    fn cells(&self) -> String {
        let percent = |part: usize, of: usize| format!("{:.2} %", 100.0 * part as f64 / of.max(1) as f64);
        format!(
            "| {} | {} | {} | {} | {} | {} | {} |",
            self.transitions,
            percent(self.above, self.transitions),
            percent(self.close, self.resolved),
            self.wrong,
            self.found,
            self.right,
            self.alarms
        )
    }
}
