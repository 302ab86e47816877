//! Compares runs of sliders with motions that are known in closed form: the free decay of a Coulomb
//! oscillator, Den Hartog's forced oscillator without and with stops, a block that only a damper connects to
//! a moving head, stick-slip at constant pull, and the onset of stick-slip under friction that falls with
//! speed.

use crate::scenes::{Seen, committed, seen};
use crate::sensitivity::worst;
use std::f64::consts::{PI, TAU};
use wiperlab::model::modes::{TipConstraint, natural_modes};
use wiperlab::simulate::mode::TipMode;
use wiperlab::simulate::outputs::Transitions;
use wiperlab::simulate::predicted_error::run_with_predicted_errors;
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::{
    IntegrationMethod, RunStatus, SolverOptions, Transition, TransitionCause, run_scene_with,
};

/// Error, s, allowed in an instant at the tightest tolerance.
const INSTANT_S: f64 = 1e-11;
/// Tolerance at which instants are compared.
const TIGHT: f64 = 1e-13;
/// Error, s, allowed in an instant, divided by the tolerance: a phase takes a few steps, each with an error
/// of about the tolerance.
const ERRORS: f64 = 20.0;

/// A slider with Coulomb friction: `c` times the normal force.
#[derive(Debug, Clone, Copy)]
struct Rig {
    m: f64,
    k: f64,
    d: f64,
    normal: f64,
    c: f64,
}

/// A measured frame (Marino and Cicirello, arXiv 2303.03858), here without its damper.
const FRAME: Rig = Rig { m: 3.0799, k: 1191.0, d: 0.0, normal: 2.4525, c: 0.28 };

impl Rig {
    fn force(&self) -> f64 {
        self.c * self.normal
    }

    fn omega(&self) -> f64 {
        (self.k / self.m).sqrt()
    }

    fn scene(&self, friction: &str, drive: &str, start: &str, stop_s: f64) -> Scene {
        Scene::parse("rig.toml", &self.text(friction, drive, start, stop_s)).unwrap()
    }

    fn text(&self, friction: &str, drive: &str, start: &str, stop_s: f64) -> String {
        let Self { m, k, d, normal, c } = *self;
        let friction =
            if friction.is_empty() { format!("a = 0\nb_s_per_m = 0\nc = {c}") } else { friction.to_owned() };
        format!(
            "format = 1\ntitle = \"rig\"\n[slider]\nmass_kg = {m}\nstiffness_n_per_m = {k}\ndamping_n_s_per_m = {d}\n\
             normal_force_n = {normal}\n[friction]\n{friction}\n[drive]\n{drive}\n[start]\n{start}\n[run]\nstop_s = {stop_s}\n\
             sample_rate_hz = 1000"
        )
    }
}

fn state(deflection_m: f64, velocity: f64) -> String {
    format!("kind = \"state\"\ndeflection_m = {deflection_m:e}\ntip_velocity_m_per_s = {velocity:e}")
}

fn cosine(amplitude_m: f64, omega: f64, delay_s: f64) -> String {
    format!("amplitude_m = {amplitude_m:e}\nfrequency_hz = {:e}\ndelay_s = {delay_s:e}", omega / TAU)
}

/// Instants of the transitions and the modes after them. Fails if the run stops early.
fn events(found: &Seen) -> Vec<(f64, TipMode)> {
    assert_eq!(found.run.status, RunStatus::Completed);
    found.transitions.iter().map(|t| (t.time_s, t.to)).collect()
}

/// Largest error of the instants, s. Fails if the modes are not those expected.
fn compare(found: &[(f64, TipMode)], expected: &[(f64, TipMode)]) -> f64 {
    let modes = |events: &[(f64, TipMode)]| events.iter().map(|e| e.1).collect::<Vec<_>>();
    assert_eq!(modes(found), modes(expected), "{found:?} {expected:?}");
    found.iter().zip(expected).map(|(a, b)| (a.0 - b.0).abs()).fold(0.0, f64::max)
}

/// A slider under Coulomb friction whose head moves as a cosine, with closed forms of its motion. It has a
/// spring or a damper, not both.
#[derive(Debug, Clone, Copy)]
struct Forced {
    rig: Rig,
    amplitude: f64,
    drive: f64,
    delay: f64,
}

impl Forced {
    /// Position and velocity of the head.
    fn head(&self, t: f64) -> [f64; 2] {
        let angle = self.drive * (t - self.delay);
        [self.amplitude * (1.0 - angle.cos()), self.amplitude * self.drive * angle.sin()]
    }

    /// Position and velocity at `t` after the state `[x, w]` at `from`, in slip in the direction `sigma`.
    fn slide(&self, from: f64, [x, w]: [f64; 2], sigma: f64, t: f64) -> [f64; 2] {
        let (Rig { m, k, d, .. }, force) = (self.rig, sigma * self.rig.force());
        if k > 0.0 {
            assert!(d == 0.0);
            let omega = self.rig.omega();
            let gain = self.amplitude / (1.0 - (self.drive / omega).powi(2));
            let forced = |t: f64| {
                let angle = self.drive * (t - self.delay);
                [self.amplitude - force / k - gain * angle.cos(), gain * self.drive * angle.sin()]
            };
            let (start, now, (sin, cos)) = (forced(from), forced(t), (omega * (t - from)).sin_cos());
            let (p, q) = (x - start[0], (w - start[1]) / omega);
            return [now[0] + p * cos + q * sin, now[1] + omega * (q * cos - p * sin)];
        }
        let rate = d / m;
        let gain = self.amplitude * self.drive * rate / (rate * rate + self.drive * self.drive);
        let forced = |t: f64| {
            let (sin, cos) = (self.drive * (t - self.delay)).sin_cos();
            let velocity = gain * (rate * sin - self.drive * cos) - force / d;
            [-gain * (rate * cos / self.drive + sin) - force / d * t, velocity]
        };
        let (start, now, decay) = (forced(from), forced(t), (-rate * (t - from)).exp());
        let p = w - start[1];
        [x + now[0] - start[0] + p * (1.0 - decay) / rate, now[1] + p * decay]
    }

    /// Force of spring and damper on a mass at rest.
    fn pull(&self, t: f64, x: f64) -> f64 {
        let [position, velocity] = self.head(t);
        self.rig.k * (position - x) + self.rig.d * velocity
    }

    /// Every change of mode up to `stop`, from a mass at rest at `x`.
    fn events(&self, mut x: f64, stop: f64) -> Vec<(f64, TipMode)> {
        const STEP: f64 = 1e-4;
        let limit = self.rig.force();
        let (mut t, mut found) = (0.0, Vec::new());
        let direction = |pull: f64| if pull > 0.0 { 1.0 } else { -1.0 };
        let mode = |sigma: f64| if sigma > 0.0 { TipMode::SlipForward } else { TipMode::SlipBackward };
        let mut sigma = if self.pull(t, x).abs() > limit { direction(self.pull(t, x)) } else { 0.0 };
        while t < stop {
            if sigma == 0.0 {
                let Some(end) = first_zero(t, stop, STEP, |t| limit - self.pull(t, x).abs()) else { break };
                t = end;
                sigma = direction(self.pull(t, x));
                found.push((t, mode(sigma)));
            } else {
                let from = t;
                let at = |t: f64| self.slide(from, [x, 0.0], sigma, t);
                let Some(end) = first_zero(t + STEP, stop, STEP, |t| sigma * at(t)[1]) else { break };
                (x, t) = (at(end)[0], end);
                let pull = self.pull(t, x);
                sigma = if pull.abs() <= limit { 0.0 } else { direction(pull) };
                found.push((t, if sigma == 0.0 { TipMode::Stick } else { mode(sigma) }));
            }
        }
        found
    }
}

/// First zero, before `stop`, of a function that is positive right after `from`.
fn first_zero(from: f64, stop: f64, step: f64, f: impl Fn(f64) -> f64) -> Option<f64> {
    let mut low = from;
    while low < stop {
        let mut high = low + step;
        if f(high) < 0.0 {
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if f(middle) < 0.0 { high = middle } else { low = middle }
            }
            return Some(0.5 * (low + high)).filter(|t| *t < stop);
        }
        low = high;
    }
    None
}

/// In every half cycle friction lowers the amplitude by `2F/k`, and a damper lowers it further. The mass
/// sticks at the reversal where the force of the spring no longer exceeds friction.
#[test]
fn a_free_slider_loses_twice_the_friction_over_the_stiffness_each_half_cycle() {
    for (d, deflection) in [(0.0, 7.3), (0.0, -12.6), (0.669, 9.2)] {
        let rig = Rig { d, ..FRAME };
        let unit = rig.force() / rig.k;
        let decay = d / (2.0 * rig.m);
        let half = PI / (rig.omega().powi(2) - decay * decay).sqrt();
        let (mut left, mut expected) = (f64::abs(deflection), Vec::new());
        let mut towards = -deflection.signum();
        while left > 1.0 {
            left = (left - 1.0) * (-decay * half).exp() - 1.0;
            towards = -towards;
            let slip = if towards > 0.0 { TipMode::SlipForward } else { TipMode::SlipBackward };
            let sticks = left.abs() <= 1.0;
            expected.push((half * (expected.len() + 1) as f64, if sticks { TipMode::Stick } else { slip }));
        }
        let scene = rig.scene("", "speed_m_per_s = 0", &state(deflection * unit, 0.0), 5.0);
        let found = seen(&scene, TIGHT);
        let error = compare(&events(&found), &expected);
        assert!(error < INSTANT_S, "{d} {deflection}: {error:e} s");
        let place = found.samples.last().unwrap().tip_x_m;
        let at = towards * left * -unit;
        assert!((place - at).abs() < 1e-13 * deflection.abs(), "{place:e}, expected {at:e}");
    }
}

/// Den Hartog's periodic motion without stops (Trans. ASME 53, 1931): with `b` the ratio of the frequencies,
/// `V = 1/(1 - b^2)`, and the drive `cos(W t + p)` from a reversal on, `sin p = -F/(k a V b) sin(pi/b)/(1 +
/// cos(pi/b))`, and the mass swings by `a V cos p` to both sides.
#[test]
fn den_hartogs_oscillator_without_stops_reverses_twice_a_cycle() {
    let rig = FRAME;
    for (ratio, share) in [(0.7, 0.2), (1.4, 0.15), (2.3, 0.1)] {
        let (drive, amplitude) = (ratio * rig.omega(), 2e-3);
        let c = share * rig.k * amplitude / rig.normal;
        let rig = Rig { c, ..rig };
        let gain = 1.0 / (1.0 - ratio * ratio);
        let (sin, cos) = (PI / ratio).sin_cos();
        let sine: f64 = -share / (gain * ratio) * sin / (1.0 + cos);
        // the swing is positive at the start
        let phase = if gain > 0.0 { sine.asin() } else { PI - sine.asin() };
        let swing = amplitude * gain * phase.cos();
        let delay = (PI - phase) / drive;
        let forced = Forced { rig, amplitude, drive, delay };
        let deflection = swing + amplitude - forced.head(0.0)[0];
        let half = PI / drive;
        let cycles = 20.0;
        let scene = rig.scene(
            "",
            &cosine(amplitude, drive, delay),
            &state(deflection, 0.0),
            (2.0 * cycles + 0.5) * half,
        );
        let found = seen(&scene, TIGHT);
        let expected: Vec<(f64, TipMode)> = (1..=40)
            .map(|i| {
                (half * f64::from(i), if i % 2 == 1 { TipMode::SlipForward } else { TipMode::SlipBackward })
            })
            .collect();
        let error = compare(&events(&found), &expected);
        assert!(error < INSTANT_S, "ratio {ratio}: {error:e} s");
        let reverses = |t: &&wiperlab::simulate::Transition| t.cause == TransitionCause::DirectReversal;
        assert_eq!(found.transitions.iter().filter(reverses).count(), 40);
        let places = found.samples.iter().map(|s| s.tip_x_m - amplitude);
        let (low, high) = places.fold((0.0, 0.0), |(l, h): (f64, f64), x| (l.min(x), h.max(x)));
        assert!((high - swing).abs().max((low + swing).abs()) < 1e-12 * swing, "{low} {high} {swing}");
    }
}

/// Den Hartog's oscillator with one stop, two stops, three stops and no stop per half cycle, and a block that
/// only a damper connects to the head: it never slips, stops in every half cycle, or reverses without a stop.
fn forced_cases() -> Vec<(Forced, [usize; 2])> {
    let sprung = |ratio: f64, share: f64| {
        let (drive, amplitude) = (ratio * FRAME.omega(), 2e-3);
        Forced {
            rig: Rig { c: share * FRAME.k * amplitude / FRAME.normal, ..FRAME },
            amplitude,
            drive,
            delay: 0.0,
        }
    };
    let shaken = |share: f64| {
        let (d, drive, amplitude) = (4.0, 20.0, 5e-3);
        let c = share * d * amplitude * drive / FRAME.normal;
        Forced { rig: Rig { k: 0.0, d, c, ..FRAME }, amplitude, drive, delay: 0.0 }
    };
    // each with the least numbers of stops and of direct reversals in 30 half cycles of the head
    vec![
        (sprung(0.32, 0.28), [20, 0]),
        (sprung(0.5, 0.6), [20, 0]),
        (sprung(0.2, 0.4), [58, 0]),
        (sprung(0.1, 0.5), [85, 0]),
        (sprung(0.8, 0.3), [0, 20]),
        (shaken(1.01), [0, 0]),
        (shaken(0.8), [20, 0]),
        (shaken(0.15), [0, 20]),
    ]
}

#[test]
fn forced_sliders_stop_and_turn_at_the_instants_of_the_closed_form() {
    for (forced, least) in forced_cases() {
        let Forced { rig, amplitude, drive, .. } = forced;
        let stop = 30.3 * PI / drive;
        let expected = forced.events(0.0, stop);
        let scene = rig.scene("", &cosine(amplitude, drive, 0.0), "", stop);
        let found = seen(&scene, TIGHT);
        let error = compare(&events(&found), &expected);
        assert!(error < INSTANT_S, "{forced:?}: {error:e} s");
        let count = |cause| found.transitions.iter().filter(|t| t.cause == cause).count();
        let counts = [count(TransitionCause::TipStops), count(TransitionCause::DirectReversal)];
        assert!(counts[0] >= least[0] && counts[1] >= least[1], "{forced:?}: {counts:?}");
        assert!(least != [0, 0] || counts == [0, 0]);
        // the normal force is constant: nothing can jam or lift off
        assert_eq!(found.audit.min_normal_force_n, Some(rig.normal));
        assert!(found.audit.min_painleve_indicator.is_none_or(|least| least == 1.0));
    }
}

#[test]
fn errors_of_instants_stay_below_twenty_tolerances_with_both_methods() {
    for (forced, _) in forced_cases() {
        let Forced { rig, amplitude, drive, .. } = forced;
        let stop = 30.3 * PI / drive;
        let expected = forced.events(0.0, stop);
        let scene = rig.scene("", &cosine(amplitude, drive, 0.0), "", stop);
        for method in [IntegrationMethod::Taylor, IntegrationMethod::RungeKutta] {
            for exponent in [5, 7, 9, 11] {
                let relative = 10f64.powi(-exponent);
                let mut list = Transitions::default();
                run_scene_with(&scene, SolverOptions { method, ..SolverOptions::new(relative) }, &mut list);
                let found: Vec<(f64, TipMode)> = list.0.iter().map(|t| (t.time_s, t.to)).collect();
                let error = compare(&found, &expected);
                assert!(error < ERRORS * relative, "{method:?} at {relative:e}, {forced:?}: {error:e} s");
            }
        }
    }
}

/// Stick-slip of a head that moves at the speed `V`, with a static limit above the friction of slip, and its
/// exact transitions. The mass slips for `2 (pi - atan(B w / V)) / w` and sticks for `2 B / V`, where `w` is the
/// natural angular frequency and `B` the jump of friction divided by the stiffness.
fn pulled_slider() -> (Scene, Vec<(f64, TipMode)>) {
    const CYCLES: usize = 50;
    let (rig, speed, ratio) = (FRAME, 2e-3, 1.6);
    let (omega, kinetic) = (rig.omega(), rig.force() / rig.k);
    let jump = (ratio - 1.0) * kinetic;
    let slip_s = 2.0 * (PI - (jump * omega / speed).atan()) / omega;
    let stick_s = 2.0 * jump / speed;
    let first = ratio * kinetic / speed;
    let expected: Vec<(f64, TipMode)> = (0..CYCLES)
        .flat_map(|i| {
            let start = first + i as f64 * (slip_s + stick_s);
            [(start, TipMode::SlipForward), (start + slip_s, TipMode::Stick)]
        })
        .collect();
    let friction = format!("a = 0\nb_s_per_m = 0\nc = {}\nstatic_ratio = {ratio}", rig.c);
    let stop = first + CYCLES as f64 * (slip_s + stick_s) - 0.5 * stick_s;
    let scene = rig.scene(&friction, &format!("speed_m_per_s = {speed}"), "kind = \"relaxed\"", stop);
    (scene, expected)
}

#[test]
fn a_slider_pulled_at_constant_speed_sticks_and_slips_with_the_known_period() {
    let (scene, expected) = pulled_slider();
    let error = compare(&events(&seen(&scene, TIGHT)), &expected);
    assert!(error < INSTANT_S, "{error:e} s");
}

/// The predicted errors of 100 exact transition times lie above the errors, and not far above.
#[test]
fn errors_of_exact_instants_are_predicted_at_every_tolerance() {
    const FAR: f64 = 30.0;
    let (scene, expected) = pulled_slider();
    for exponent in 4..=10 {
        let tolerance = 10_f64.powi(-exponent);
        let mut ratios = Vec::new();
        let receive = |transition: &Transition, predicted_s: Option<f64>| {
            let (exact_s, mode) = expected[ratios.len()];
            assert_eq!(transition.to, mode);
            ratios.push(predicted_s.unwrap() / (transition.time_s - exact_s).abs());
        };
        let run = run_with_predicted_errors(&scene, SolverOptions::new(tolerance), &mut (), receive);
        assert_eq!((ratios.len(), run.undetermined_after_s), (expected.len(), None), "{tolerance:e}");
        ratios.sort_by(f64::total_cmp);
        let [least, median] = [ratios[0], ratios[ratios.len() / 2]];
        assert!(least > 1.0 && median < FAR, "{tolerance:e}: predicted over true error {least} to {median}");
    }
}

/// Friction that falls with speed reduces the damping `d` by `N a b exp(-b V)`. Below the speed `V` at which
/// the two are equal, a small disturbance grows at the rate `(N a b exp(-b V) - d) / (2 m)`, up to
/// stick-slip. Above it, steady sliding is stable.
#[test]
fn stick_slip_sets_in_where_falling_friction_outweighs_the_damper() {
    let rig = Rig { d: 0.669, ..FRAME };
    let (a, b) = (0.1, 12.0);
    let friction = format!("a = {a}\nb_s_per_m = {b}\nc = {}", rig.c);
    let onset = (rig.normal * a * b / rig.d).ln() / b;
    for share in [0.9, 0.99, 1.01, 1.1] {
        let speed = share * onset;
        let fall = a * (-b * speed).exp();
        let growth = (rig.normal * b * fall - rig.d) / (2.0 * rig.m);
        let period = TAU / (rig.omega().powi(2) - growth * growth).sqrt();
        let rest = -rig.normal * (fall + rig.c) / rig.k;
        let drive = format!("speed_m_per_s = {speed:e}");
        // after whole periods the disturbance has the phase of its start, so their ratio gives the growth
        let (small, periods) = (1e-8, 20.0);
        let scene = rig.scene(&friction, &drive, &state(rest + small, speed), periods * period);
        let found = seen(&scene, TIGHT);
        assert!(found.transitions.is_empty() && growth.signum() == (1.0 - share).signum());
        let end = found.samples.last().unwrap();
        let grown = ((end.tip_x_m - end.head_x_m - rest) / small).ln() / (periods * period);
        assert!((grown - growth).abs() < 1e-5, "{share}: {grown} 1/s, expected {growth}");
        let scene = rig.scene(&friction, &drive, &state(rest, 0.9 * speed), 1000.0 / growth.abs().max(1.0));
        let sticks = seen(&scene, 1e-9).transitions.iter().any(|t| t.to == TipMode::Stick);
        assert_eq!(sticks, growth > 0.0, "{share}");
    }
}

#[test]
fn a_slider_starts_in_steady_slip_and_has_one_mode() {
    let rig = Rig { d: 0.669, ..FRAME };
    let scene = rig.scene("", "speed_m_per_s = -0.02", "kind = \"steady-slide\"", 1.0);
    let found = seen(&scene, TIGHT);
    assert!(found.transitions.is_empty());
    for sample in &found.samples {
        let deflection = sample.tip_x_m - sample.head_x_m;
        assert!((deflection - rig.force() / rig.k).abs() < 1e-15 && sample.mode == TipMode::SlipBackward);
        assert_eq!([sample.head_drop_m, sample.tip_height_m], [0.0; 2]);
    }
    let modes = natural_modes(&scene.linkage, TipConstraint::Free, false);
    let hz = rig.omega() / TAU;
    assert!((modes[0].frequency_hz.unwrap() / hz - 1.0).abs() < 1e-15 && modes.len() == 1);
    assert!(natural_modes(&scene.linkage, TipConstraint::Held, false).is_empty());
}

/// Derivatives by every parameter, the start and the drive, in runs with stops, releases and direct
/// reversals.
#[test]
fn derivatives_of_a_slider_are_those_of_differences() {
    const LAW: &str = "law = \"stribeck\"\nlimit_at_zero = 0.34\ncoulomb_level = 0.25\nstribeck_speed_m_per_s = 0.01\n\
                       stribeck_exponent = 1.4\n\
                       static_ratio = 1.2\nviscous_s_per_m = 0.3\nbackward_ratio = 0.9";
    let rig = Rig { d: 0.669, ..FRAME };
    let drive = cosine(1.82e-3, TAU * 1.001, 0.05);
    let pull = "speed_m_per_s = 0.004".to_owned();
    let starts = [state(1e-4, 0.01), state(-2e-3, 0.004)];
    let mut cases = Vec::new();
    for law in ["", LAW] {
        for start in &starts {
            cases.extend([&drive, &pull].map(|drive| rig.scene(law, drive, start, 1.37)));
        }
    }
    cases.push(rig.scene(LAW, &pull, "kind = \"steady-slide\"", 0.4));
    let light = Rig { c: 0.05, ..rig };
    cases.push(light.scene("", &cosine(1.82e-3, 15.0, 0.05), &state(0.0, 0.02), 1.1));
    let causes =
        |scene: &Scene| seen(scene, 1e-9).transitions.into_iter().map(|t| t.cause).collect::<Vec<_>>();
    let all: Vec<TransitionCause> = cases.iter().flat_map(causes).collect();
    for cause in [TransitionCause::TipStops, TransitionCause::FrictionLimit, TransitionCause::DirectReversal]
    {
        assert!(all.contains(&cause), "{cause:?}");
    }
    for scene in cases {
        let error = worst(&scene)
            .unwrap_or_else(|| panic!("{:?} {:?}: transitions change", scene.drive, scene.start));
        assert!(error < 1e-8, "{error:e} {:?} {:?}", scene.drive, scene.start);
    }
}

/// A scene of a slider refuses a key of a blade and names it, and the reverse.
#[test]
fn keys_of_a_blade_in_the_scene_of_a_slider_are_refused_and_the_reverse() {
    let slider = FRAME.scene("", "speed_m_per_s = 0.01", "kind = \"relaxed\"", 1.0);
    let names =
        ["blade.lip_mass_kg", "shoulder.stiffness_ratio", "contact.restitution", "start.lip_angle_rad"];
    for name in names {
        let refused = match name {
            "start.lip_angle_rad" => {
                parse_with("kind = \"relaxed\"", &format!("{}\nlip_angle_rad = 0.1", state(0.0, 0.0)))
            }
            _ => slider.with_parameter(name, 0.5).unwrap_err().to_string(),
        };
        assert!(refused.contains(&format!("`{name}`")) && refused.contains("a key of a blade"), "{refused}");
    }
    let blade = include_str!("../../data/scenes/light-blade.toml");
    let blade =
        format!("[blade]{}", blade.split("[blade]").nth(1).unwrap().split("[friction]").next().unwrap());
    for table in [
        blade.as_str(),
        "[shoulder]\ncontact_angle_rad = 0.1\nstiffness_ratio = 2",
        "[contact]\nloss = \"fly\"",
    ] {
        let refused = parse_with("[run]", &format!("{table}\n[run]"));
        let name = table.split([']', '[']).nth(1).unwrap();
        assert!(refused.contains(&format!("`{name}`")) && refused.contains("a key of a blade"), "{refused}");
    }
    let upright = parse_with("kind = \"relaxed\"", "kind = \"upright\"");
    assert!(upright.contains("`start.kind`") && upright.contains("\"relaxed\""), "{upright}");
    let both = parse_with("speed_m_per_s = 0.01", "speed_m_per_s = 0.01\nfrequency_hz = 1");
    assert!(both.contains("`drive.speed_m_per_s`") && both.contains("also `drive.frequency_hz`"), "{both}");
    let massless = parse_with("mass_kg = 3.0799", "");
    assert!(massless.contains("`slider.mass_kg`") && massless.contains("mass of the slider"), "{massless}");

    let blade = committed("light-blade");
    let refused = blade.with_parameter("slider.mass_kg", 1.0).unwrap_err().to_string();
    assert!(refused.contains("`slider.mass_kg`") && refused.contains("a key of a slider"), "{refused}");
    let text = include_str!("../../data/scenes/light-blade.toml");
    let refused = |more: &str| {
        Scene::parse("s", &text.replace("[run]", &format!("{more}\n[run]"))).unwrap_err().to_string()
    };
    let neither = Scene::parse(
        "s",
        "format = 1\ntitle = \"t\"\n[friction]\n[drive]\n[run]\nstop_s = 1\nsample_rate_hz = 9",
    );
    assert!(neither.unwrap_err().to_string().contains("[blade] or [slider]"));
    assert!(
        refused("[slider]\nmass_kg = 1\nstiffness_n_per_m = 1\nnormal_force_n = 1")
            .contains("`blade`: found a key of a blade")
    );
    for more in ["deflection_m = 0.0", "kind = \"relaxed\""] {
        let start = text.split("[start]").next().unwrap().to_owned()
            + "[start]\n"
            + more
            + "\n[run]\nstop_s = 1\nsample_rate_hz = 9";
        let refused = Scene::parse("s", &start).unwrap_err().to_string();
        assert!(
            refused.contains("a key of a slider") || refused.contains("a start of a slider"),
            "{refused}"
        );
    }
}

/// The error message of a scene of a slider in which `to` replaces `from`.
fn parse_with(from: &str, to: &str) -> String {
    let text = FRAME.text("", "speed_m_per_s = 0.01", "kind = \"relaxed\"", 1.0);
    assert!(text.contains(from), "{text}");
    Scene::parse("s", &text.replace(from, to)).unwrap_err().to_string()
}

/// A block slides to rest through the whole Stribeck curve: the time is the integral of `m dv / (N mu(v))`.
/// At first the exponent of the law is so large that its exponential is zero.
#[test]
fn a_block_slides_to_rest_along_a_stribeck_curve_in_a_few_steps() {
    let rig = Rig { k: 0.0, ..FRAME };
    let (speed, level, limit) = (1e-3, 0.05, 0.4);
    for exponent in [0.5, 1.5, 3.2, 4.0] {
        let law = format!(
            "law = \"stribeck\"\nlimit_at_zero = {limit}\ncoulomb_level = {level}\n\
             stribeck_speed_m_per_s = {speed}\nstribeck_exponent = {exponent}"
        );
        let first = 500.0 * speed;
        let scene = rig.scene(&law, "speed_m_per_s = 0", &state(0.0, first), 20.0);
        let mut list = Transitions::default();
        let run = run_scene_with(&scene, SolverOptions::new(1e-10), &mut list);
        assert!(run.status == RunStatus::Completed && run.work.steps < 400, "{exponent}: {run:?}");
        // Simpson's rule for the speed as the eighth power of `s`, which smooths the law at rest
        let slowness = |s: f64| {
            let v = first * s.powi(8);
            let mu = level + (limit - level) * (-(v / speed).powf(exponent)).exp();
            8.0 * first * s.powi(7) * rig.m / (rig.normal * mu)
        };
        const HALVES: u32 = 20_000;
        let at = |i: u32| slowness(f64::from(i) / f64::from(2 * HALVES));
        let pairs = (0..HALVES).map(|i| at(2 * i) + 4.0 * at(2 * i + 1) + at(2 * i + 2));
        let expected = pairs.sum::<f64>() / f64::from(6 * HALVES);
        assert_eq!(list.0.len(), 1, "{:?}", list.0);
        let stop = list.0[0].time_s;
        assert!((stop / expected - 1.0).abs() < 1e-8, "{exponent}: {stop} s, expected {expected} s");
    }
}
