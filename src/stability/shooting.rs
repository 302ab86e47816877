//! Periodic motions of a blade or slider whose head moves at constant speed.
//!
//! The unknowns are the state at an instant at which the tip is as fast as the head, the period and the speed
//! of the head. The state after a period must be the same state. Its derivatives by the state and by the
//! speed are exact, through all transitions ([`crate::simulate::sensitivity`]), so Newton's iteration
//! converges quadratically. The conditions hold for cycles with any number of sticks, and for cycles without
//! any.

use crate::model::{HeadMotion, LinkDirections, Linkage, Pose};
use crate::simulate::drive::Drive;
use crate::simulate::equilibrium::shoulder_contact;
use crate::simulate::mode::TipMode;
use crate::simulate::outputs::SampleObserver;
use crate::simulate::phases::{DrivenBlade, SlipPhase, pose_from_states};
use crate::simulate::scene::contact::ContactLossRule;
use crate::simulate::scene::{Scene, StartKind};
use crate::simulate::sensitivity::{
    Channel, TangentDirection, TangentObserver, TangentRunner, TangentSeeds, TangentSegment,
};
use crate::simulate::{
    Observer, RunResult, RunStatus, SolutionSegment, SolverOptions, Transition, run_scene_with,
};
use hybrid_ode::HybridPhase;
use nalgebra::{DMatrix, DVector, Schur};
use portable_math as math;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::ops::ControlFlow;

/// Relative tolerance of the runs.
const TOLERANCE: f64 = 1e-12;
/// Largest number of evaluations of the right-hand side in one run over a period.
const MOST_EVALUATIONS: u64 = 40_000;

/// A periodic motion.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PeriodicMotion {
    /// Speed of the head, m/s, without sign.
    pub speed_m_per_s: f64,
    /// Length of a period, s.
    pub period_s: f64,
    /// State at an instant at which the tip is as fast as the head.
    pub pose: Pose,
    /// Length of each stick in a period, s.
    pub sticks_s: Vec<f64>,
    /// Half the range of the distance between tip and head, m.
    pub amplitude_m: f64,
    /// Multipliers of the return map on the instants at which the tip is as fast as the head: factors by
    /// which a small deviation changes in a period, as real and imaginary part. Their number is one less than
    /// that of the states.
    pub multipliers: Vec<[f64; 2]>,
}

impl PeriodicMotion {
    /// Number of periods per second, Hz.
    #[must_use]
    pub fn frequency_hz(&self) -> f64 {
        1.0 / self.period_s
    }

    /// Time of stick in a period, s.
    #[must_use]
    pub fn stick_s(&self) -> f64 {
        self.sticks_s.iter().fold(0.0, |sum, stick_s| sum + stick_s)
    }

    /// Size of the largest multiplier.
    #[must_use]
    pub fn largest_multiplier(&self) -> f64 {
        self.multipliers.iter().map(|[re, im]| math::hypot(*re, *im)).fold(0.0, f64::max)
    }

    /// Whether small deviations die out.
    #[must_use]
    pub fn is_stable(&self) -> bool {
        self.largest_multiplier() < 1.0
    }
}

/// The unknowns of a periodic motion, divided by their scales: the states, the period, the speed.
pub(super) type Unknowns = DVector<f64>;

/// A solution of the conditions.
#[derive(Debug, Clone)]
pub(super) struct Solution {
    pub unknowns: Unknowns,
    /// Derivatives of all conditions by all unknowns.
    pub jacobian: DMatrix<f64>,
    /// Length of each stick in the period, s.
    pub sticks_s: Vec<f64>,
    /// Derivatives of the state after a period by the state.
    monodromy: DMatrix<f64>,
}

/// Finds periodic motions of a scene's blade or slider in one direction.
pub(super) struct CycleShooter {
    scene: Scene,
    seeds: TangentSeeds,
    runner: TangentRunner,
    direction: f64,
    /// Indices of the states that can change: those of a blade, or of the lip, which stands for a slider.
    states: Vec<usize>,
    scales: Vec<f64>,
    /// Number of runs so far.
    pub runs: usize,
    /// Why the last run gave no derivatives.
    pub problem: &'static str,
}

impl CycleShooter {
    /// `speed_m_per_s` and `period_s` are typical of the motions.
    pub(super) fn new(scene: &Scene, direction: f64, speed_m_per_s: f64, period_s: f64) -> Self {
        let mut scene = scene.clone();
        scene.drive = Drive::Uniform { speed_m_per_s: direction * speed_m_per_s };
        scene.loss = ContactLossRule::Stop;
        scene.start_s = 0.0;
        let is_slider = scene.linkage.is_slider();
        let length = if is_slider { 0.0 } else { scene.linkage.l1_m } + scene.linkage.l2_m;
        let states = if is_slider { vec![1, 3] } else { vec![0, 1, 2, 3] };
        let all = [
            TangentDirection::NeckAngle,
            TangentDirection::LipAngle,
            TangentDirection::NeckRate,
            TangentDirection::LipRate,
        ];
        let mut directions: Vec<TangentDirection> = states.iter().map(|&i| all[i].clone()).collect();
        directions.push(TangentDirection::DriveScale);
        // these directions belong to every scene
        let seeds = TangentSeeds::new(&scene, &directions).unwrap_or_else(|_| unreachable!());
        let rate = speed_m_per_s / length;
        let angle = rate * period_s / TAU;
        let mut scales: Vec<f64> = states.iter().map(|&i| if i < 2 { angle } else { rate }).collect();
        scales.extend([period_s, speed_m_per_s]);
        Self {
            scene,
            seeds,
            runner: TangentRunner::default(),
            direction,
            states,
            scales,
            runs: 0,
            problem: "",
        }
    }

    /// Number of the states.
    pub(super) fn state_count(&self) -> usize {
        self.states.len()
    }

    /// Pose, period and speed as unknowns.
    pub(super) fn unknowns_from(&self, pose: &Pose, period_s: f64, speed_m_per_s: f64) -> Unknowns {
        let all = pose_states(pose);
        let states = self.states.iter().map(|&i| all[i]);
        let values = states.chain([period_s, speed_m_per_s]);
        Unknowns::from_iterator(
            self.scales.len(),
            values.zip(&self.scales).map(|(value, scale)| value / scale),
        )
    }

    /// Speed, m/s.
    pub(super) fn speed_of(&self, unknowns: &Unknowns) -> f64 {
        let last = self.scales.len() - 1;
        unknowns[last] * self.scales[last]
    }

    pub(super) fn period_of(&self, unknowns: &Unknowns) -> f64 {
        let place = self.state_count();
        unknowns[place] * self.scales[place]
    }

    pub(super) fn pose_of(&self, unknowns: &Unknowns) -> Pose {
        let mut all = [0.0; 4];
        for (place, &i) in self.states.iter().enumerate() {
            all[i] = unknowns[place] * self.scales[place];
        }
        pose_from_states(&all)
    }

    /// Velocity of the tip minus that of the head in the direction of slip, divided by the speed scale.
    fn lead_of(&self, unknowns: &Unknowns) -> f64 {
        let pose = self.pose_of(unknowns);
        let scale = self.scales[self.state_count() + 1];
        self.direction * lead_m_per_s(&self.scene.linkage, &pose) / scale
    }

    /// Rates of the states while the tip slips at about the speed of the head, in scales per s.
    fn slip_rates(&self, pose: &Pose) -> Vec<f64> {
        let Scene { linkage, drive, .. } = &self.scene;
        let (linkage, drive) = (*linkage, drive.clone());
        let system = DrivenBlade { linkage, drive, angle_scale: 1.0, rate_scale: 1.0 };
        let lean = shoulder_contact(&linkage, pose.theta);
        let phase = SlipPhase { system: &system, direction: self.direction, lean, piece: 0 };
        let all = phase.derivative(0.0, &pose_states(pose));
        self.states.iter().zip(&self.scales).map(|(&i, scale)| all[i] / scale).collect()
    }

    /// Runs a period; the conditions and their derivatives.
    fn shoot(&mut self, unknowns: &Unknowns) -> Option<(DVector<f64>, Solution)> {
        let n = self.state_count();
        let (period_s, speed) = (self.period_of(unknowns), self.speed_of(unknowns));
        if !(period_s > 0.0 && speed > 0.0 && unknowns.iter().all(|x| x.is_finite())) {
            self.problem = "the iteration left the range of the model";
            return None;
        }
        self.scene.drive = Drive::Uniform { speed_m_per_s: self.direction * speed };
        self.scene.run.stop_s = period_s;
        self.scene.start = StartKind::State(self.pose_of(unknowns));
        let mut last = PeriodEnd {
            pose: self.pose_of(unknowns),
            derivatives: vec![vec![0.0; n + 1]; 4],
            is_known: false,
            transitions: Vec::new(),
        };
        self.runs += 1;
        let effort = SolverOptions { most_evaluations: MOST_EVALUATIONS, ..SolverOptions::new(TOLERANCE) };
        let result = self.runner.run_scene(&self.scene, effort, &self.seeds, &mut last);
        if result.status != RunStatus::Completed {
            self.problem = result.status.meaning();
            return None;
        }
        if !last.is_known {
            self.problem = "a transition has no derivative there (grazing)";
            return None;
        }
        let rates = self.slip_rates(&last.pose);
        let end = self.unknowns_from(&last.pose, period_s, speed);
        let mut jacobian = DMatrix::zeros(n + 1, n + 2);
        let mut monodromy = DMatrix::zeros(n, n);
        let mut residual = DVector::zeros(n + 1);
        for row in 0..n {
            residual[row] = end[row] - unknowns[row];
            let derivatives = &last.derivatives[self.states[row]];
            for column in 0..n {
                monodromy[(row, column)] = derivatives[column] * self.scales[column] / self.scales[row];
                jacobian[(row, column)] = monodromy[(row, column)] - f64::from(u8::from(row == column));
            }
            jacobian[(row, n)] = rates[row] * self.scales[n];
            jacobian[(row, n + 1)] = derivatives[n] / speed * self.scales[n + 1] / self.scales[row];
        }
        residual[n] = self.lead_of(unknowns);
        let gradient = self.lead_gradient(unknowns);
        (0..n).for_each(|column| jacobian[(n, column)] = gradient[column]);
        let sticks_s = last.sticks_s();
        Some((residual, Solution { unknowns: unknowns.clone(), jacobian, sticks_s, monodromy }))
    }

    /// The conditions linearised at unknowns that need not meet them.
    pub(super) fn linearise(&mut self, unknowns: &Unknowns) -> Option<Solution> {
        Some(self.shoot(unknowns)?.1)
    }

    /// Direction of the vibrations without stick that begin at steady sliding, if a mode of the period of
    /// these unknowns neither grows nor decays there. Its length is 1.
    pub(super) fn small_vibration_at(&mut self, rest: &Unknowns) -> Option<Unknowns> {
        let n = self.state_count();
        let conditions = self.linearise(rest)?.jacobian.columns(0, n).into_owned();
        let turned = conditions.try_svd(false, true, f64::EPSILON, 400)?.v_t?;
        let last = turned.row(turned.nrows() - 1);
        Some(Unknowns::from_fn(n + 2, |i, _| if i < n { last[i] } else { 0.0 }))
    }

    /// Derivatives of [`Self::lead_of`] by the states.
    fn lead_gradient(&self, unknowns: &Unknowns) -> Vec<f64> {
        /// Step of the central difference, in scales.
        const STEP: f64 = 1e-4;
        let shifted = |place: usize, step: f64| {
            let mut moved = unknowns.clone();
            moved[place] += step;
            self.lead_of(&moved)
        };
        (0..self.state_count())
            .map(|place| (shifted(place, STEP) - shifted(place, -STEP)) / (2.0 * STEP))
            .collect()
    }

    /// Newton's iteration from a guess, on the plane through the guess that is normal to `normal`.
    pub(super) fn solve(&mut self, guess: &Unknowns, normal: &Unknowns) -> Option<Solution> {
        const MOST_STEPS: usize = 10;
        /// The residual at which the iteration has converged, in scales; the errors of a run are larger than
        /// `BEST` in some blades.
        const CONVERGED: f64 = 1e-8;
        const BEST: f64 = 1e-11;
        /// A step longer than this one, in scales, has left the neighbourhood of the guess.
        const LONGEST: f64 = 3.0;
        let count = guess.len();
        self.problem = "";
        let mut unknowns = guess.clone();
        let mut best: Option<(f64, Solution)> = None;
        for _ in 0..MOST_STEPS {
            let Some((residual, solution)) = self.shoot(&unknowns) else { break };
            let size = residual.amax();
            let matrix = border(&solution.jacobian, normal);
            if best.as_ref().is_some_and(|(least, _)| *least < CONVERGED && size > 0.5 * least) {
                break;
            }
            best = Some((size, solution));
            if size < BEST {
                break;
            }
            let mut right = residual.insert_row(count - 1, 0.0);
            right[count - 1] = normal.dot(&(&unknowns - guess));
            let Some(step) = matrix.lu().solve(&right).filter(|step| step.amax() < LONGEST) else {
                self.problem = "the iteration does not converge";
                return None;
            };
            unknowns -= step;
        }
        let found = best.filter(|(size, _)| *size < CONVERGED);
        if found.is_none() && self.problem.is_empty() {
            self.problem = "the iteration does not converge";
        }
        found.map(|(_, solution)| solution)
    }

    /// Direction of the branch at a solution, of length 1; its sign is that of its product with `along`.
    pub(super) fn tangent_of(&self, solution: &Solution, along: &Unknowns) -> Option<Unknowns> {
        let count = along.len();
        let mut right = DVector::zeros(count);
        right[count - 1] = 1.0;
        let tangent = border(&solution.jacobian, along).lu().solve(&right)?;
        let length = tangent.norm();
        (length.is_finite() && length > 0.0).then(|| tangent / length)
    }

    /// Multipliers of a solution: eigenvalues of the monodromy, projected along the motion on states at which
    /// the tip is as fast as the head.
    fn multipliers_of(&self, solution: &Solution) -> Vec<[f64; 2]> {
        let n = self.state_count();
        let rates = DVector::from_vec(self.slip_rates(&self.pose_of(&solution.unknowns)));
        let gradient = DVector::from_vec(self.lead_gradient(&solution.unknowns));
        let onto = DMatrix::identity(n, n) - &rates * gradient.transpose() / gradient.dot(&rates);
        let map = onto * &solution.monodromy;
        let found = Schur::try_new(map, f64::EPSILON, 400).map(|schur| schur.complex_eigenvalues());
        let mut found: Vec<_> = found.iter().flat_map(|all| all.iter().map(|e| [e.re, e.im])).collect();
        math::sort_by_number(&mut found, |a| -math::hypot(a[0], a[1]));
        found.truncate(n - 1); // the projection makes the last one zero
        found
    }

    /// The motion of a solution.
    pub(super) fn describe(&mut self, solution: &Solution) -> PeriodicMotion {
        /// Number of intervals of a period between the instants at which the deflection is read.
        const INSTANTS: u32 = 1000;
        let (period_s, pose) = (self.period_of(&solution.unknowns), self.pose_of(&solution.unknowns));
        let speed = self.speed_of(&solution.unknowns);
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        let instants = (0..=INSTANTS).map(|i| period_s * f64::from(i) / f64::from(INSTANTS));
        let mut sampler = SampleObserver::new(instants, |sample| {
            let deflection = sample.tip_x_m - sample.head_x_m;
            range = [range[0].min(deflection), range[1].max(deflection)];
        });
        self.run_from(pose, speed, period_s, MOST_EVALUATIONS, &mut sampler);
        PeriodicMotion {
            speed_m_per_s: speed,
            period_s,
            pose,
            sticks_s: solution.sticks_s.clone(),
            amplitude_m: 0.5 * (range[1] - range[0]),
            multipliers: self.multipliers_of(solution),
        }
    }

    /// Number of sticks in a run from a state; `None` if the run stops early.
    pub(super) fn count_sticks(&mut self, pose: Pose, speed: f64, length_s: f64) -> Option<usize> {
        let mut passes = self.watch_passes(usize::MAX);
        let result = self.run_from(pose, speed, length_s, MOST_EVALUATIONS, &mut passes);
        (result.status == RunStatus::Completed).then_some(passes.sticks)
    }

    fn watch_passes(&self, most: usize) -> LeadPasses {
        let (linkage, direction) = (self.scene.linkage, self.direction);
        LeadPasses { linkage, direction, most, found: Vec::new(), sticks: 0 }
    }

    /// Runs the blade from a state.
    pub(super) fn run_from(
        &mut self,
        pose: Pose,
        speed: f64,
        length_s: f64,
        most_evaluations: u64,
        observer: &mut impl Observer,
    ) -> RunResult {
        self.scene.drive = Drive::Uniform { speed_m_per_s: self.direction * speed };
        self.scene.run.stop_s = length_s;
        self.scene.start = StartKind::State(pose);
        let effort = SolverOptions { most_evaluations, ..SolverOptions::new(1e-10) };
        run_scene_with(&self.scene, effort, observer)
    }

    /// A cycle with stick that the blade reaches at a speed, m/s, from a state.
    ///
    /// # Errors
    /// Whether the tip still sticks in the second half of the last run.
    pub(super) fn settle(&mut self, start: Pose, speed: f64) -> Result<Solution, bool> {
        /// Instants at which the tip is as fast as the head in each run. After only a few of them, a slower
        /// vibration has not yet grown, and the run can still be near an unstable cycle.
        const INSTANTS: [usize; 5] = [8, 30, 300, 300, 300];
        /// Largest number of these instants in a cycle.
        const LONGEST: usize = 6;
        /// Distance, in scales, below which a state may be one period after another.
        const NEAR: f64 = 3.0;
        let (mut pose, mut still_sticks) = (start, false);
        for instants in INSTANTS {
            let mut passes = self.watch_passes(instants);
            let longest_s = 20.0 * instants as f64 * self.scales[self.state_count()];
            self.run_from(pose, speed, longest_s, 3_000_000, &mut passes);
            let found = &passes.found;
            let Some(last) = found.last() else { return Err(false) };
            still_sticks = found[found.len() / 2].2 < last.2;
            let at = self.unknowns_from(&last.1, 0.0, speed);
            let most = LONGEST.min(found.len() - 1);
            for apart in 1..=most {
                let before = &found[found.len() - 1 - apart];
                let period_s = last.0 - before.0;
                let distance = (self.unknowns_from(&before.1, 0.0, speed) - &at).amax();
                if distance > NEAR || last.2 == before.2 {
                    continue;
                }
                let guess = self.unknowns_from(&last.1, period_s, speed);
                let by_speed = by_speed(guess.len());
                if let Some(solution) = self.solve(&guess, &by_speed).filter(|s| !s.sticks_s.is_empty()) {
                    return Ok(solution);
                }
            }
            pose = last.1;
        }
        Err(still_sticks)
    }
}

/// Adds a row to a matrix with one row less than columns.
fn border(jacobian: &DMatrix<f64>, row: &Unknowns) -> DMatrix<f64> {
    let last = jacobian.nrows();
    let mut matrix = jacobian.clone().insert_row(last, 0.0);
    matrix.set_row(last, &row.transpose());
    matrix
}

/// The direction in which the speed alone rises.
pub(super) fn by_speed(unknowns: usize) -> Unknowns {
    let mut direction = Unknowns::zeros(unknowns);
    direction[unknowns - 1] = 1.0;
    direction
}

fn pose_states(pose: &Pose) -> [f64; 4] {
    [pose.theta, pose.phi, pose.theta_rate, pose.phi_rate]
}

/// Velocity of the tip minus that of the head, m/s.
pub(super) fn lead_m_per_s(linkage: &Linkage, pose: &Pose) -> f64 {
    let still = HeadMotion { position_m: 0.0, velocity_m_per_s: 0.0, acceleration_m_per_s2: 0.0 };
    linkage.tip_velocity_m_per_s(pose, &LinkDirections::from_pose(pose), &still)
}

/// End of a run over a period.
struct PeriodEnd {
    pose: Pose,
    derivatives: Vec<Vec<f64>>,
    is_known: bool,
    transitions: Vec<Transition>,
}

impl PeriodEnd {
    fn sticks_s(&self) -> Vec<f64> {
        let pairs = self.transitions.windows(2).filter(|pair| pair[0].to == TipMode::Stick);
        pairs.map(|pair| pair[1].time_s - pair[0].time_s).collect()
    }
}

impl TangentObserver for PeriodEnd {
    fn observe_segment(&mut self, piece: &TangentSegment<'_>) {
        const CHANNELS: [Channel; 4] =
            [Channel::NeckAngle, Channel::LipAngle, Channel::NeckRate, Channel::LipRate];
        self.is_known = piece.is_known;
        self.pose = piece.sample_at(piece.end_s).pose;
        let weights = piece.weights_at(piece.end_s);
        for (channel, row) in CHANNELS.into_iter().zip(&mut self.derivatives) {
            piece.channel_derivatives(channel, &weights, row);
        }
    }
    fn observe_transition(&mut self, transition: &Transition, _: Option<&[f64]>) {
        self.transitions.push(*transition);
    }
}

/// Instants at which the tip becomes faster than the head, each with its time, state, and number of sticks so
/// far.
struct LeadPasses {
    linkage: Linkage,
    direction: f64,
    most: usize,
    found: Vec<(f64, Pose, usize)>,
    sticks: usize,
}

impl Observer for LeadPasses {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        let lead = |t: f64| self.direction * lead_m_per_s(&self.linkage, &piece.pose_at(t));
        if piece.mode == TipMode::Stick || lead(piece.start_s) >= 0.0 || lead(piece.end_s) < 0.0 {
            return;
        }
        let [mut before, mut after] = [piece.start_s, piece.end_s];
        for _ in 0..50 {
            let middle = 0.5 * (before + after);
            if lead(middle) < 0.0 { before = middle } else { after = middle }
        }
        self.found.push((after, piece.pose_at(after), self.sticks));
    }
    fn observe_transition(&mut self, transition: &Transition) {
        self.sticks += usize::from(transition.to == TipMode::Stick);
    }
    fn control_flow(&self) -> ControlFlow<()> {
        if self.found.len() >= self.most { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}
