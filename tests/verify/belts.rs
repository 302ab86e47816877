//! The integrator and its events against stick-slip oscillators with exact answers: a mass on a belt under
//! three friction laws, Den Hartog's forced oscillator with Coulomb friction, and a discontinuous linear
//! system that switches at a known instant.
//!
//! All are dimensionless with unit mass, stiffness and static friction; times are compared absolutely, so an
//! error is in units of the reciprocal angular frequency and the tolerance is that of one step.

use hybrid_ode::taylor::{self, TaylorExpansion, TaylorPhase, TaylorWorkspace};
use hybrid_ode::{self as ode, HybridPhase, PhaseEnd, PhaseEndCause, PhaseStart, WorkCounters};

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

fn integrate<const N: usize, P: TaylorPhase<N, 1>>(
    method: Method,
    phase: &P,
    start: PhaseStart<N, 1>,
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

/// Kinetic friction at a positive sliding speed.
#[derive(Debug, Clone, Copy)]
enum Law {
    Coulomb(f64),
    /// `1 / (1 + 3 v)`.
    Stribeck,
    /// `a exp(-b v) + c`.
    Wiper(f64, f64, f64),
}

impl Law {
    fn force(self, v: f64) -> f64 {
        match self {
            Self::Coulomb(force) => force,
            Self::Stribeck => 1.0 / (1.0 + 3.0 * v),
            Self::Wiper(a, b, c) => a * (-b * v).exp() + c,
        }
    }

    /// Coefficient `k` of the force from those of the speed up to `k` and its own up to `k - 1`.
    fn coefficient(self, v: &[f64], force: &[f64], k: usize) -> f64 {
        let products =
            |weight: fn(usize) -> f64| (1..=k).map(|j| weight(j) * v[j] * force[k - j]).sum::<f64>();
        match self {
            _ if k == 0 => self.force(v[0]),
            Self::Coulomb(_) => 0.0,
            Self::Stribeck => -3.0 * products(|_| 1.0) / (1.0 + 3.0 * v[0]),
            // the recurrence holds for the part without c, which enters where its first coefficient does
            Self::Wiper(_, b, c) => -b / k as f64 * (products(|j| j as f64) - k as f64 * v[k] * c),
        }
    }
}

/// Friction of a unit mass on a unit spring on a belt: the static limit is `at_rest`, the kinetic force a
/// function of the sliding speed.
struct Belt {
    speed: f64,
    at_rest: f64,
    kinetic: Law,
    /// Order of the zero with which the sliding speed opens at release: 1 where the force drops, 2 where it
    /// is continuous.
    release_order: u8,
}

/// The mass lags behind the belt; states are position and velocity. The sliding speed stays positive.
struct Sliding<'a>(&'a Belt);

impl HybridPhase<2, 1> for Sliding<'_> {
    fn derivative(&self, _: f64, y: &[f64; 2]) -> [f64; 2] {
        [y[1], self.0.kinetic.force(self.0.speed - y[1]) - y[0]]
    }
    fn guards(&self, _: f64, y: &[f64; 2]) -> [f64; 1] {
        [self.0.speed - y[1]]
    }
    fn scale(&self) -> [f64; 2] {
        [1.0, self.0.speed]
    }
}

impl Sliding<'_> {
    /// Coefficients of position and velocity.
    fn series(&self, y: &[f64; 2], order: usize) -> Vec<[f64; 2]> {
        let (mut states, mut v, mut force) = (vec![*y], Vec::new(), Vec::new());
        for k in 0..order {
            v.push(if k == 0 { self.0.speed } else { 0.0 } - states[k][1]);
            force.push(self.0.kinetic.coefficient(&v, &force, k));
            states.push([states[k][1] / (k + 1) as f64, (force[k] - states[k][0]) / (k + 1) as f64]);
        }
        states
    }
}

impl TaylorPhase<2, 1> for Sliding<'_> {
    type Tape = ();
    fn expand_series(&self, _: f64, y: &[f64; 2], (): &mut (), out: &mut TaylorExpansion<2, 1>) {
        for (k, row) in self.series(y, out.order).into_iter().enumerate() {
            (out.states[k], out.guards[k]) = (row, [-row[1]]);
        }
        out.guards[0][0] += self.0.speed;
    }
}

/// The mass rides on the belt; the spring stays within the static limit.
struct Riding<'a>(&'a Belt);

impl HybridPhase<1, 1> for Riding<'_> {
    fn derivative(&self, _: f64, _: &[f64; 1]) -> [f64; 1] {
        [self.0.speed]
    }
    fn guards(&self, _: f64, y: &[f64; 1]) -> [f64; 1] {
        [self.0.at_rest - y[0]]
    }
    fn scale(&self) -> [f64; 1] {
        [1.0]
    }
}

impl TaylorPhase<1, 1> for Riding<'_> {
    type Tape = ();
    fn expand_series(&self, _: f64, y: &[f64; 1], (): &mut (), out: &mut TaylorExpansion<1, 1>) {
        let rows = [(*y, self.0.at_rest - y[0]), ([self.0.speed], -self.0.speed)];
        for k in 0..=out.order {
            let (state, guard) = rows.get(k).copied().unwrap_or_default();
            (out.states[k], out.guards[k]) = (state, [guard]);
        }
    }
}

impl Belt {
    fn slide(&self, t: f64, x: f64, method: Method, relative: f64) -> PhaseEnd<2> {
        let start = PhaseStart { t, y: [x, self.speed], zero_order: [self.release_order], step: None };
        integrate(method, &Sliding(self), start, t + 100.0, relative)
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
    /// guard.
    fn cycles(&self, method: Method, relative: f64) -> Vec<[f64; 2]> {
        let (mut t, mut x) = (0.0, self.at_rest);
        (0..PERIODS)
            .map(|cycle| {
                let stop = self.slide(t, x, method, relative);
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
                assert!((release.y[0] - self.at_rest).abs() < 1e-13);
                let durations = [stop.t - t, release.t - stop.t];
                (t, x) = (release.t, release.y[0]);
                durations
            })
            .collect()
    }

    /// Every cycle of every tolerance has these durations of slip and stick. The stick starts where the slip
    /// ended, so it inherits the slip's error in place, which the belt's speed turns into time.
    fn assert_cycles(&self, slip: f64, stick: f64) {
        for (method, relative) in cases() {
            for (cycle, found) in self.cycles(method, relative).into_iter().enumerate() {
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

const COULOMB: Belt = Belt { speed: 0.2, at_rest: 1.0, kinetic: Law::Coulomb(0.5), release_order: 1 };

#[test]
fn a_belt_with_static_above_kinetic_friction() {
    let slip = 2.0 * (std::f64::consts::PI - 2.5f64.atan());
    assert!((slip + 5.0 - 8.902_605_407_814_52).abs() < 1e-13);
    COULOMB.assert_cycles(slip, 5.0);
}

/// The mass turns back where its velocity, the guard here, reaches zero.
struct UntilTurn<'a>(&'a Belt, f64);

impl HybridPhase<2, 1> for UntilTurn<'_> {
    fn derivative(&self, t: f64, y: &[f64; 2]) -> [f64; 2] {
        Sliding(self.0).derivative(t, y)
    }
    fn guards(&self, _: f64, y: &[f64; 2]) -> [f64; 1] {
        [self.1 * y[1]]
    }
    fn scale(&self) -> [f64; 2] {
        Sliding(self.0).scale()
    }
}

impl TaylorPhase<2, 1> for UntilTurn<'_> {
    type Tape = ();
    fn expand_series(&self, _: f64, y: &[f64; 2], (): &mut (), out: &mut TaylorExpansion<2, 1>) {
        for (k, row) in Sliding(self.0).series(y, out.order).into_iter().enumerate() {
            (out.states[k], out.guards[k]) = (row, [self.1 * row[1]]);
        }
    }
}

#[test]
fn the_mass_on_the_belt_reaches_the_exact_extremes() {
    for (method, relative) in cases() {
        let turn = |start: PhaseStart<2, 1>, side: f64| {
            let end = integrate(method, &UntilTurn(&COULOMB, side), start, start.t + 10.0, relative);
            assert_eq!(end.cause, PhaseEndCause::Guard(0));
            end
        };
        let most = turn(PhaseStart { t: 0.0, y: [1.0, COULOMB.speed], zero_order: [0], step: None }, 1.0);
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
fn a_belt_with_stribeck_friction() {
    let belt = Belt { speed: 0.2, at_rest: 1.0, kinetic: Law::Stribeck, release_order: 2 };
    belt.assert_cycles(4.295_999_525_480_15, 7.705_031_769_350_42);
}

#[test]
fn a_belt_with_the_wipers_friction() {
    let belts = [
        (
            Belt { speed: 0.1, at_rest: 0.5, kinetic: Law::Wiper(0.3, 5.0, 0.2), release_order: 2 },
            10.107_771_995_362_024,
        ),
        (
            Belt { speed: 0.1, at_rest: 0.8, kinetic: Law::Wiper(0.5, 5.0, 0.3), release_order: 2 },
            13.948_428_077_770_275,
        ),
    ];
    for (belt, period) in belts {
        for (method, relative) in cases() {
            let cycles = belt.cycles(method, relative);
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
