//! Propagation of derivatives over the stretches of a piece, in blocks of directions.

#![allow(clippy::needless_range_loop)] // indices as in the equations

use super::seeds::{BlockSeed, TangentSeeds};
use super::stretch::{SeriesReference, StretchPlace, StretchPlanner, TangentStretch, bound_rate};
use crate::model::series::ContactMode;
use crate::model::tangent::{
    LANES, LaneVector, LinkAttitudes, MotionSamples, StateTangent, TangentMatrices, fill_lanes,
};
use crate::simulate::mode::TipMode;
use crate::simulate::phases::{DrivenBlade, TaylorMotion};
use hybrid_ode::collocation::{CollocationEquations, CollocationStep, MOST_NODES, NodeArray};

/// Derivatives with respect to the directions of a block.
#[derive(Debug, Default)]
pub(super) struct TangentBlock {
    /// The unknowns at the start of the last stretch: derivatives of the sines of both angles and of the gap.
    pub value: [LaneVector; 3],
    /// First time derivatives of the unknowns at the start of the last stretch.
    pub rate: [LaneVector; 3],
    /// Derivative of the tip's position in stick, m.
    pub place: LaneVector,
    /// Second time derivatives of the unknowns at the nodes of the stretch.
    pub second: NodeArray<[LaneVector; 3]>,
    /// Derivatives of the state at the end of the last stretch, or at the transition time there.
    pub state: StateTangent,
    /// Derivatives of the guard that has fallen to zero.
    pub guard: LaneVector,
    /// Derivatives of the transition time, s per unit of each direction.
    pub time: LaneVector,
}

/// Equations of a stretch with `D` unknowns.
#[derive(Debug, Default)]
struct StretchEquations<const D: usize> {
    equations: CollocationEquations<D>,
    step: CollocationStep<D>,
}

/// Workspace of the equations, kept from run to run.
#[derive(Debug, Default)]
pub(super) struct StretchWorkspace {
    stick: Box<StretchEquations<1>>,
    slip: Box<StretchEquations<2>>,
    flight: Box<StretchEquations<3>>,
    instants: Vec<MotionSamples>,
    /// Forcing terms of each source at the nodes.
    loads: Vec<NodeArray<[f64; 3]>>,
    /// Coefficients of the follower `y2` in stick, in groups of four nodes.
    held: Vec<[LaneVector; 3]>,
    /// Forcing terms of the tip's position in stick.
    per_place: NodeArray<f64>,
}

/// All directions of a run with their workspace.
pub(super) struct TangentBlocks<'a> {
    pub system: &'a DrivenBlade,
    pub seeds: &'a TangentSeeds,
    pub all: &'a mut [TangentBlock],
    pub works: &'a mut StretchWorkspace,
    pub pace: StretchPlanner,
}

/// Both ends of a stretch: angles and rates of the links, and displacement and velocity of the tip by each
/// source.
struct StretchEnds {
    attitude: LinkAttitudes,
    tip: Vec<[LaneVector; 2]>,
}

impl<'a> TangentBlocks<'a> {
    /// The blocks, each with its seed.
    pub(crate) fn iter_with_seeds(&mut self) -> impl Iterator<Item = (&mut TangentBlock, &BlockSeed)> {
        self.all.iter_mut().zip(&self.seeds.blocks)
    }

    /// Propagates the derivatives over the next stretch, which begins at `from` and ends at or before `to`;
    /// both are in s after `start_s`. If `is_fresh` is true, a phase begins at `from`; if it is a stick
    /// phase, the derivative of the tip's velocity may still be nonzero there.
    pub(crate) fn propagate_stretch<'c>(
        &mut self,
        course: &SeriesReference<'c>,
        start_s: f64,
        [from, to]: [f64; 2],
        is_fresh: bool,
    ) -> TangentStretch<'c>
    where
        'a: 'c,
    {
        match course.touch {
            ContactMode::Stick => self.collocate_stretch::<1>(course, start_s, [from, to], is_fresh),
            ContactMode::Slip(_) => self.collocate_stretch::<2>(course, start_s, [from, to], is_fresh),
            ContactMode::Flight(..) => self.collocate_stretch::<3>(course, start_s, [from, to], is_fresh),
        }
    }

    fn collocate_stretch<'c, const D: usize>(
        &mut self,
        course: &SeriesReference<'c>,
        start_s: f64,
        [from, to]: [f64; 2],
        is_fresh: bool,
    ) -> TangentStretch<'c>
    where
        StretchWorkspace: SelectEquations<D>,
        'a: 'c,
    {
        /// Maximum number of times that a stretch is planned before its rate is accepted.
        const MOST_LOOKS: usize = 4;
        let mut looks = 0;
        let span = loop {
            let (rule, length) = self.pace.plan(course, to - from);
            let SeriesReference { touch, lean, .. } = *course;
            let place = StretchPlace { touch, lean, start_s, from, length, rule, rapid: 0.0 };
            let mut span = TangentStretch::new(self.system, &self.seeds.sources, *course, place);
            let found = self.works.set_up_equations::<D>(&span);
            looks += 1;
            let resolved = self.pace.record_rate(course, found, rule, length);
            if resolved || looks == MOST_LOOKS {
                span.place.rapid = found;
                break span;
            }
        };
        self.works.compute_loads::<D>(&span);
        let StretchPlace { rule, length, .. } = span.place;
        let StretchEquations { equations, step } = self.works.equations_mut();
        step.factor(rule, length, equations);
        let ends = StretchEnds::from_stretch(&span);
        let hold = (is_fresh && D == 1).then(|| StickImpulse::from_stretch(&span));
        for (block, seed) in self.all.iter_mut().zip(&self.seeds.blocks) {
            block.start_stretch(&span, &ends, seed, hold.as_ref());
            self.works.solve::<D>(&span, block, seed);
            block.finish::<D>(&span, &ends, seed);
        }
        span
    }

    /// Whether all derivatives are finite.
    pub(crate) fn are_finite(&self) -> bool {
        self.all.iter().all(|block| block.state.is_finite())
    }
}

/// Selects the equations with `D` unknowns.
trait SelectEquations<const D: usize> {
    fn equations_mut(&mut self) -> &mut StretchEquations<D>;
}

macro_rules! select_equations {
    ($($unknowns:literal $field:ident),*) => {
        $(impl SelectEquations<$unknowns> for StretchWorkspace {
            fn equations_mut(&mut self) -> &mut StretchEquations<$unknowns> {
                &mut self.$field
            }
        })*
    };
}
select_equations!(1 stick, 2 slip, 3 flight);

impl StretchWorkspace {
    /// Sets up the equations at the nodes of a stretch; returns the rate of the fastest derivative, 1/s.
    fn set_up_equations<const D: usize>(&mut self, span: &TangentStretch<'_>) -> f64
    where
        Self: SelectEquations<D>,
    {
        let (nodes, l2) = (span.place.rule.nodes, span.system.linkage.l2_m);
        self.instants.clear();
        self.held.clear();
        for (chunk, x) in span.node_chunks().enumerate() {
            let at = span.course.sample_motion(x);
            let matrices = span.course.tangent_matrices(&at);
            let single = (D == 1).then(|| span.course.stick_equation(&matrices));
            for lane in 0..LANES.min(nodes - chunk * LANES) {
                let node = chunk * LANES + lane;
                if let Some(single) = &single {
                    self.per_place[node] = single.second[2][lane] / l2;
                }
                let CollocationEquations { mass, damping, stiffness } = &mut self.equations_mut().equations;
                for (k, square) in [mass, damping, stiffness].into_iter().enumerate() {
                    square[node] = match &single {
                        Some(single) => [[single.first[k][lane]; D]; D],
                        None => square_at_lane(&matrices, k, lane),
                    };
                }
            }
            self.held.extend(single.map(|single| single.second));
            self.instants.push(at);
        }
        let CollocationEquations { mass, damping, stiffness } = &self.equations_mut().equations;
        let rates = [0, nodes - 1].map(|i| bound_rate(&mass[i], &damping[i], &stiffness[i]));
        rates.into_iter().fold(0.0, f64::max)
    }

    /// Computes the forcing terms of each source at the nodes.
    fn compute_loads<const D: usize>(&mut self, span: &TangentStretch<'_>) {
        let (course, nodes) = (&span.course, span.place.rule.nodes);
        let (l1, l2) = (span.system.linkage.l1_m, span.system.linkage.l2_m);
        self.loads.resize(span.sources.len(), [[0.0; 3]; MOST_NODES]);
        for (chunk, at) in self.instants.iter().enumerate() {
            for (source, load) in span.sources.iter().zip(&mut self.loads) {
                if !source.affects_motion(course) {
                    continue;
                }
                let effect = source.forcing_terms(course, span.head.as_ref(), at);
                let mut all = effect.equations;
                if let Some(second) = self.held.get(chunk) {
                    all[0] = l2 * all[0] - l1 * all[1];
                    for k in 0..3 {
                        all[0] -= (1.0 / l2) * (second[k] * effect.tip[2 - k]);
                    }
                }
                for lane in 0..LANES.min(nodes - chunk * LANES) {
                    load[chunk * LANES + lane] = [all[0][lane], all[1][lane], all[2][lane]];
                }
            }
        }
    }

    /// Solves for the second derivatives of the unknowns of a block at the nodes.
    #[inline(always)]
    fn solve<const D: usize>(&mut self, span: &TangentStretch<'_>, block: &mut TangentBlock, seed: &BlockSeed)
    where
        Self: SelectEquations<D>,
    {
        let StretchPlace { rule, length, .. } = span.place;
        let mut rows = [[LaneVector::ZERO; D]; MOST_NODES];
        let StretchEquations { equations, .. } = self.equations_mut();
        for (i, row) in rows[..rule.nodes].iter_mut().enumerate() {
            let x = length * rule.positions[i];
            let (damping, stiffness) = (&equations.damping[i], &equations.stiffness[i]);
            for r in 0..D {
                for c in 0..D {
                    row[r].add_scaled(-stiffness[r][c], &block.value[c]);
                    row[r].add_scaled(-damping[r][c] - x * stiffness[r][c], &block.rate[c]);
                }
            }
        }
        if D == 1 {
            for (row, per_place) in rows[..rule.nodes].iter_mut().zip(&self.per_place) {
                row[0].add_scaled(-per_place, &block.place);
            }
        }
        for change in &seed.changes {
            if !span.sources[change.source].affects_motion(&span.course) {
                continue;
            }
            for (row, load) in rows[..rule.nodes].iter_mut().zip(&self.loads[change.source]) {
                for r in 0..D {
                    row[r][change.lane] -= change.factor * load[r];
                }
            }
        }
        self.equations_mut().step.solve(&mut rows);
        for (second, row) in block.second.iter_mut().zip(&rows[..rule.nodes]) {
            second[..D].copy_from_slice(row);
        }
    }
}

fn square_at_lane<const D: usize>(matrices: &TangentMatrices, k: usize, lane: usize) -> [[f64; D]; D] {
    let matrix = [&matrices.mass, &matrices.damping, &matrices.stiffness][k];
    std::array::from_fn(|r| std::array::from_fn(|c| matrix[r][c][lane]))
}

impl StretchEnds {
    fn from_stretch(span: &TangentStretch<'_>) -> Self {
        let StretchPlace { touch, from, length, .. } = span.place;
        let attitude = span.course.sample_attitudes(fill_lanes([from, from + length]));
        let mut tip = Vec::new();
        if touch == ContactMode::Stick
            && span.sources.iter().any(|source| source.displaces_points(&span.course))
        {
            tip.extend(span.sources.iter().map(|source| {
                let effect = source.displacement_terms(&span.course, span.head.as_ref(), &attitude);
                [effect.tip[0], effect.tip[1]]
            }));
        }
        Self { attitude, tip }
    }

    /// Derivatives of the tip's position and velocity at fixed angles, at the start (`end` 0) or the end
    /// (`end` 1) of the stretch.
    fn tip_change(&self, seed: &BlockSeed, end: usize) -> [LaneVector; 2] {
        let mut rows = [LaneVector::ZERO; 2];
        if !self.tip.is_empty() {
            for change in &seed.changes {
                for (row, tip) in rows.iter_mut().zip(&self.tip[change.source]) {
                    row[change.lane] += change.factor * tip[end];
                }
            }
        }
        rows
    }
}

/// Changes of the rates of both sines by an impulse on the tip, per change of the tip's velocity.
struct StickImpulse([f64; 2]);

impl StickImpulse {
    fn from_stretch(span: &TangentStretch<'_>) -> Self {
        let at = span.course.sample_motion(fill_lanes([span.place.from]));
        let mass = span.course.tangent_matrices(&at).mass;
        let [[a, b], [c, d]] = [0, 1].map(|i| [mass[i][0][0], mass[i][1][0]]);
        let (l1, l2) = (span.system.linkage.l1_m, span.system.linkage.l2_m);
        let moved = [d * l1 - b * l2, a * l2 - c * l1];
        let share = 1.0 / (l1 * moved[0] + l2 * moved[1]);
        Self(moved.map(|moved| share * moved))
    }
}

/// Rates of angles, angular rates, gap and gap rate at `x` s after the start of a motion; on the glass, the
/// gap is constant.
pub(super) fn rates_after(motion: &TaylorMotion, mode: TipMode, x: f64) -> [f64; 6] {
    let mut rates = [0.0; 6];
    for k in (1..=motion.order).rev() {
        let (power, before) = (k as f64, k - 1);
        let last = [
            motion.rate[before][0],
            motion.rate[before][1],
            power * motion.rate[k][0],
            power * motion.rate[k][1],
            motion.gap_rate[before],
            power * motion.gap_rate[k],
        ];
        rates = std::array::from_fn(|i| rates[i] * x + last[i]);
    }
    if mode != TipMode::Flight {
        (rates[4], rates[5]) = (0.0, 0.0);
    }
    rates
}

impl StateTangent {
    /// Adds `rates * time` to the derivatives of the state: the effect of a change of the instant at which
    /// the state is taken, where `time` is the derivative of this instant, s.
    pub(super) fn shift_in_time(&mut self, rates: &[f64; 6], time: LaneVector) {
        let ([theta, phi], [theta_rate, phi_rate]) = (&mut self.angle, &mut self.rate);
        let rows = [theta, phi, theta_rate, phi_rate, &mut self.gap_m, &mut self.gap_rate];
        rows.into_iter().zip(rates).for_each(|(row, rate)| row.add_scaled(*rate, &time));
    }

    /// Adds the derivatives of another state.
    pub(super) fn add(&mut self, other: &Self) {
        for i in 0..2 {
            self.angle[i] += other.angle[i];
            self.rate[i] += other.rate[i];
        }
        self.gap_m += other.gap_m;
        self.gap_rate += other.gap_rate;
    }

    fn is_finite(&self) -> bool {
        let Self { angle, rate, gap_m, gap_rate } = self;
        [angle[0], angle[1], rate[0], rate[1], *gap_m, *gap_rate].iter().all(LaneVector::is_finite)
    }
}

impl TangentBlock {
    /// Sets the unknowns at the start of a stretch from the derivatives of the state.
    fn start_stretch(
        &mut self,
        span: &TangentStretch<'_>,
        ends: &StretchEnds,
        seed: &BlockSeed,
        hold: Option<&StickImpulse>,
    ) {
        const START: usize = 0;
        let LinkAttitudes { cos, sin, rate, .. } = &ends.attitude;
        for i in 0..2 {
            let (angle, turned) = (self.state.angle[i], self.state.rate[i]);
            self.value[i] = cos[i][START] * angle;
            self.rate[i] = cos[i][START] * turned - (sin[i][START] * rate[i][START]) * angle;
        }
        (self.value[2], self.rate[2]) = (self.state.gap_m, self.state.gap_rate);
        if span.place.touch == ContactMode::Stick {
            let ([tip, tip_rate], linkage) = (ends.tip_change(seed, START), &span.system.linkage);
            self.place = tip + linkage.l1_m * self.value[0] + linkage.l2_m * self.value[1];
            if let Some(StickImpulse(per_velocity)) = hold {
                let velocity = tip_rate + linkage.l1_m * self.rate[0] + linkage.l2_m * self.rate[1];
                self.rate[0] -= per_velocity[0] * velocity;
            }
        }
    }

    /// Sets the derivatives of the state at the end of a stretch from the unknowns.
    #[inline(always)]
    fn finish<const D: usize>(&mut self, span: &TangentStretch<'_>, ends: &StretchEnds, seed: &BlockSeed) {
        const END: usize = 1;
        let StretchPlace { touch, length, rule, .. } = span.place;
        let (mut value, mut rate) = (self.value, self.rate);
        for d in 0..D {
            value[d].add_scaled(length, &self.rate[d]);
        }
        for (j, second) in self.second[..rule.nodes].iter().enumerate() {
            let once = length * rule.weights[j];
            let twice = length * once * (1.0 - rule.positions[j]);
            for d in 0..D {
                value[d].add_scaled(twice, &second[d]);
                rate[d].add_scaled(once, &second[d]);
            }
        }
        if touch == ContactMode::Stick {
            let ([tip, tip_rate], linkage) = (ends.tip_change(seed, END), &span.system.linkage);
            let share = 1.0 / linkage.l2_m;
            value[1] = share * (self.place - tip - linkage.l1_m * value[0]);
            rate[1] = -share * (tip_rate + linkage.l1_m * rate[0]);
        }
        let LinkAttitudes { cos, sin, rate: turning, .. } = &ends.attitude;
        for i in 0..2 {
            let secant = 1.0 / cos[i][END];
            self.state.angle[i] = secant * value[i];
            self.state.rate[i] =
                secant * rate[i] + (sin[i][END] * turning[i][END] * secant * secant) * value[i];
        }
        if D == 3 {
            (self.state.gap_m, self.state.gap_rate) = (value[2], rate[2]);
        }
    }
}

impl BlockSeed {
    /// Derivatives of the head's velocity at `t`, m/s per unit of each direction.
    pub(super) fn head_velocity(&self, system: &DrivenBlade, t: f64) -> LaneVector {
        let Some(drive) = &self.drive else { return LaneVector::ZERO };
        let head = system.drive.motion_at(t);
        let shift = t * drive.stretch - drive.delay;
        head.velocity_m_per_s * (drive.scale + drive.stretch) + head.acceleration_m_per_s2 * shift
    }
}

#[cfg(test)]
impl TangentBlock {
    pub(super) fn of_no_numbers() -> Self {
        let none = LaneVector::splat(f64::NAN);
        let (pair, three) = ([none; 2], [none; 3]);
        let state = StateTangent { angle: pair, rate: pair, gap_m: none, gap_rate: none };
        let (value, rate, second) = (three, three, [three; MOST_NODES]);
        Self { value, rate, place: none, second, state, guard: none, time: none }
    }
}

#[cfg(test)]
impl StretchWorkspace {
    pub(super) fn of_no_numbers() -> Self {
        fn spoil<const D: usize>(work: &mut StretchEquations<D>) {
            let CollocationEquations { mass, damping, stiffness } = &mut work.equations;
            for square in [mass, damping, stiffness] {
                *square = [[[f64::NAN; D]; D]; MOST_NODES];
            }
        }
        let mut works = Self { per_place: [f64::NAN; MOST_NODES], ..Self::default() };
        works.loads = vec![[[f64::NAN; 3]; MOST_NODES]; 40];
        spoil(&mut works.stick);
        spoil(&mut works.slip);
        spoil(&mut works.flight);
        works
    }
}
