//! The cases of the study: what is filmed, how, and what the fit believes.

use crate::truth::Filming;
use std::f64::consts::TAU;
use std::sync::Arc;
use wiperlab::recording::{FrameGrid, Recording, Traces};
use wiperlab::simulate::drive::{Drive, smooth_head_motion};
use wiperlab::simulate::scene::Scene;

/// A case.
pub struct Case {
    pub name: &'static str,
    /// What is said of it in the table.
    pub words: &'static str,
    /// Number of blades, and of noise draws of each.
    pub blades: u64,
    pub draws: u64,
    /// Keys of the job and of its `[[trace]]`.
    pub job: &'static str,
    pub trace: &'static str,
    pub filming: Filming,
    /// Constants of the blade that is filmed, with their factors: the fit does not know them.
    pub wrong: &'static [(&'static str, f64)],
    pub motion: Motion,
    /// Whether the camera does what cameras do.
    pub spoilt: bool,
    /// Seeds of the search.
    pub seeds: u64,
    /// Corners of the bounds at which the search starts in place of their middle.
    pub corners: u64,
}

/// How the head moves.
#[derive(Clone, Copy, PartialEq)]
pub enum Motion {
    /// One reversal of the scene's crank.
    Crank,
    /// Three of them.
    ThreeReversals,
    /// By hand.
    Hand,
}

const USUAL: Case = Case {
    name: "",
    words: "",
    blades: 4,
    draws: 1,
    job: EXACT,
    trace: "",
    filming: Filming { frame_rate_hz: None, dropout_fraction: None, draw: 0 },
    wrong: &[],
    motion: Motion::Crank,
    spoilt: false,
    seeds: 1,
    corners: 0,
};

const EXACT: &str = "nuisance = \"exact\"";
const NUISANCE: &str = "nuisance = \"3 %\"";
const INERTIA: &[(&str, f64)] = &[("blade.lip_inertia_kg_m2", 1.05)];
const DAMPING: &[(&str, f64)] = &[
    ("blade.head_damping_n_s_per_m", 1.5),
    ("blade.neck_damping_n_m_s_per_rad", 1.5),
    ("blade.lip_damping_n_m_s_per_rad", 1.5),
];
const HEAD: &[(&str, f64)] = &[("blade.head_mass_kg", 1.05)];
const PRELOAD: &[(&str, f64)] = &[("blade.preload_displacement_m", 1.01)];

/// All cases, in the order of the table.
pub fn cases() -> Vec<Case> {
    let wrong = |name, words, wrong, job| Case { name, words, wrong, job, blades: 2, ..USUAL };
    vec![
        Case { name: "blades", words: "24 blades, two draws of the noise", blades: 24, draws: 2, ..USUAL },
        Case {
            name: "camera",
            words: "correlated noise, tilt 0.3 degrees, scale 0.5 %, marker off, 3 % lost, pixel locking",
            spoilt: true,
            ..USUAL
        },
        wrong("inertia", "lip inertia +5 %, constants held", INERTIA, EXACT),
        wrong("inertia-free", "lip inertia +5 %, constants free by 3 %", INERTIA, NUISANCE),
        wrong("damping", "dampings +50 %, constants held", DAMPING, EXACT),
        wrong("damping-free", "dampings +50 %, constants free by 3 %", DAMPING, NUISANCE),
        wrong("head-mass", "head mass +5 %, constants held", HEAD, EXACT),
        wrong("head-mass-free", "head mass +5 %, constants free by 3 %", HEAD, NUISANCE),
        wrong("preload", "preload +1 %, constants held", PRELOAD, EXACT),
        wrong("preload-free", "preload +1 %, constants free by 3 %", PRELOAD, NUISANCE),
        Case {
            name: "twins",
            words: "with 40 refitted twins",
            job: "nuisance = \"exact\"\nintervals.bootstrap = 40",
            blades: 2,
            ..USUAL
        },
        Case { name: "tip", words: "the tip alone", trace: "channels = [\"tip-x\"]", ..USUAL },
        Case {
            name: "slow",
            words: "2,000 frames/s",
            filming: Filming { frame_rate_hz: Some(2_000.0), ..USUAL.filming },
            ..USUAL
        },
        Case { name: "short", words: "0.1 s", trace: "window = \"0.60..0.70\"", ..USUAL },
        Case {
            name: "lost",
            words: "30 % of the points lost",
            filming: Filming { dropout_fraction: Some(0.3), ..USUAL.filming },
            ..USUAL
        },
        Case {
            name: "three-reversals",
            words: "three reversals",
            motion: Motion::ThreeReversals,
            blades: 2,
            ..USUAL
        },
        Case { name: "hand", words: "a head moved by hand", motion: Motion::Hand, blades: 2, ..USUAL },
        Case { name: "seeds", words: "seeds 1 to 5", seeds: 5, blades: 3, ..USUAL },
        Case { name: "corners", words: "five corners of the bounds", corners: 5, blades: 3, ..USUAL },
    ]
}

impl Case {
    /// The scene that is filmed, given what the fit believes.
    pub fn filmed(&self, believed: &Scene) -> Scene {
        let mut scene = self.wrong.iter().fold(believed.clone(), |scene, (name, factor)| {
            let value = scene.value(name).expect("a constant of the scene");
            scene.with_parameter(name, factor * value).expect("a blade that can be")
        });
        match self.motion {
            Motion::Crank => {}
            Motion::ThreeReversals => scene.run.stop_s = 2.15,
            Motion::Hand => {
                scene.run.stop_s = 1.76;
                scene.drive = by_hand();
            }
        }
        scene
    }
}

/// A stroke by hand: a slow wave with faster ones on it.
fn by_hand() -> Drive {
    /// Amplitude, m, frequency, Hz, and phase, of a turn.
    const WAVES: [[f64; 3]; 4] =
        [[0.020, 0.95, 0.05], [0.005, 1.6, 0.4], [0.0022, 2.9, 0.8], [0.0008, 4.4, 0.15]];
    let grid = FrameGrid { start_s: 0.4, frame_rate_hz: 1_000.0, frames: 1_500 };
    let place = |t: f64| WAVES.iter().map(|[a, f, phase]| a * (TAU * (f * t + phase)).cos()).sum();
    let nothing = vec![None; grid.frames];
    let traces = Traces {
        head_x_m: (0..grid.frames).map(|i| Some(place(grid.time_s(i)))).collect(),
        head_y_m: nothing.clone(),
        tip_x_m: nothing.clone(),
        tip_y_m: nothing,
        ..Traces::default()
    };
    let hand = Recording::new("synthetic", grid, traces, true).expect("a recording of a head");
    Drive::Recorded(Arc::new(smooth_head_motion(&hand).expect("a head in every frame")))
}
