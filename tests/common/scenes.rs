//! The committed scenes and what their runs look like to an observer.

#![allow(dead_code)] // each test program uses a part

use wiperlab::simulate::outputs::{EnergyAudit, Transitions};
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::{
    ModelSample, Observer, RunResult, SolutionSegment, SolverOptions, Transition, run_scene_with,
};

/// A scene under `data/scenes`.
pub fn committed(name: &str) -> Scene {
    let path = format!("{}/data/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    Scene::parse(name, &std::fs::read_to_string(path).unwrap()).unwrap()
}

/// The light blade upright at rest at t = 0: what tests start other runs from.
pub fn upright_light_blade() -> Scene {
    let mut scene = Scene::parse("light-blade.toml", include_str!("../fixtures/light-blade.toml")).unwrap();
    scene.run.stop_s = 0.75;
    scene
}

/// Both committed scenes.
pub fn both() -> [Scene; 2] {
    [committed("light-blade"), committed("actual-blade")]
}

/// A run with its transitions, its audit and the samples at both ends of every piece.
pub struct Seen {
    pub run: RunResult,
    pub transitions: Vec<Transition>,
    pub audit: EnergyAudit,
    pub samples: Vec<ModelSample>,
}

#[derive(Default)]
struct Ends(Vec<ModelSample>);

impl Observer for Ends {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        self.0.extend([piece.sample_at(piece.start_s), piece.sample_at(piece.end_s)]);
    }
}

/// Runs a scene at a tolerance.
pub fn seen(scene: &Scene, relative_tolerance: f64) -> Seen {
    let (mut transitions, mut audit, mut ends) =
        (Transitions::default(), EnergyAudit::default(), Ends::default());
    let run = run_scene_with(
        scene,
        SolverOptions::new(relative_tolerance),
        &mut ((&mut transitions, &mut audit), &mut ends),
    );
    Seen { run, transitions: transitions.0, audit, samples: ends.0 }
}
