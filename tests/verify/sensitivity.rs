//! Derivatives of runs against extrapolated differences of runs.

use crate::allocations::recorded;
use crate::blade::{Parts, STROKE};
use crate::flight::heavy_head_leading_tip;
use crate::scenes::{committed, upright_light_blade};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use std::collections::HashMap;
use wiperlab::model::Pose;
use wiperlab::model::modes::{TipConstraint, natural_modes};
use wiperlab::simulate::drive::Drive;
use wiperlab::simulate::mode::TipMode;
use wiperlab::simulate::outputs::Transitions;
use wiperlab::simulate::scene::contact::{ContactLossRule, JamRule};
use wiperlab::simulate::scene::{Scene, StartKind};
use wiperlab::simulate::sensitivity::{
    Channel, TangentDirection, TangentObserver, TangentSeeds, TangentSegment, run_with_tangents,
};
use wiperlab::simulate::{
    Observer, SolutionSegment, SolverOptions, Transition, TransitionCause, run_scene_with,
};

/// Tolerance of the runs that are compared.
const TOLERANCE: f64 = 1e-13;

/// What differences show at best: impacts are integrated by steps that the tolerance chooses, which makes
/// their differences the noisiest.
const AGREEMENT: f64 = 1e-8;

/// Channels whose end values are compared.
const CHANNELS: [Channel; 7] = [
    Channel::NeckAngle,
    Channel::LipAngle,
    Channel::NeckRate,
    Channel::LipRate,
    Channel::TipX,
    Channel::HeadDrop,
    Channel::HeadX,
];

/// The end of a run and its transitions, with derivatives.
#[derive(Default)]
struct Derived {
    transitions: Vec<(Transition, Option<Vec<f64>>)>,
    values: Vec<f64>,
    end: Vec<Vec<f64>>,
    directions: usize,
    known: bool,
}

impl TangentObserver for Derived {
    fn observe_segment(&mut self, piece: &TangentSegment<'_>) {
        let at = piece.weights_at(piece.end_s);
        self.known = piece.is_known;
        self.values = CHANNELS.iter().map(|&channel| piece.channel_value(channel, &at)).collect();
        self.end = CHANNELS
            .iter()
            .map(|&channel| {
                let mut row = vec![f64::NAN; self.directions];
                piece.channel_derivatives(channel, &at, &mut row);
                row
            })
            .collect();
    }
    fn observe_transition(&mut self, transition: &Transition, d_time_s: Option<&[f64]>) {
        self.transitions.push((*transition, d_time_s.map(<[f64]>::to_vec)));
    }
}

fn derived(scene: &Scene, directions: &[TangentDirection], tolerance: f64) -> Derived {
    let seeds = TangentSeeds::new(scene, directions).unwrap();
    let mut derived = Derived { directions: directions.len(), ..Derived::default() };
    run_with_tangents(scene, SolverOptions::new(tolerance), &seeds, &mut derived);
    derived
}

/// The same values without derivatives: end and times of transitions.
#[derive(Default)]
struct End(Vec<f64>);

impl Observer for End {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        let s = piece.sample_at(piece.end_s);
        let Pose { theta, phi, theta_rate, phi_rate } = s.pose;
        self.0 = vec![theta, phi, theta_rate, phi_rate, s.tip_x_m, s.head_drop_m, s.head_x_m];
    }
}

fn plain(scene: &Scene, tolerance: f64) -> (Vec<f64>, Vec<f64>) {
    let (mut end, mut transitions) = (End::default(), Transitions::default());
    run_scene_with(scene, SolverOptions::new(tolerance), &mut (&mut end, &mut transitions));
    (end.0, transitions.0.iter().map(|t| t.time_s).collect())
}

/// A scene moved along a direction, how much later its clock then is, and the scale of the direction.
fn moved(scene: &Scene, direction: &TangentDirection, step: f64) -> (Scene, f64) {
    let mut moved = scene.clone();
    match (direction, &mut moved.start) {
        (TangentDirection::Deflection, StartKind::Slider { deflection_m: value, .. })
        | (TangentDirection::TipVelocity, StartKind::Slider { tip_velocity_m_per_s: value, .. }) => {
            *value += step;
            return (moved, 0.0);
        }
        _ => {}
    }
    let mut pose = |change: &dyn Fn(&mut Pose)| {
        let StartKind::State(pose) = &mut moved.start else { panic!("a scene that starts in a state") };
        change(pose);
    };
    match direction {
        TangentDirection::Deflection | TangentDirection::TipVelocity => panic!("a slider"),
        TangentDirection::NeckAngle => pose(&|p| p.theta += step),
        TangentDirection::LipAngle => pose(&|p| p.phi += step),
        TangentDirection::NeckRate => pose(&|p| p.theta_rate += step),
        TangentDirection::LipRate => pose(&|p| p.phi_rate += step),
        TangentDirection::DriveScale => {
            let names = ["drive.amplitude_m", "drive.speed_m_per_s"];
            let (name, value) = names.iter().find_map(|name| Some((name, scene.value(name)?))).unwrap();
            return (scene.with_parameter(name, value * (1.0 + step)).unwrap(), 0.0);
        }
        TangentDirection::DriveDelay => {
            moved.start_s -= step;
            moved.run.stop_s -= step;
            return (moved, step);
        }
        TangentDirection::Parameter(name) => {
            return (scene.with_parameter(name, scene.value(name).unwrap() + step).unwrap(), 0.0);
        }
    }
    (moved, 0.0)
}

fn scale(scene: &Scene, direction: &TangentDirection) -> f64 {
    match direction {
        TangentDirection::NeckAngle | TangentDirection::LipAngle => 0.1,
        TangentDirection::NeckRate | TangentDirection::LipRate => 100.0,
        TangentDirection::DriveScale => 1.0,
        // (a slider has longer periods than a blade)
        TangentDirection::DriveDelay if scene.linkage.is_slider() => 0.1,
        TangentDirection::DriveDelay | TangentDirection::Deflection => 1e-3,
        TangentDirection::TipVelocity => 1e-2,
        TangentDirection::Parameter(name) => scene.value(name).unwrap(),
    }
}

/// Six-point differences with this relative step: channels at the end and times of transitions, `values`
/// together; `None` where a step changes their number.
fn differences(scene: &Scene, direction: &TangentDirection, share: f64, values: usize) -> Option<Vec<f64>> {
    const SIX: [(f64, f64); 6] = [
        (-3.0, -1.0 / 60.0),
        (-2.0, 9.0 / 60.0),
        (-1.0, -45.0 / 60.0),
        (1.0, 45.0 / 60.0),
        (2.0, -9.0 / 60.0),
        (3.0, 1.0 / 60.0),
    ];
    let h = share * scale(scene, direction);
    let mut sums = vec![0.0; values];
    for (point, weight) in SIX {
        let (scene, later) = moved(scene, direction, point * h);
        let (mut found, times) = plain(&scene, TOLERANCE);
        found.extend(times.iter().map(|time| time + later));
        if found.len() != values {
            return None;
        }
        sums.iter_mut().zip(&found).for_each(|(sum, x)| *sum += weight / h * x);
    }
    Some(sums)
}

fn every_direction(scene: &Scene) -> Vec<TangentDirection> {
    let mut directions: Vec<TangentDirection> = wiperlab::model::parameters::parameter_names()
        .into_iter()
        .filter(|name| scene.value(name).is_some_and(|value| value != 0.0))
        .map(|name| TangentDirection::Parameter(name.to_owned()))
        .collect();
    if matches!(scene.start, StartKind::State(_)) {
        directions.extend([
            TangentDirection::NeckAngle,
            TangentDirection::LipAngle,
            TangentDirection::NeckRate,
            TangentDirection::LipRate,
        ]);
    }
    if matches!(scene.start, StartKind::Slider { .. }) {
        directions.extend([TangentDirection::Deflection, TangentDirection::TipVelocity]);
    }
    directions.extend([TangentDirection::DriveScale, TangentDirection::DriveDelay]);
    directions
}

/// The worst error of all derivatives by a direction against differences, relative to the larger of the
/// derivative and what is usual of its channel, each with the relative step that shows it best; `None`
/// unless two steps or more keep the list of transitions: differences of the smallest are mostly noise.
pub(crate) fn worst(scene: &Scene) -> Option<f64> {
    const STEPS: [f64; 4] = [3e-4, 1e-4, 3e-5, 3e-6];
    /// Usual sizes of the channels and of a time, SI.
    const SIZES: [f64; 7] = [0.1, 0.1, 100.0, 100.0, 1e-3, 1e-4, 1e-2];
    const TIME: f64 = 1e-3;
    let directions = every_direction(scene);
    let derived = derived(scene, &directions, TOLERANCE);
    assert!(derived.known);
    let mut worst = 0.0f64;
    for (d, direction) in directions.iter().enumerate() {
        let scale = scale(scene, direction);
        let times = derived.transitions.iter().map(|(_, row)| (row.as_ref().unwrap()[d], TIME));
        let ends = derived.end.iter().zip(SIZES).map(|(row, size)| (row[d], size));
        let found: Vec<(f64, f64)> = ends.chain(times).collect();
        let steps: Vec<Vec<f64>> =
            STEPS.iter().filter_map(|&step| differences(scene, direction, step, found.len())).collect();
        if steps.len() < 2 {
            return None;
        }
        for (i, (found, size)) in found.into_iter().enumerate() {
            let error = |expected: f64| (found - expected).abs() / expected.abs().max(size / scale);
            let least = steps.iter().map(|step| error(step[i])).fold(f64::INFINITY, f64::min);
            worst = worst.max(least);
        }
    }
    Some(worst)
}

/// States on the glass that a run passes, and what happens between them.
#[derive(Default)]
struct Passed {
    corner_rad: Option<f64>,
    states: Vec<(f64, Pose)>,
    events: Vec<(f64, &'static str)>,
}

impl Observer for Passed {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        if piece.mode == TipMode::SlipForward || piece.mode == TipMode::SlipBackward {
            let t = 0.5 * (piece.start_s + piece.end_s);
            self.states.push((t, piece.sample_at(t).pose));
        }
        let [start, end] = [piece.start_s, piece.end_s].map(|t| piece.sample_at(t).pose.theta.abs());
        if self.corner_rad.is_some_and(|corner| (start < corner) != (end < corner)) {
            self.events.push((piece.end_s, "corner"));
        }
    }
    fn observe_transition(&mut self, transition: &Transition) {
        self.events.push((transition.time_s, transition.cause.name()));
    }
}

/// Short runs of random blades that end shortly after something happens, by what it is.
fn windows(each: usize, length_s: f64) -> HashMap<&'static str, Vec<Scene>> {
    windows_with(|parts| parts.scene(STROKE), each, length_s)
}

/// The same for the scenes that `scene` makes of random parts.
fn windows_with(
    scene: impl Fn(&Parts) -> Scene,
    each: usize,
    length_s: f64,
) -> HashMap<&'static str, Vec<Scene>> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut windows: HashMap<_, Vec<Scene>> = HashMap::new();
    for _ in 0..60 {
        let mut parts = Parts::random(&mut rng);
        parts.hd *= 0.3;
        let mut scene = scene(&parts).with_parameter("contact.restitution", 0.4).unwrap();
        (scene.loss, scene.jam) = (ContactLossRule::Fly, JamRule::Impact);
        add_windows(&mut windows, &scene, each, length_s);
    }
    windows
}

/// The same of one blade.
fn add_windows(windows: &mut HashMap<&'static str, Vec<Scene>>, scene: &Scene, each: usize, length_s: f64) {
    let corner_rad = scene.linkage.shoulder.map(|s| s.contact_angle_rad);
    let mut passed = Passed { corner_rad, ..Passed::default() };
    run_scene_with(scene, SolverOptions::new(1e-9), &mut passed);
    let mut last = f64::NEG_INFINITY;
    for &(time, event) in &passed.events {
        let found = windows.entry(event).or_default();
        let close = |&&(t, _): &&(f64, Pose)| t < time - length_s && t > time - 10.0 * length_s;
        if let (true, true, Some(&(start, pose))) =
            (found.len() < each, time > last, passed.states.iter().rev().find(close))
        {
            last = time + 20.0 * length_s;
            let mut window = scene.clone();
            (window.start_s, window.start) = (start, StartKind::State(pose));
            window.run.stop_s = time + 0.1 * length_s;
            found.push(window);
        }
    }
}

/// Every derivative of the state and of the times of transitions by every parameter, the start and the drive,
/// through every kind of transition.
#[test]
fn derivatives_are_those_of_differences_through_every_transition() {
    let windows = windows(4, 1e-3);
    for event in ["tip-stops", "friction-limit", "corner", "lift-off", "landing"] {
        let errors: Vec<f64> = windows[event].iter().filter_map(worst).collect();
        assert!(errors.len() >= 3, "{event}: {errors:?}");
        assert!(errors.iter().all(|&error| error < AGREEMENT), "{event}: {errors:?}");
    }
}

/// The same for every friction law and its parameters, with a static limit above that of slip, and with
/// friction that rises with speed and differs by direction. Knots of the laws lie between the transitions.
#[test]
fn derivatives_are_those_of_differences_for_every_friction_law() {
    const FURTHER: &str = "static_ratio = 1.3\nviscous_s_per_m = 0.2\nbackward_ratio = 0.8";
    let exponential = |[a, b, c]: [f64; 3]| format!("a = {a:e}\nb_s_per_m = {b:e}\nc = {c:e}");
    let stribeck = |[a, b, c]: [f64; 3], exponent: f64| {
        format!(
            "law = \"stribeck\"\nlimit_at_zero = {:e}\ncoulomb_level = {c:e}\nstribeck_speed_m_per_s = {:e}\n\
             stribeck_exponent = {exponent}",
            a + c,
            1.0 / b
        )
    };
    let laws: [&dyn Fn([f64; 3]) -> String; 5] = [
        &exponential,
        &|abc| stribeck(abc, 2.0),
        &|abc| stribeck(abc, 1.4),
        &|[a, b, c]| format!("law = \"rational\"\nlimit_at_zero = {:e}\nrational_s_per_m = {b:e}", a + c),
        &|_| "law = \"table\"\nspeeds_m_per_s = [0.01, 0.05, 0.2]\ncoefficients = [0.8, 0.6, 0.4]".to_owned(),
    ];
    for (i, law) in laws.into_iter().enumerate() {
        let scene =
            |parts: &Parts| parts.scene_with_friction(&format!("{}\n{FURTHER}", law(parts.friction)), STROKE);
        let windows = windows_with(scene, 2, 1e-3);
        for event in ["tip-stops", "friction-limit", "landing"] {
            let errors: Vec<f64> = windows[event].iter().filter_map(worst).collect();
            assert!(!errors.is_empty(), "law {i}, {event}");
            assert!(errors.iter().all(|&error| error < AGREEMENT), "law {i}, {event}: {errors:?}");
        }
    }
}

/// A head that starts later makes the same motion later, and derivatives by its frequency are about its own
/// start.
#[test]
fn a_head_that_starts_later_has_the_derivatives_of_its_own_start() {
    const LATER_S: f64 = 0.25;
    let mut scene = windows(1, 1e-3)["tip-stops"][0].clone();
    let before = plain(&scene, TOLERANCE);
    let Drive::Cosine { amplitude_m, frequency_hz, delay_s } = scene.drive else { panic!("a cosine drive") };
    assert_eq!(delay_s, 0.0);
    scene.drive = Drive::Cosine { amplitude_m, frequency_hz, delay_s: LATER_S };
    (scene.start_s, scene.run.stop_s) = (scene.start_s + LATER_S, scene.run.stop_s + LATER_S);
    let later = plain(&scene, TOLERANCE);
    assert!(!before.1.is_empty() && before.1.len() == later.1.len());
    assert!(
        before.1.iter().zip(&later.1).all(|(a, b)| (b - a - LATER_S).abs() < 1e-11),
        "{before:?} {later:?}"
    );
    let error = worst(&scene).unwrap();
    assert!(error < AGREEMENT, "{error:e}");
}

/// A blade let go with little friction swings across the head's speed without sticking.
#[test]
fn derivatives_are_those_of_differences_through_direct_reversals() {
    let mut scene = upright_light_blade()
        .with_parameter("friction.a", 1e-4)
        .and_then(|s| s.with_parameter("friction.c", 2e-4))
        .unwrap();
    let swings = natural_modes(&scene.linkage, TipConstraint::Free, false).pop().unwrap();
    let (theta, phi) = (5e-4, 5e-4 * swings.lip_over_neck);
    let pose = Pose { theta, phi, theta_rate: 0.0, phi_rate: 0.0 };
    (scene.start_s, scene.start) = (5e-4, StartKind::State(pose));
    scene.run.stop_s = 5e-3;
    let transitions = derived(&scene, &[], 1e-9).transitions;
    let reversals = transitions.iter().filter(|(t, _)| t.cause == TransitionCause::DirectReversal).count();
    assert!(reversals == 2, "{reversals} {transitions:?}");
    let error = worst(&scene).unwrap();
    assert!(error < AGREEMENT, "{error:e}");
}

/// Poses, pieces and transitions are to the bit those of a run without derivatives.
#[test]
fn derivatives_do_not_change_the_run() {
    #[derive(Default, PartialEq, Debug)]
    struct Places(Vec<f64>, Vec<u64>);
    impl Observer for Places {
        fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
            let pose = piece.sample_at(piece.end_s).pose;
            self.0.push(piece.end_s);
            self.1.extend([pose.theta, pose.phi, pose.theta_rate, pose.phi_rate].map(f64::to_bits));
        }
        fn observe_transition(&mut self, transition: &Transition) {
            self.1.push(transition.time_s.to_bits());
        }
    }
    /// The same at the ends of the run's pieces.
    #[derive(Default)]
    struct Same(Places, Vec<f64>);
    impl TangentObserver for Same {
        fn observe_segment(&mut self, piece: &TangentSegment<'_>) {
            let pose = piece.sample_at(piece.end_s).pose;
            if self.1.get(self.0.0.len()) == Some(&piece.end_s) {
                self.0.0.push(piece.end_s);
                self.0.1.extend([pose.theta, pose.phi, pose.theta_rate, pose.phi_rate].map(f64::to_bits));
            }
        }
        fn observe_transition(&mut self, transition: &Transition, _: Option<&[f64]>) {
            self.0.1.push(transition.time_s.to_bits());
        }
    }
    let scene = committed("actual-blade");
    let mut places = Places::default();
    let plain = run_scene_with(&scene, SolverOptions::from_scene(&scene), &mut places);
    let mut same = Same(Places::default(), places.0.clone());
    let seeds = TangentSeeds::new(&scene, &every_direction(&scene)).unwrap();
    let derived = run_with_tangents(&scene, SolverOptions::from_scene(&scene), &seeds, &mut same);
    assert_eq!(plain, derived);
    assert_eq!(places, same.0);
}

/// Under a head that moves evenly the blade carried along its own motion is the blade a little later: every
/// transition comes earlier by as much, whatever happens before it, and the end moves by its own rates.
#[test]
fn a_start_moved_along_the_motion_moves_transitions_back_in_time() {
    const STATES: [TangentDirection; 4] = [
        TangentDirection::NeckAngle,
        TangentDirection::LipAngle,
        TangentDirection::NeckRate,
        TangentDirection::LipRate,
    ];
    /// Rates of the state at the start.
    struct Start(Option<[f64; 4]>);
    impl TangentObserver for Start {
        fn observe_segment(&mut self, piece: &TangentSegment<'_>) {
            const STEP_S: f64 = 1e-9;
            let value = |channel, t| piece.channel_value(channel, &piece.weights_at(t));
            let rate = |channel| (value(channel, STEP_S) - value(channel, -STEP_S)) / (2.0 * STEP_S);
            let rates = [Channel::NeckRate, Channel::LipRate];
            let [theta, phi] = rates.map(|channel| value(channel, 0.0));
            self.0.get_or_insert_with(|| [theta, phi, rate(rates[0]), rate(rates[1])]);
        }
    }
    let mut transitions = 0;
    for scene in windows(3, 1e-3).into_values().flatten() {
        let mut scene = scene;
        scene.drive = Drive::Uniform { speed_m_per_s: scene.drive.motion_at(scene.start_s).velocity_m_per_s };
        (scene.run.stop_s, scene.start_s) = (scene.run.stop_s - scene.start_s + 5e-4, 0.0);
        let mut start = Start(None);
        let seeds = TangentSeeds::new(&scene, &[]).unwrap();
        run_with_tangents(&scene, SolverOptions::new(1e-12), &seeds, &mut start);
        let rates = start.0.unwrap();
        let derived = derived(&scene, &STATES, 1e-12);
        let along = |row: &[f64]| row.iter().zip(rates).map(|(d, rate)| d * rate).sum::<f64>();
        for (transition, row) in &derived.transitions {
            let Some(row) = row else { break };
            let size: f64 = row.iter().zip(rates).map(|(d, rate)| (d * rate).abs()).sum();
            let error = (along(row) + 1.0).abs();
            assert!(error < 1e-7 * size.max(1.0), "{transition:?}: {error:e} of {size:e}");
            transitions += 1;
        }
        if derived.known && derived.transitions.iter().all(|(_, row)| row.is_some()) {
            for (angle, rate) in [(0, 2), (1, 3)] {
                let size: f64 = derived.end[angle].iter().zip(rates).map(|(d, rate)| (d * rate).abs()).sum();
                let error = (along(&derived.end[angle]) - derived.values[rate]).abs();
                assert!(error < 1e-7 * size.max(1.0), "{error:e} of {size:e} rad/s");
            }
        }
    }
    assert!(transitions >= 20, "{transitions}");
}

/// The error of the derivatives falls with the tolerance.
#[test]
fn derivatives_converge_with_the_tolerance() {
    const SIZES: [f64; 7] = [0.1, 0.1, 100.0, 100.0, 1e-3, 1e-4, 1e-2];
    for scene in windows(2, 1e-3).remove("tip-stops").unwrap() {
        let directions = every_direction(&scene);
        let close = derived(&scene, &directions, TOLERANCE);
        let error = |tolerance: f64| {
            let found = derived(&scene, &directions, tolerance);
            assert_eq!(found.transitions.len(), close.transitions.len());
            let mut worst = 0.0f64;
            for ((found, close), size) in found.end.iter().zip(&close.end).zip(SIZES) {
                for (d, direction) in directions.iter().enumerate() {
                    let least = size / scale(&scene, direction);
                    worst = worst.max((found[d] - close[d]).abs() / close[d].abs().max(least));
                }
            }
            worst
        };
        for tolerance in [1e-6, 1e-8, 1e-10] {
            let error = error(tolerance);
            assert!(error < 1e3 * tolerance, "tolerance {tolerance:e}: {error:e}");
        }
    }
}

/// An integral over a time is that of the values within it.
#[test]
fn integrals_are_those_of_the_values() {
    /// Compares both over every piece, by the rule of three nodes in many parts.
    struct Both(Vec<[Vec<f64>; 2]>, usize);
    impl TangentObserver for Both {
        fn observe_segment(&mut self, piece: &TangentSegment<'_>) {
            const PARTS: usize = 16;
            const NODES: [(f64, f64); 3] = [
                (-0.774_596_669_241_483_4, 5.0 / 18.0),
                (0.0, 8.0 / 18.0),
                (0.774_596_669_241_483_4, 5.0 / 18.0),
            ];
            let length = (piece.end_s - piece.start_s) / PARTS as f64;
            for channel in CHANNELS.into_iter().chain([Channel::NormalForce, Channel::FrictionForce]) {
                let (mut integral, mut row) = (vec![0.0; self.1], vec![0.0; self.1]);
                piece.channel_derivatives(
                    channel,
                    &piece.weights_over(piece.start_s, piece.end_s),
                    &mut integral,
                );
                let mut sum = vec![0.0; self.1];
                for part in 0..PARTS {
                    for (node, weight) in NODES {
                        let t = piece.start_s + (part as f64 + 0.5 * (1.0 + node)) * length;
                        piece.channel_derivatives(channel, &piece.weights_at(t), &mut row);
                        sum.iter_mut().zip(&row).for_each(|(sum, d)| *sum += weight * length * d);
                    }
                }
                self.0.push([integral, sum]);
            }
        }
    }
    for scene in windows(1, 1e-3).into_values().flatten() {
        let directions = every_direction(&scene);
        let mut both = Both(Vec::new(), directions.len());
        let seeds = TangentSeeds::new(&scene, &directions).unwrap();
        run_with_tangents(&scene, SolverOptions::new(1e-9), &seeds, &mut both);
        // one piece's derivative may pass zero: each is compared on the scale of the run
        let channels = CHANNELS.len() + 2;
        for channel in 0..channels {
            for d in 0..directions.len() {
                let rows = both.0.iter().skip(channel).step_by(channels);
                let size = rows.clone().map(|[integral, _]| integral[d].abs()).fold(0.0, f64::max);
                let worst = rows.map(|[a, b]| (a[d] - b[d]).abs()).fold(0.0, f64::max);
                assert!(worst <= 1e-7 * size, "{channel} {:?}: {worst:e} of {size:e}", directions[d]);
            }
        }
    }
}

/// The delay of a recorded head against differences, through stick and slip.
#[test]
fn a_recorded_head_may_be_delayed() {
    let mut scene = windows(1, 1e-3).remove("tip-stops").unwrap().remove(0);
    // (recorded since a while before)
    let mut early = scene.clone();
    early.start_s -= 0.01;
    scene.drive = recorded(early).drive;
    let found = derived(&scene, &[TangentDirection::DriveDelay], TOLERANCE);
    let times = found.transitions.iter().map(|(_, row)| (row.as_ref().unwrap()[0], 1.0));
    let ends =
        found.end.iter().zip([100.0, 100.0, 1e5, 1e5, 1.0, 0.1, 1.0]).map(|(row, size)| (row[0], size));
    let found: Vec<(f64, f64)> = ends.chain(times).collect();
    let expected = differences(&scene, &TangentDirection::DriveDelay, 1e-5, found.len()).unwrap();
    for (i, ((found, size), expected)) in found.into_iter().zip(expected).enumerate() {
        let error = (found - expected).abs() / expected.abs().max(size);
        assert!(error < 1e-6, "{i}: {found} instead of {expected}");
    }
}

/// Behind a tip that has jammed there are no derivatives, and that is said.
#[test]
fn a_jam_has_no_derivatives() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let mut jams = 0;
    for _ in 0..20 {
        let mut scene = heavy_head_leading_tip(&mut rng);
        scene.loss = ContactLossRule::Fly;
        let derived = derived(&scene, &every_direction(&scene), 1e-9);
        let jam = derived.transitions.iter().position(|(t, _)| t.cause == TransitionCause::JamImpact);
        let Some(jam) = jam else { continue };
        assert!(derived.transitions[jam..].iter().all(|(_, row)| row.is_none()));
        assert!(!derived.known);
        jams += 1;
    }
    assert!(jams > 0);
}
