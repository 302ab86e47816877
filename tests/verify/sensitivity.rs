//! Derivatives of runs against extrapolated differences of runs.

use crate::blade::{Parts, STROKE};
use crate::scenes::{committed, upright_light_blade};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use std::collections::HashMap;
use wiperlab::blade::Pose;
use wiperlab::blade::modes::{Tip, modes};
use wiperlab::simulate::mode::Mode;
use wiperlab::simulate::outputs::Transitions;
use wiperlab::simulate::scene::{Jam, Loss, Scene, StartKind};
use wiperlab::simulate::sensitivity::{
    Channel, Direction, Seeds, TangentObserver, TangentPiece, run_with_tangents,
};
use wiperlab::simulate::{Cause, Effort, Observer, Piece, Transition, run_with};

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
    fn piece(&mut self, piece: &TangentPiece<'_>) {
        let at = piece.at(piece.end_s);
        self.known = piece.is_known;
        self.values = CHANNELS.iter().map(|&channel| piece.value(channel, &at)).collect();
        self.end = CHANNELS
            .iter()
            .map(|&channel| {
                let mut row = vec![f64::NAN; self.directions];
                piece.derivatives(channel, &at, &mut row);
                row
            })
            .collect();
    }
    fn transition(&mut self, transition: &Transition, d_time_s: Option<&[f64]>) {
        self.transitions.push((*transition, d_time_s.map(<[f64]>::to_vec)));
    }
}

fn derived(scene: &Scene, directions: &[Direction], tolerance: f64) -> Derived {
    let seeds = Seeds::new(scene, directions).unwrap();
    let mut derived = Derived { directions: directions.len(), ..Derived::default() };
    run_with_tangents(scene, Effort::new(tolerance), &seeds, &mut derived);
    derived
}

/// The same values without derivatives: end and times of transitions.
#[derive(Default)]
struct End(Vec<f64>);

impl Observer for End {
    fn piece(&mut self, piece: &Piece<'_>) {
        let s = piece.sample(piece.end_s);
        let Pose { theta, phi, theta_rate, phi_rate } = s.pose;
        self.0 = vec![theta, phi, theta_rate, phi_rate, s.tip_x_m, s.head_drop_m, s.head_x_m];
    }
}

fn plain(scene: &Scene, tolerance: f64) -> (Vec<f64>, Vec<f64>) {
    let (mut end, mut transitions) = (End::default(), Transitions::default());
    run_with(scene, Effort::new(tolerance), &mut (&mut end, &mut transitions));
    (end.0, transitions.0.iter().map(|t| t.time_s).collect())
}

/// A scene moved along a direction, how much later its clock then is, and the scale of the direction.
fn moved(scene: &Scene, direction: &Direction, step: f64) -> (Scene, f64) {
    let mut moved = scene.clone();
    let mut pose = |change: &dyn Fn(&mut Pose)| {
        let StartKind::State(pose) = &mut moved.start else { panic!("a scene that starts in a state") };
        change(pose);
    };
    match direction {
        Direction::NeckAngle => pose(&|p| p.theta += step),
        Direction::LipAngle => pose(&|p| p.phi += step),
        Direction::NeckRate => pose(&|p| p.theta_rate += step),
        Direction::LipRate => pose(&|p| p.phi_rate += step),
        Direction::DriveScale => {
            let amplitude = scene.value("drive.amplitude_m").unwrap();
            return (scene.with("drive.amplitude_m", amplitude * (1.0 + step)).unwrap(), 0.0);
        }
        Direction::DriveDelay => {
            moved.start_s -= step;
            moved.run.stop_s -= step;
            return (moved, step);
        }
        Direction::Parameter(name) => {
            return (scene.with(name, scene.value(name).unwrap() + step).unwrap(), 0.0);
        }
    }
    (moved, 0.0)
}

fn scale(scene: &Scene, direction: &Direction) -> f64 {
    match direction {
        Direction::NeckAngle | Direction::LipAngle => 0.1,
        Direction::NeckRate | Direction::LipRate => 100.0,
        Direction::DriveScale => 1.0,
        Direction::DriveDelay => 1e-3,
        Direction::Parameter(name) => scene.value(name).unwrap(),
    }
}

/// Six-point differences with this relative step: channels at the end and times of transitions, `values`
/// together; `None` where a step changes their number.
fn differences(scene: &Scene, direction: &Direction, share: f64, values: usize) -> Option<Vec<f64>> {
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

fn every_direction(scene: &Scene) -> Vec<Direction> {
    let mut directions: Vec<Direction> = wiperlab::blade::parameters::names()
        .into_iter()
        .filter(|name| scene.value(name).is_some_and(|value| value != 0.0))
        .map(|name| Direction::Parameter(name.to_owned()))
        .collect();
    if matches!(scene.start, StartKind::State(_)) {
        directions.extend([
            Direction::NeckAngle,
            Direction::LipAngle,
            Direction::NeckRate,
            Direction::LipRate,
        ]);
    }
    directions.extend([Direction::DriveScale, Direction::DriveDelay]);
    directions
}

/// The worst error of all derivatives by a direction against differences, relative to the larger of the
/// derivative and what is usual of its channel, each with the relative step that shows it best; `None` where
/// a step changes the list of transitions.
fn worst(scene: &Scene) -> Option<f64> {
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
        if steps.is_empty() {
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
    fn piece(&mut self, piece: &Piece<'_>) {
        if piece.mode == Mode::SlipForward || piece.mode == Mode::SlipBackward {
            let t = 0.5 * (piece.start_s + piece.end_s);
            self.states.push((t, piece.sample(t).pose));
        }
        let [start, end] = [piece.start_s, piece.end_s].map(|t| piece.sample(t).pose.theta.abs());
        if self.corner_rad.is_some_and(|corner| (start < corner) != (end < corner)) {
            self.events.push((piece.end_s, "corner"));
        }
    }
    fn transition(&mut self, transition: &Transition) {
        self.events.push((transition.time_s, transition.cause.name()));
    }
}

/// Short runs of random blades that end shortly after something happens, by what it is.
fn windows(each: usize, length_s: f64) -> HashMap<&'static str, Vec<Scene>> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut windows: HashMap<_, Vec<Scene>> = HashMap::new();
    for _ in 0..60 {
        let mut parts = Parts::random(&mut rng);
        parts.hd *= 0.3;
        let mut scene = parts.scene(STROKE).with("contact.restitution", 0.4).unwrap();
        (scene.loss, scene.jam) = (Loss::Fly, Jam::Impact);
        let corner_rad = scene.linkage.shoulder.map(|s| s.contact_angle_rad);
        let mut passed = Passed { corner_rad, ..Passed::default() };
        run_with(&scene, Effort::new(1e-9), &mut passed);
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
    windows
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

/// A blade let go with little friction swings across the head's speed without sticking.
#[test]
fn derivatives_are_those_of_differences_through_direct_reversals() {
    let mut scene =
        upright_light_blade().with("friction.a", 1e-4).and_then(|s| s.with("friction.c", 2e-4)).unwrap();
    let swings = modes(&scene.linkage, Tip::Free, false).pop().unwrap();
    let (theta, phi) = (5e-4, 5e-4 * swings.lip_over_neck);
    let pose = Pose { theta, phi, theta_rate: 0.0, phi_rate: 0.0 };
    (scene.start_s, scene.start) = (5e-4, StartKind::State(pose));
    scene.run.stop_s = 5e-3;
    let transitions = derived(&scene, &[], 1e-9).transitions;
    let reversals = transitions.iter().filter(|(t, _)| t.cause == Cause::DirectReversal).count();
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
        fn piece(&mut self, piece: &Piece<'_>) {
            let pose = piece.sample(piece.end_s).pose;
            self.0.push(piece.end_s);
            self.1.extend([pose.theta, pose.phi, pose.theta_rate, pose.phi_rate].map(f64::to_bits));
        }
        fn transition(&mut self, transition: &Transition) {
            self.1.push(transition.time_s.to_bits());
        }
    }
    /// The same at the ends of the run's pieces.
    #[derive(Default)]
    struct Same(Places, Vec<f64>);
    impl TangentObserver for Same {
        fn piece(&mut self, piece: &TangentPiece<'_>) {
            let pose = piece.sample(piece.end_s).pose;
            if self.1.get(self.0.0.len()) == Some(&piece.end_s) {
                self.0.0.push(piece.end_s);
                self.0.1.extend([pose.theta, pose.phi, pose.theta_rate, pose.phi_rate].map(f64::to_bits));
            }
        }
        fn transition(&mut self, transition: &Transition, _: Option<&[f64]>) {
            self.0.1.push(transition.time_s.to_bits());
        }
    }
    let scene = committed("actual-blade");
    let mut places = Places::default();
    let plain = run_with(&scene, Effort::of(&scene), &mut places);
    let mut same = Same(Places::default(), places.0.clone());
    let seeds = Seeds::new(&scene, &every_direction(&scene)).unwrap();
    let derived = run_with_tangents(&scene, Effort::of(&scene), &seeds, &mut same);
    assert_eq!(plain, derived);
    assert_eq!(places, same.0);
}
