//! The hard cases, each with what is exact about it; `docs/hard-cases.md` is their table.

mod blades;
mod contact;
mod events;
mod inputs;
mod long;
mod moments;
use crate::scenes;

use wiperlab::simulate::outputs::{EnergyAudit, Transitions};
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::{
    IntegrationMethod, ModelSample, Observer, RunResult, SolutionSegment, SolverOptions, Transition,
    run_scene_with,
};

/// Error that a located instant may have in units of the tolerance: a phase takes a few steps and each may
/// err by the tolerance.
const ERRORS: f64 = 20.0;
/// Error that the last of hundreds of transitions may have in units of the tolerance, times the time scale of
/// a second: friction that falls with speed draws errors out.
const MORE: f64 = 50.0;
/// Residual of the energy balance in units of the tolerance.
const ENERGY: f64 = 100.0;
/// How far stick may be from where it holds the tip, m.
const DRIFT_M: f64 = 1e-15;
/// Right-hand sides that no case here needs; one that hangs ends with `diverged` instead.
const MOST_EVALUATIONS: u64 = 20_000_000;

const METHODS: [IntegrationMethod; 2] = [IntegrationMethod::Taylor, IntegrationMethod::RungeKutta];

/// Both methods at tolerances from 1e-4 down to 1e-12.
fn cases() -> impl Iterator<Item = (IntegrationMethod, f64)> {
    METHODS.into_iter().flat_map(|method| [4, 6, 8, 10, 12].map(|exponent| (method, 10f64.powi(-exponent))))
}

/// A run and what it showed.
struct Ran {
    run: RunResult,
    transitions: Vec<Transition>,
    audit: EnergyAudit,
    ends: Vec<ModelSample>,
}

#[derive(Default)]
struct Ends(Vec<ModelSample>);

impl Observer for Ends {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        self.0.extend([piece.sample_at(piece.start_s), piece.sample_at(piece.end_s)]);
    }
}

fn ran(scene: &Scene, method: IntegrationMethod, relative: f64) -> Ran {
    let (mut transitions, mut audit, mut ends) =
        (Transitions::default(), EnergyAudit::default(), Ends::default());
    let effort = SolverOptions { method, most_evaluations: MOST_EVALUATIONS, ..SolverOptions::new(relative) };
    let run = run_scene_with(scene, effort, &mut ((&mut transitions, &mut audit), &mut ends));
    Ran { run, transitions: transitions.0, audit, ends: ends.0 }
}

impl Ran {
    /// Energy balanced, the tip held where it sticks, and nothing that is no number.
    fn assert_sound(&self, what: &str, relative: f64) {
        let energy = self.audit.energy_residual_relative();
        assert!(
            energy <= ENERGY * relative,
            "{what}: energy residual {energy:e}, {:.0} tolerances",
            energy / relative
        );
        assert!(
            self.audit.max_constraint_drift_m <= DRIFT_M,
            "{what}: drift {:e} m",
            self.audit.max_constraint_drift_m
        );
        for sample in &self.ends {
            let ModelSample {
                tip_x_m, tip_velocity_m_per_s, normal_n, friction_n, energy_j, power_w, ..
            } = *sample;
            let numbers = [tip_x_m, tip_velocity_m_per_s, normal_n, friction_n, energy_j, power_w];
            assert!(numbers.iter().all(|x| x.is_finite()), "{what}: {sample:?}");
        }
    }

    /// The same modes and causes in the same order as another run.
    fn assert_same_list(&self, what: &str, other: &Self) {
        let kinds = |ran: &Self| ran.transitions.iter().map(|t| (t.from, t.to, t.cause)).collect::<Vec<_>>();
        assert_eq!(
            (self.run.status, self.run.transitions),
            (other.run.status, other.run.transitions),
            "{what}"
        );
        assert_eq!(kinds(self), kinds(other), "{what}");
    }

    /// Largest difference between the times of two equal lists, s.
    fn shift_s(&self, other: &Self) -> f64 {
        self.transitions
            .iter()
            .zip(&other.transitions)
            .map(|(a, b)| (a.time_s - b.time_s).abs())
            .fold(0.0, f64::max)
    }
}
