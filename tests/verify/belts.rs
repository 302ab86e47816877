//! The integrator, its events and the friction laws against stick-slip oscillators with known answers: a mass
//! on a belt under every friction law, Den Hartog's forced oscillator with Coulomb friction, and a
//! discontinuous linear system that switches at a known instant.
//!
//! All are dimensionless with unit mass and stiffness; times are compared absolutely, so an
//! error is in units of the reciprocal angular frequency and the tolerance is that of one step.

use hybrid_ode::polynomial::TERMS;
use hybrid_ode::taylor::{self, TaylorExpansion, TaylorPhase, TaylorWorkspace};
use hybrid_ode::{self as ode, HybridPhase, PhaseEnd, PhaseEndCause, PhaseStart, WorkCounters};
use wiperlab::model::friction::{FrictionLaw, FrictionSeries, FrictionShape, FrictionTable};

/// Error that a located instant may have in units of the tolerance: a phase takes a few steps and each may
/// err by the tolerance.
const ERRORS: f64 = 20.0;
/// Cycles over which transitions are counted.
const PERIODS: usize = 50;

fn tolerances() -> impl Iterator<Item = f64> {
    (4..=12).map(|exponent| 10f64.powi(-exponent))
}

/// The two integrators, each with its own way to find events; every case below is run by both.
#[derive(Debug, Clone, Copy)]
enum Method {
    Taylor,
    RungeKutta,
}

const METHODS: [Method; 2] = [Method::Taylor, Method::RungeKutta];

fn cases() -> impl Iterator<Item = (Method, f64)> {
    METHODS.into_iter().flat_map(|method| tolerances().map(move |relative| (method, relative)))
}

fn integrate<const N: usize, const G: usize, P: TaylorPhase<N, G>>(
    method: Method,
    phase: &P,
    start: PhaseStart<N, G>,
    stop: f64,
    relative: f64,
) -> PhaseEnd<N> {
    let mut work = WorkCounters::default();
    match method {
        Method::Taylor => taylor::integrate_taylor(
            phase,
            start,
            stop,
            relative,
            &mut TaylorWorkspace::default(),
            &mut work,
            |_, _| (),
        ),
        Method::RungeKutta => ode::integrate(phase, start, stop, relative, &mut work, |_| ()),
    }
}

/// Friction of a unit mass on a unit spring under a unit normal force, on a belt.
struct Belt {
    speed: f64,
    law: FrictionLaw,
}

impl Belt {
    fn at_rest(&self) -> f64 {
        self.law.static_coefficient(1.0)
    }
}

/// The mass lags behind the belt; states are position and velocity. The sliding speed stays positive, and
/// within a piece of the law.
struct Sliding<'a>(&'a Belt, usize);

impl HybridPhase<2, 2> for Sliding<'_> {
    fn derivative(&self, _: f64, y: &[f64; 2]) -> [f64; 2] {
        [y[1], self.0.law.dynamic_coefficient(self.0.speed - y[1], 1.0) - y[0]]
    }
    fn guards(&self, _: f64, y: &[f64; 2]) -> [f64; 2] {
        let [from, to] = self.0.law.piece_ends_m_per_s(self.1);
        [self.0.speed - y[1] - from, to - (self.0.speed - y[1])]
    }
    fn scale(&self) -> [f64; 2] {
        [1.0, self.0.speed]
    }
}

impl Sliding<'_> {
    /// Coefficients of position and velocity.
    fn series(&self, y: &[f64; 2], order: usize) -> Vec<[f64; 2]> {
        let (Belt { speed, law }, mut series) = (self.0, FrictionSeries::<TERMS>::default());
        let mut states = vec![*y];
        for k in 0..order {
            let force = match k {
                0 => series.start_series(law, self.1, speed - y[1]),
                _ => series.advance_series(law, k, -states[k][1]),
            };
            states.push([states[k][1] / (k + 1) as f64, (force - states[k][0]) / (k + 1) as f64]);
        }
        states
    }
}

impl TaylorPhase<2, 2> for Sliding<'_> {
    type Tape = ();
    fn expand_series(&self, t: f64, y: &[f64; 2], (): &mut (), out: &mut TaylorExpansion<2, 2>) {
        for (k, row) in self.series(y, out.order).into_iter().enumerate() {
            (out.states[k], out.guards[k]) = (row, [-row[1], row[1]]);
        }
        out.guards[0] = self.guards(t, y);
    }
}

/// The mass rides on the belt; the spring stays within the static limit.
struct Riding<'a>(&'a Belt);

impl HybridPhase<1, 1> for Riding<'_> {
    fn derivative(&self, _: f64, _: &[f64; 1]) -> [f64; 1] {
        [self.0.speed]
    }
    fn guards(&self, _: f64, y: &[f64; 1]) -> [f64; 1] {
        [self.0.at_rest() - y[0]]
    }
    fn scale(&self) -> [f64; 1] {
        [1.0]
    }
}

impl TaylorPhase<1, 1> for Riding<'_> {
    type Tape = ();
    fn expand_series(&self, _: f64, y: &[f64; 1], (): &mut (), out: &mut TaylorExpansion<1, 1>) {
        let rows = [(*y, self.0.at_rest() - y[0]), ([self.0.speed], -self.0.speed)];
        for k in 0..=out.order {
            let (state, guard) = rows.get(k).copied().unwrap_or_default();
            (out.states[k], out.guards[k]) = (state, [guard]);
        }
    }
}

impl Belt {
    /// Slip from the release to the stop, and the number of knots of the law on the way.
    fn slide(&self, t: f64, x: f64, method: Method, relative: f64) -> (PhaseEnd<2>, usize) {
        let (mut piece, mut knots) = (self.law.piece_at(0.0), 0);
        let order = if self.law.static_ratio > 1.0 { 1 } else { 2 };
        let mut start = PhaseStart { t, y: [x, self.speed], zero_order: [order, 0], step: None };
        loop {
            let end = integrate(method, &Sliding(self, piece), start, t + 100.0, relative);
            let [from, _] = self.law.piece_ends_m_per_s(piece);
            let zero_order = match end.cause {
                PhaseEndCause::Guard(0) if from > 0.0 => [0, 1],
                PhaseEndCause::Guard(1) => [1, 0],
                _ => return (end, knots),
            };
            piece = if zero_order[0] == 1 { piece + 1 } else { piece - 1 };
            (start, knots) = (PhaseStart { t: end.t, y: end.y, zero_order, step: None }, knots + 1);
        }
    }

    fn ride(&self, t: f64, x: f64, method: Method, relative: f64) -> PhaseEnd<1> {
        integrate(
            method,
            &Riding(self),
            PhaseStart { t, y: [x], zero_order: [0], step: None },
            t + 100.0,
            relative,
        )
    }

    /// Durations of slip and stick of each cycle from the first release on; every phase must end at its
    /// guard, and slip must pass this number of knots.
    fn cycles(&self, method: Method, relative: f64, knots: usize) -> Vec<[f64; 2]> {
        let (mut t, mut x) = (0.0, self.at_rest());
        (0..PERIODS)
            .map(|cycle| {
                let (stop, passed) = self.slide(t, x, method, relative);
                assert_eq!(passed, knots, "knots of cycle {cycle}, {method:?} at {relative:e}");
                assert_eq!(
                    stop.cause,
                    PhaseEndCause::Guard(0),
                    "slip of cycle {cycle}, {method:?} at {relative:e}"
                );
                let release = self.ride(stop.t, stop.y[0], method, relative);
                assert_eq!(
                    release.cause,
                    PhaseEndCause::Guard(0),
                    "stick of cycle {cycle}, {method:?} at {relative:e}"
                );
                assert!((release.y[0] - self.at_rest()).abs() < 1e-13);
                let durations = [stop.t - t, release.t - stop.t];
                (t, x) = (release.t, release.y[0]);
                durations
            })
            .collect()
    }

    /// Every cycle of every tolerance has these durations of slip and stick. The stick starts where the slip
    /// ended, so it inherits the slip's error in place, which the belt's speed turns into time.
    fn assert_cycles(&self, slip: f64, stick: f64, knots: usize) {
        // (friction that is very steep near rest multiplies errors of Runge-Kutta steps beyond what is
        // allowed)
        let steep = self.law.exponent < 1.0;
        for (method, relative) in cases().filter(|(method, _)| !steep || matches!(method, Method::Taylor)) {
            for (cycle, found) in self.cycles(method, relative, knots).into_iter().enumerate() {
                let what = format!("cycle {cycle}, {method:?} at {relative:e}: {found:?}");
                let digits = 1e-12; // differences of times up to 700, rounded to double precision
                assert!(
                    (found[0] - slip).abs() <= ERRORS * relative + digits,
                    "slip of {what}, off by {:e}",
                    found[0] - slip
                );
                assert!(
                    (found[1] - stick).abs() <= ERRORS * relative / self.speed + digits,
                    "stick of {what}, off by {:e}",
                    found[1] - stick
                );
            }
        }
    }
}

/// A law of the program with a static limit that is `static_ratio` times its limit at zero speed.
fn with_static_ratio(law: FrictionLaw, static_ratio: f64) -> FrictionLaw {
    FrictionLaw { static_ratio, ..law }
}

fn coulomb_belt() -> Belt {
    Belt { speed: 0.2, law: with_static_ratio(FrictionLaw::exponential(0.0, 0.0, 0.5), 2.0) }
}

#[test]
fn a_belt_with_static_above_kinetic_friction() {
    let slip = 2.0 * (std::f64::consts::PI - 2.5f64.atan());
    assert!((slip + 5.0 - 8.902_605_407_814_52).abs() < 1e-13);
    coulomb_belt().assert_cycles(slip, 5.0, 0);
}

/// Friction `0.5 + 0.1 v` at the sliding speed `v` damps a linear oscillator while the mass slides. Points on
/// this line are the same law. Each slip passes two of them, first up and then down.
#[test]
fn a_belt_with_viscous_friction_and_with_points_on_a_line() {
    let rise = 0.1;
    let viscous = FrictionLaw { viscous_s_per_m: rise, ..FrictionLaw::exponential(0.0, 0.0, 0.5) };
    let points = [0.0, 0.3, 0.5, 3.0].map(|speed| (speed, 0.5 + rise * speed));
    let [viscous, line] = [viscous, table(&points)].map(|law| with_static_ratio(law, 2.0));
    // x = e + exp(-c t/2) (p cos w t + q sin w t)
    let belt = Belt { speed: 0.2, law: viscous };
    let (half, e) = (0.5 * rise, 0.5 + rise * belt.speed);
    let w = (1.0 - half * half).sqrt();
    let (p, q) = (1.0 - e, (belt.speed + half * (1.0 - e)) / w);
    let wave = |t: f64, p: f64, q: f64| (-half * t).exp() * (p * (w * t).cos() + q * (w * t).sin());
    let lag = |t: f64| wave(t, w * q - half * p, -w * p - half * q) - belt.speed;
    let (mut low, mut high) = (3.0f64, 6.0f64);
    assert!(lag(low) < 0.0 && lag(high) > 0.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if lag(middle) < 0.0 { low = middle } else { high = middle }
    }
    let stick = (1.0 - e - wave(low, p, q)) / belt.speed;
    belt.assert_cycles(low, stick, 0);
    Belt { law: line, ..belt }.assert_cycles(low, stick, 4);
}

fn table(points: &[(f64, f64)]) -> FrictionLaw {
    let shape = FrictionShape::Table(FrictionTable::from_points(points).unwrap());
    FrictionLaw { shape, ..FrictionLaw::exponential(1.0, 1.0, 0.0) }
}

/// Slopes and values of monotone cubics, by hand.
#[test]
fn a_table_has_monotone_cubics_between_its_points() {
    let law = table(&[(0.0, 1.0), (1.0, 0.5), (3.0, 0.3)]);
    for (speed, expected) in [
        (-0.1, 1.0),
        (0.0, 1.0),
        (0.5, 0.75 - 0.125 * (1.9 / 3.0 - 0.18)),
        (1.0, 0.5),
        (2.0, 0.355),
        (3.0, 0.3),
        (9.0, 0.3),
    ] {
        let found = law.dynamic_coefficient(speed, 1.0);
        assert!((found - expected).abs() < 1e-15, "{speed}: {found} instead of {expected}");
    }
    let peak = table(&[(0.5, 0.2), (1.0, 0.4), (1.5, 0.1)]);
    let most = (0..=200).map(|i| peak.dynamic_coefficient(0.01 * f64::from(i), 1.0)).fold(0.0, f64::max);
    assert!(most <= 0.4 + 1e-15, "{most}");
}

#[test]
fn a_belt_with_rational_friction() {
    let law = FrictionLaw { shape: FrictionShape::Rational, ..FrictionLaw::exponential(1.0, 3.0, 0.0) };
    Belt { speed: 0.2, law }.assert_cycles(4.295_999_525_480_15, 7.705_031_769_350_42, 0);
}

/// Stribeck's curve falls from 1 to 0.5 over the speed 0.5, below a static limit of 1.2. The durations are
/// those of separate Runge-Kutta steps of 1e-4. With exponents that are not whole, each slip passes the knot
/// near rest twice.
#[test]
fn a_belt_with_stribeck_friction_of_any_exponent() {
    for (exponent, slip, stick, knots) in [
        (1.0, 4.028_785_303_372_9, 5.948_090_761_135_2, 0),
        (2.0, 4.194_245_359_478_6, 6.564_396_064_169_7, 0),
        (1.5, 4.120_359_876_918_9, 6.300_220_841_874_2, 2),
        (0.5, 3.926_554_752_776, 5.552_576_266_401, 2),
    ] {
        let shape = FrictionShape::Stribeck;
        let law = FrictionLaw { shape, exponent, ..FrictionLaw::exponential(0.5, 2.0, 0.5) };
        Belt { speed: 0.2, law: with_static_ratio(law, 1.2) }.assert_cycles(slip, stick, knots);
    }
}

/// The mass turns back where its velocity, the guard here, reaches zero.
struct UntilTurn<'a>(&'a Belt, f64);

impl HybridPhase<2, 1> for UntilTurn<'_> {
    fn derivative(&self, t: f64, y: &[f64; 2]) -> [f64; 2] {
        Sliding(self.0, 0).derivative(t, y)
    }
    fn guards(&self, _: f64, y: &[f64; 2]) -> [f64; 1] {
        [self.1 * y[1]]
    }
    fn scale(&self) -> [f64; 2] {
        Sliding(self.0, 0).scale()
    }
}

impl TaylorPhase<2, 1> for UntilTurn<'_> {
    type Tape = ();
    fn expand_series(&self, _: f64, y: &[f64; 2], (): &mut (), out: &mut TaylorExpansion<2, 1>) {
        for (k, row) in Sliding(self.0, 0).series(y, out.order).into_iter().enumerate() {
            (out.states[k], out.guards[k]) = (row, [self.1 * row[1]]);
        }
    }
}

#[test]
fn the_mass_on_the_belt_reaches_the_exact_extremes() {
    let belt = coulomb_belt();
    for (method, relative) in cases() {
        let turn = |start: PhaseStart<2, 1>, side: f64| {
            let end = integrate(method, &UntilTurn(&belt, side), start, start.t + 10.0, relative);
            assert_eq!(end.cause, PhaseEndCause::Guard(0));
            end
        };
        let most = turn(PhaseStart { t: 0.0, y: [1.0, belt.speed], zero_order: [0], step: None }, 1.0);
        let least = turn(PhaseStart { t: most.t, y: [most.y[0], 0.0], zero_order: [1], step: None }, -1.0);
        for (found, exact) in [(most.y[0], 1.038_516_480_713_45), (least.y[0], -0.038_516_480_713_45)] {
            assert!(
                (found - exact).abs() <= ERRORS * relative + 1e-14,
                "{found} against {exact}, {method:?} at {relative:e}"
            );
        }
    }
}

#[test]
fn a_belt_with_the_wipers_friction() {
    let stribeck = |law| FrictionLaw { shape: FrictionShape::Stribeck, ..law };
    let [first, second] = [(0.3, 0.2), (0.5, 0.3)].map(|(a, c)| FrictionLaw::exponential(a, 5.0, c));
    let (short, long) = (10.107_771_995_362_024, 13.948_428_077_770_275);
    let belts = [(first, short), (second, long), (stribeck(first), short), (stribeck(second), long)];
    for (law, period) in belts {
        let belt = Belt { speed: 0.1, law };
        for (method, relative) in cases() {
            let cycles = belt.cycles(method, relative, 0);
            assert_eq!(cycles.len(), PERIODS);
            for [slip, stick] in cycles {
                let error = slip + stick - period;
                // the error in place at the end of slip is drawn out by the belt's speed, as is the slip's
                // error in time
                assert!(
                    error.abs() <= ERRORS * relative / belt.speed + 1e-12,
                    "period {}, {method:?} at {relative:e}, off by {error:e}",
                    slip + stick
                );
            }
        }
    }
}

/// `x'' + x + r sgn x' = cos(b t)` while x' keeps the sign `side`.
struct DenHartog {
    b: f64,
    r: f64,
    side: f64,
}

impl HybridPhase<2, 1> for DenHartog {
    fn derivative(&self, t: f64, y: &[f64; 2]) -> [f64; 2] {
        [y[1], (self.b * t).cos() - y[0] - self.r * self.side]
    }
    fn guards(&self, _: f64, y: &[f64; 2]) -> [f64; 1] {
        [self.side * y[1]]
    }
    fn scale(&self) -> [f64; 2] {
        [1.0, 1.0]
    }
}

impl TaylorPhase<2, 1> for DenHartog {
    type Tape = ();
    fn expand_series(&self, t: f64, y: &[f64; 2], (): &mut (), out: &mut TaylorExpansion<2, 1>) {
        let (mut sin, mut cos) = (self.b * t).sin_cos();
        let [mut x, mut v] = *y;
        for k in 0..=out.order {
            (out.states[k], out.guards[k]) = ([x, v], [self.side * v]);
            let share = 1.0 / (k + 1) as f64;
            let friction = if k == 0 { self.r * self.side } else { 0.0 };
            (x, v) = (share * v, share * (cos - x - friction));
            (sin, cos) = (self.b * share * cos, -self.b * share * sin);
        }
    }
}

/// Half cycles after which the start is forgotten: each reversal multiplies the memory by a factor clearly
/// below 1.
const HALF_CYCLES: usize = 400;

#[test]
fn den_hartogs_oscillator_slides_without_stopping_at_the_exact_amplitude() {
    for (b, r, start, peak) in
        [(0.75, 0.4, 0.555, 2.090_731_083_278_06), (1.5, 0.3, 1.796, 0.721_110_255_092_798)]
    {
        for (method, relative) in cases() {
            let (mut t, mut y, mut side) = (start, [peak + 0.01, 0.0], -1.0);
            for half in 0..HALF_CYCLES {
                let phase = DenHartog { b, r, side };
                let end = integrate(
                    method,
                    &phase,
                    PhaseStart { t, y, zero_order: [1], step: None },
                    t + 100.0,
                    relative,
                );
                assert_eq!(end.cause, PhaseEndCause::Guard(0), "half cycle {half}");
                assert!(
                    ((b * end.t).cos() - end.y[0]).abs() > r,
                    "half cycle {half}: friction could hold the mass"
                );
                (t, y, side) = (end.t, [end.y[0], 0.0], -side);
            }
            let error = y[0].abs() - peak;
            assert!(
                error.abs() <= ERRORS * relative + 1e-14,
                "b {b}, r {r}, {method:?} at {relative:e}: peak {} is off by {error:e}",
                y[0].abs()
            );
        }
    }
}

/// Unit circle crossing: a source that turns one way inside and the other way outside.
struct Spiral {
    side: f64,
}

impl HybridPhase<2, 1> for Spiral {
    fn derivative(&self, _: f64, y: &[f64; 2]) -> [f64; 2] {
        let w = self.side * std::f64::consts::TAU;
        [y[0] + w * y[1], y[1] - w * y[0]]
    }
    fn guards(&self, _: f64, y: &[f64; 2]) -> [f64; 1] {
        [self.side * (y[0] * y[0] + y[1] * y[1] - 1.0)]
    }
    fn scale(&self) -> [f64; 2] {
        [1.0, 1.0]
    }
}

impl TaylorPhase<2, 1> for Spiral {
    type Tape = ();
    fn expand_series(&self, _: f64, y: &[f64; 2], (): &mut (), out: &mut TaylorExpansion<2, 1>) {
        let w = self.side * std::f64::consts::TAU;
        let [mut x, mut v] = *y;
        for k in 0..=out.order {
            out.states[k] = [x, v];
            let square: f64 = (0..=k)
                .flat_map(|j| (0..2).map(move |i| (i, j)))
                .map(|(i, j)| out.states[j][i] * out.states[k - j][i])
                .sum();
            out.guards[k] = [self.side * (square - if k == 0 { 1.0 } else { 0.0 })];
            let share = 1.0 / (k + 1) as f64;
            (x, v) = (share * (x + w * v), share * (v - w * x));
        }
    }
}

#[test]
fn a_crossing_of_a_discontinuity_happens_at_its_exact_instant() {
    for (method, relative) in cases() {
        let start = PhaseStart { t: 0.0, y: [(-1.0f64).exp(), 0.0], zero_order: [0], step: None };
        let crossing = integrate(method, &Spiral { side: -1.0 }, start, 10.0, relative);
        assert_eq!(crossing.cause, PhaseEndCause::Guard(0));
        assert!((crossing.t - 1.0).abs() <= ERRORS * relative, "{} at {relative:e}", crossing.t);
        let start = PhaseStart { t: crossing.t, y: crossing.y, zero_order: [1], step: None };
        let end = integrate(method, &Spiral { side: 1.0 }, start, std::f64::consts::FRAC_PI_2, relative);
        assert_eq!((end.cause, end.t), (PhaseEndCause::Stop, std::f64::consts::FRAC_PI_2));
        for (found, exact) in end.y.into_iter().zip([-1.597_460_377_450_7, 0.761_493_620_606_011]) {
            // an error in phase is one in place times the angular velocity
            assert!(
                (found - exact).abs() <= std::f64::consts::TAU * ERRORS * relative + 1e-13,
                "{found} against {exact} at {relative:e}"
            );
        }
    }
}
