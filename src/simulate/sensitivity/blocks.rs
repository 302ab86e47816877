//! Derivatives in several directions over one piece.

#![allow(clippy::needless_range_loop)] // indices are those of the equations

use super::seeds::{BlockSeed, Seeds};
use super::span::{Course, Pace, Place, Span, rate_of};
use crate::blade::series::Touch;
use crate::blade::tangent::{Attitude, Instants, LANES, Matrices, Row, StateTangent, row_of};
use crate::ode::collocation::{AtNodes, Equations, MOST_NODES, Step};
use crate::simulate::mode::Mode;
use crate::simulate::phases::{Motion, System};

/// Directions that are carried side by side.
#[derive(Debug, Default)]
pub(super) struct Block {
    /// Derivatives of both sines and of the gap at the start of the last stretch, and their rates.
    pub value: [Row; 3],
    pub rate: [Row; 3],
    /// Of the place where the tip sticks, m.
    pub place: Row,
    /// Second derivatives of the unknowns at the nodes.
    pub second: AtNodes<[Row; 3]>,
    /// Of the state at the end of the last piece, or moved with the transition there.
    pub state: StateTangent,
    /// Of the guard that has fallen, and of the time of the transition.
    pub guard: Row,
    pub time: Row,
}

/// The equations of a stretch.
#[derive(Debug, Default)]
struct Work<const D: usize> {
    equations: Equations<D>,
    step: Step<D>,
}

/// Where the equations of stretches are set up, kept from run to run.
#[derive(Debug, Default)]
pub(super) struct Works {
    stick: Box<Work<1>>,
    slip: Box<Work<2>>,
    flight: Box<Work<3>>,
    instants: Vec<Instants>,
    /// What each source adds to the equations, by node.
    loads: Vec<AtNodes<[f64; 3]>>,
    /// In stick: the factors of `y2`, four nodes a time.
    held: Vec<[Row; 3]>,
    /// In stick: what the place of the tip adds to its equation.
    per_place: AtNodes<f64>,
}

/// All directions of a run, and what they move with.
pub(super) struct Blocks<'a> {
    pub system: &'a System,
    pub seeds: &'a Seeds,
    pub all: &'a mut [Block],
    pub works: &'a mut Works,
    pub pace: Pace,
}

/// Ends of a stretch: where the links point, and how sources move the tip, with the rate.
struct Ends {
    attitude: Attitude,
    tip: Vec<[Row; 2]>,
}

impl<'a> Blocks<'a> {
    /// Blocks with what their directions change.
    pub fn each(&mut self) -> impl Iterator<Item = (&mut Block, &BlockSeed)> {
        self.all.iter_mut().zip(&self.seeds.blocks)
    }

    /// Carries the derivatives over a stretch of a motion that starts at `start_s`, from `from` after it
    /// towards `to`; `is_fresh` where the tip may not yet be at rest in stick.
    pub fn cover<'c>(
        &mut self,
        course: &Course<'c>,
        start_s: f64,
        [from, to]: [f64; 2],
        is_fresh: bool,
    ) -> Span<'c>
    where
        'a: 'c,
    {
        match course.touch {
            Touch::Stick => self.collocate::<1>(course, start_s, [from, to], is_fresh),
            Touch::Slip(_) => self.collocate::<2>(course, start_s, [from, to], is_fresh),
            Touch::Flight(..) => self.collocate::<3>(course, start_s, [from, to], is_fresh),
        }
    }

    fn collocate<'c, const D: usize>(
        &mut self,
        course: &Course<'c>,
        start_s: f64,
        [from, to]: [f64; 2],
        is_fresh: bool,
    ) -> Span<'c>
    where
        Works: Has<D>,
        'a: 'c,
    {
        /// Looks at the rates of a stretch before it is taken as it is.
        const MOST_LOOKS: usize = 4;
        let mut looks = 0;
        let span = loop {
            let (rule, length) = self.pace.plan(course, to - from);
            let Course { touch, lean, .. } = *course;
            let place = Place { touch, lean, start_s, from, length, rule, rapid: 0.0 };
            let mut span = Span::new(self.system, &self.seeds.sources, *course, place);
            let found = self.works.set_up::<D>(&span);
            looks += 1;
            let resolved = self.pace.learn(course, found, rule, length);
            if resolved || looks == MOST_LOOKS {
                span.place.rapid = found;
                break span;
            }
        };
        self.works.load::<D>(&span);
        let Place { rule, length, .. } = span.place;
        let Work { equations, step } = self.works.work();
        step.factor(rule, length, equations);
        let ends = Ends::of(&span);
        let hold = (is_fresh && D == 1).then(|| Hold::of(&span));
        for (block, seed) in self.all.iter_mut().zip(&self.seeds.blocks) {
            block.begin(&span, &ends, seed, hold.as_ref());
            self.works.solve::<D>(&span, block, seed);
            block.finish::<D>(&span, &ends, seed);
        }
        span
    }

    /// Whether all derivatives are numbers.
    pub fn are_finite(&self) -> bool {
        self.all.iter().all(|block| block.state.is_finite())
    }
}

/// The equations of `D` unknowns among those of all.
trait Has<const D: usize> {
    fn work(&mut self) -> &mut Work<D>;
}

impl Has<1> for Works {
    fn work(&mut self) -> &mut Work<1> {
        &mut self.stick
    }
}

impl Has<2> for Works {
    fn work(&mut self) -> &mut Work<2> {
        &mut self.slip
    }
}

impl Has<3> for Works {
    fn work(&mut self) -> &mut Work<3> {
        &mut self.flight
    }
}

impl Works {
    /// Sets up the equations at the nodes of a stretch; the rate of the fastest derivative, 1/s.
    fn set_up<const D: usize>(&mut self, span: &Span<'_>) -> f64
    where
        Self: Has<D>,
    {
        let (nodes, l2) = (span.place.rule.nodes, span.system.linkage.l2_m);
        self.instants.clear();
        self.held.clear();
        for (chunk, x) in span.chunks().enumerate() {
            let at = span.course.instants(x);
            let matrices = span.course.matrices(&at);
            let single = (D == 1).then(|| span.course.single(&matrices));
            for lane in 0..LANES.min(nodes - chunk * LANES) {
                let node = chunk * LANES + lane;
                if let Some(single) = &single {
                    self.per_place[node] = single.second[2][lane] / l2;
                }
                let Equations { mass, damping, stiffness } = &mut self.work().equations;
                for (k, square) in [mass, damping, stiffness].into_iter().enumerate() {
                    square[node] = match &single {
                        Some(single) => [[single.first[k][lane]; D]; D],
                        None => square_of(&matrices, k, lane),
                    };
                }
            }
            self.held.extend(single.map(|single| single.second));
            self.instants.push(at);
        }
        let Equations { mass, damping, stiffness } = &self.work().equations;
        [0, nodes - 1].map(|i| rate_of(&mass[i], &damping[i], &stiffness[i])).into_iter().fold(0.0, f64::max)
    }

    /// What each source adds to the equations at the nodes.
    fn load<const D: usize>(&mut self, span: &Span<'_>) {
        let (course, nodes) = (&span.course, span.place.rule.nodes);
        let linkage = &span.system.linkage;
        let (l1, l2) = (linkage.l1_m, linkage.l2_m);
        self.loads.resize(span.sources.len(), [[0.0; 3]; MOST_NODES]);
        for (chunk, at) in self.instants.iter().enumerate() {
            for (source, load) in span.sources.iter().zip(&mut self.loads) {
                if !source.acts(course) {
                    continue;
                }
                let effect = source.effect(course, span.head.as_ref(), at);
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

    /// Second derivatives of a block at the nodes.
    #[inline(always)]
    fn solve<const D: usize>(&mut self, span: &Span<'_>, block: &mut Block, seed: &BlockSeed)
    where
        Self: Has<D>,
    {
        let Place { rule, length, .. } = span.place;
        let mut rows = [[Row::ZERO; D]; MOST_NODES];
        let Work { equations, .. } = self.work();
        for (i, row) in rows[..rule.nodes].iter_mut().enumerate() {
            let x = length * rule.places[i];
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
            if !span.sources[change.source].acts(&span.course) {
                continue;
            }
            for (row, load) in rows[..rule.nodes].iter_mut().zip(&self.loads[change.source]) {
                for r in 0..D {
                    row[r][change.lane] -= change.factor * load[r];
                }
            }
        }
        self.work().step.solve(&mut rows);
        for (second, row) in block.second.iter_mut().zip(&rows[..rule.nodes]) {
            second[..D].copy_from_slice(row);
        }
    }
}

fn square_of<const D: usize>(matrices: &Matrices, k: usize, lane: usize) -> [[f64; D]; D] {
    let matrix = [&matrices.mass, &matrices.damping, &matrices.stiffness][k];
    std::array::from_fn(|r| std::array::from_fn(|c| matrix[r][c][lane]))
}

impl Ends {
    fn of(span: &Span<'_>) -> Self {
        let Place { touch, from, length, .. } = span.place;
        let attitude = span.course.attitude(row_of([from, from + length]));
        let mut tip = Vec::new();
        if touch == Touch::Stick && span.sources.iter().any(|source| source.moves(&span.course)) {
            tip.extend(span.sources.iter().map(|source| {
                let effect = source.moved(&span.course, span.head.as_ref(), &attitude);
                [effect.tip[0], effect.tip[1]]
            }));
        }
        Self { attitude, tip }
    }

    /// How the tip's place and velocity move with the directions of a block, at the start or at the end.
    fn tip(&self, seed: &BlockSeed, end: usize) -> [Row; 2] {
        let mut rows = [Row::ZERO; 2];
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

/// What an impulse on the tip does to the sines' rates, over the tip's velocity.
struct Hold([f64; 2]);

impl Hold {
    fn of(span: &Span<'_>) -> Self {
        let at = span.course.instants(row_of([span.place.from]));
        let mass = span.course.matrices(&at).mass;
        let [[a, b], [c, d]] = [0, 1].map(|i| [mass[i][0][0], mass[i][1][0]]);
        let (l1, l2) = (span.system.linkage.l1_m, span.system.linkage.l2_m);
        let moved = [d * l1 - b * l2, a * l2 - c * l1];
        let share = 1.0 / (l1 * moved[0] + l2 * moved[1]);
        Self(moved.map(|moved| share * moved))
    }
}

/// Rates of the state at `x` after the start of a motion in this mode: of angles, angular rates, gap and its
/// rate; on the glass the gap stays.
pub(super) fn rates_after(motion: &Motion, mode: Mode, x: f64) -> [f64; 6] {
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
    if mode != Mode::Flight {
        (rates[4], rates[5]) = (0.0, 0.0);
    }
    rates
}

impl StateTangent {
    /// Adds what passes in a time that depends on the direction.
    pub(super) fn shift(&mut self, rates: &[f64; 6], time: Row) {
        let ([theta, phi], [theta_rate, phi_rate]) = (&mut self.angle, &mut self.rate);
        let rows = [theta, phi, theta_rate, phi_rate, &mut self.gap_m, &mut self.gap_rate];
        rows.into_iter().zip(rates).for_each(|(row, rate)| row.add_scaled(*rate, &time));
    }

    fn is_finite(&self) -> bool {
        let Self { angle, rate, gap_m, gap_rate } = self;
        [angle[0], angle[1], rate[0], rate[1], *gap_m, *gap_rate].iter().all(Row::is_finite)
    }
}

impl Block {
    /// The unknowns at the start of a stretch, from the state there.
    fn begin(&mut self, span: &Span<'_>, ends: &Ends, seed: &BlockSeed, hold: Option<&Hold>) {
        const START: usize = 0;
        let Attitude { cos, sin, rate, .. } = &ends.attitude;
        for i in 0..2 {
            let (angle, turned) = (self.state.angle[i], self.state.rate[i]);
            self.value[i] = cos[i][START] * angle;
            self.rate[i] = cos[i][START] * turned - (sin[i][START] * rate[i][START]) * angle;
        }
        (self.value[2], self.rate[2]) = (self.state.gap_m, self.state.gap_rate);
        if span.place.touch == Touch::Stick {
            let ([tip, tip_rate], linkage) = (ends.tip(seed, START), &span.system.linkage);
            self.place = tip + linkage.l1_m * self.value[0] + linkage.l2_m * self.value[1];
            if let Some(Hold(per_velocity)) = hold {
                let velocity = tip_rate + linkage.l1_m * self.rate[0] + linkage.l2_m * self.rate[1];
                self.rate[0] -= per_velocity[0] * velocity;
            }
        }
    }

    /// The state at the end of a stretch.
    #[inline(always)]
    fn finish<const D: usize>(&mut self, span: &Span<'_>, ends: &Ends, seed: &BlockSeed) {
        const END: usize = 1;
        let Place { touch, length, rule, .. } = span.place;
        let (mut value, mut rate) = (self.value, self.rate);
        for d in 0..D {
            value[d].add_scaled(length, &self.rate[d]);
        }
        for (j, second) in self.second[..rule.nodes].iter().enumerate() {
            let once = length * rule.weights[j];
            let twice = length * once * (1.0 - rule.places[j]);
            for d in 0..D {
                value[d].add_scaled(twice, &second[d]);
                rate[d].add_scaled(once, &second[d]);
            }
        }
        if touch == Touch::Stick {
            let ([tip, tip_rate], linkage) = (ends.tip(seed, END), &span.system.linkage);
            let share = 1.0 / linkage.l2_m;
            value[1] = share * (self.place - tip - linkage.l1_m * value[0]);
            rate[1] = -share * (tip_rate + linkage.l1_m * rate[0]);
        }
        let Attitude { cos, sin, rate: turning, .. } = &ends.attitude;
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
    /// Derivatives of the head's velocity at `t`, m/s.
    pub(super) fn head_velocity(&self, system: &System, t: f64) -> Row {
        let Some(drive) = &self.drive else { return Row::ZERO };
        let head = system.drive.at(t);
        let shift = t * drive.stretch - drive.delay;
        head.velocity_m_per_s * (drive.scale + drive.stretch) + head.acceleration_m_per_s2 * shift
    }
}

#[cfg(test)]
impl Block {
    pub(super) fn of_no_numbers() -> Self {
        let none = Row::all(f64::NAN);
        let (pair, three) = ([none; 2], [none; 3]);
        let state = StateTangent { angle: pair, rate: pair, gap_m: none, gap_rate: none };
        let (value, rate, second) = (three, three, [three; MOST_NODES]);
        Self { value, rate, place: none, second, state, guard: none, time: none }
    }
}

#[cfg(test)]
impl Works {
    pub(super) fn of_no_numbers() -> Self {
        fn spoil<const D: usize>(work: &mut Work<D>) {
            let Equations { mass, damping, stiffness } = &mut work.equations;
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
