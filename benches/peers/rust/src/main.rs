//! The scene of the peer comparison in solvers written in Rust.
//!
//! usage: wiperlab-peers SCENE.toml REPETITIONS FOLDER METHOD TOLERANCE...
//! with METHOD `diffsol-tsit45`, `differential-equations-dop853` (its event location) or `differential-equations-dop853-own-roots`

mod blade;
mod dop853;
mod tsit45;

use blade::{Blade, Mode};
use std::fmt::Write as _;
use std::time::Instant;

/// A run that made this many transitions is going round in circles.
const MOST_TRANSITIONS: usize = 100_000;

/// What a run found and what it cost.
#[derive(Default)]
pub struct Outcome {
    pub transitions: Vec<(f64, Mode, Mode)>,
    pub evaluations: usize,
    pub steps: usize,
    pub status: &'static str,
}

impl Outcome {
    /// Notes a transition; `Some` status if the run cannot go on.
    pub fn note(&mut self, t: f64, from: Mode, to: Mode) -> Option<&'static str> {
        self.transitions.push((t, from, to));
        match () {
            () if to == Mode::Lifted => Some("lifted"),
            () if self.transitions.len() >= MOST_TRANSITIONS => Some("endless"),
            () => None,
        }
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scene, repetitions, folder, method, tolerances @ ..] = arguments.as_slice() else {
        panic!("usage: wiperlab-peers SCENE.toml REPETITIONS FOLDER METHOD TOLERANCE...");
    };
    let text = std::fs::read_to_string(scene).expect("the scene file");
    let blade = Blade::read(&text.parse().expect("a scene in TOML"));
    let strokes = match method.as_str() {
        "diffsol-tsit45" => tsit45::strokes,
        "differential-equations-dop853" => dop853::strokes,
        "differential-equations-dop853-own-roots" => dop853::strokes_with_own_roots,
        other => panic!("unknown method {other}"),
    };
    for tolerance in tolerances {
        let relative: f64 = tolerance.parse().expect("a tolerance");
        let mut best = f64::INFINITY;
        let mut outcome = Outcome::default();
        for _ in 0..repetitions.parse().expect("a number of repetitions") {
            let start = Instant::now();
            outcome = strokes(&blade, relative);
            best = best.min(start.elapsed().as_secs_f64());
        }
        let mut list = String::from("time_s,from,to\n");
        for (t, from, to) in &outcome.transitions {
            writeln!(list, "{t:?},{},{}", from.name(), to.name()).expect("writing to a string");
        }
        std::fs::write(format!("{folder}/{method}_{tolerance}.csv"), list).expect("the list of transitions");
        println!("{method},{tolerance},{best:.6e},{},{},{}", outcome.evaluations, outcome.steps, outcome.status);
    }
}
