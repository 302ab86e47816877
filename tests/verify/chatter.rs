//! Stick-slip cycles and the speeds at which they end, against belts with known answers and simulated runs.

use crate::chatter_sweep::simulated_chatter_end;
use crate::scenes::committed;
use nalgebra::Matrix4;
use wiperlab::model::Pose;
use wiperlab::simulate::drive::Drive;
use wiperlab::simulate::mode::TipMode;
use wiperlab::simulate::outputs::StickIntervals;
use wiperlab::simulate::scene::{Scene, StartKind};
use wiperlab::simulate::{Observer, RunStatus, SolutionSegment, SolverOptions, run_scene_with};
use wiperlab::stability::chatter::ChatterNumber;
use wiperlab::stability::cycle_branch::{CycleBranch, CycleEnd};
use wiperlab::stability::journal::EvaluationLog;
use wiperlab::stability::shooting::PeriodicMotion;
use wiperlab::stability::speed_intervals::unstable_range;
use wiperlab::stability::steady_sliding::SlideFinder;
use wiperlab::stability::study::{StabilityStudy, StudyRange};

/// A unit mass on a unit spring under a unit normal force.
fn belt(friction: &str, damping: f64) -> Scene {
    let text = format!(
        "format = 1\ntitle = \"belt\"\n[slider]\nmass_kg = 1.0\nstiffness_n_per_m = 1.0\n\
         damping_n_s_per_m = {damping}\nnormal_force_n = 1.0\n[friction]\n{friction}\n[drive]\n\
         speed_m_per_s = 0.1\n[run]\nstop_s = 1.0\nsample_rate_hz = 100.0\n"
    );
    Scene::parse("belt.toml", &text).unwrap()
}

const COULOMB: &str = "a = 0.0\nb_s_per_m = 0.0\nc = 0.5\nstatic_ratio = 2.0";
const FALLING: &str = "a = 0.3\nb_s_per_m = 5.0\nc = 0.2";

fn branch_of(scene: &Scene, top: f64) -> CycleBranch {
    let intervals = SlideFinder::new(&scene.linkage, 1.0).find_intervals([0.0, top], 100);
    CycleBranch::from_scene(scene, 1.0, [0.0, top], unstable_range(&intervals)).unwrap()
}

#[test]
fn the_cycles_of_belts_have_their_exact_periods_and_never_end_without_a_damper() {
    let rational = "law = \"rational\"\nlimit_at_zero = 1.0\nrational_s_per_m = 3.0";
    let cases = [
        (COULOMB, 0.2, 8.902_605_407_814_52),
        (rational, 0.2, 12.001_031_294_830_58),
        (FALLING, 0.1, 10.107_771_995_362_024),
        ("a = 0.5\nb_s_per_m = 5.0\nc = 0.3", 0.1, 13.948_428_077_770_275),
    ];
    for (friction, speed, period) in cases {
        let scene = belt(friction, 0.0);
        let branch = branch_of(&scene, 1.0);
        assert_eq!((branch.end, branch.fold_m_per_s()), (CycleEnd::EndOfRange, None), "{friction}");
        let cycle = branch.find_cycle(&scene, speed).unwrap();
        assert!((cycle.period_s - period).abs() < 1e-9, "{friction}: {} s, exact {period} s", cycle.period_s);
        // all cycles are released at the same deflection, so a deviation is gone after one period
        assert!(cycle.multipliers.len() == 1 && cycle.largest_multiplier() < 1e-6, "{cycle:?}");
        assert_eq!(cycle.sticks_s.len(), 1);
    }
    let scene = belt(rational, 0.0);
    let cycle = branch_of(&scene, 1.0).find_cycle(&scene, 0.2).unwrap();
    assert!((cycle.stick_s() - 7.705_031_769_350_42).abs() < 1e-9, "{}", cycle.stick_s());
    let scene = belt(COULOMB, 0.0);
    let amplitude = branch_of(&scene, 1.0).find_cycle(&scene, 0.2).unwrap().amplitude_m;
    assert!((amplitude - 0.538_516_480_713_45).abs() < 1e-3, "{amplitude} m");
}

/// No run of the published simulation settles into equal cycles. Its cycle is found from vibrations above the
/// range, and is the same as in a range that contains them.
#[test]
fn a_cycle_is_followed_back_from_vibrations_above_the_range() {
    let scene = committed("published-simulation");
    let whole = branch_of(&scene, 1.5);
    assert_eq!(whole.end, CycleEnd::StickLost);
    for top in [0.18, 0.7] {
        let part = branch_of(&scene, top);
        assert_eq!((part.end, part.fold_m_per_s()), (CycleEnd::EndOfRange, None));
        assert!(part.motions.iter().all(|motion| motion.speed_m_per_s <= top));
        let known = whole.cycles().iter().rev().find(|cycle| cycle.speed_m_per_s < top).unwrap();
        let (found, expected) =
            (part.find_cycle(&scene, known.speed_m_per_s).unwrap().period_s, known.period_s);
        assert!((found / expected - 1.0).abs() < 1e-8, "{top} m/s: {found} s, {expected} s");
    }
}

/// If the range is a hundred times as wide as the speeds at which the belt chatters, its cycle still ends
/// where it does in a narrow range.
#[test]
fn a_cycle_at_the_low_end_of_a_wide_range_ends_where_it_does_in_a_narrow_one() {
    let scene = belt(FALLING, 0.1);
    let [narrow, wide] = [2.0, 100.0].map(|top| branch_of(&scene, top));
    assert_eq!((narrow.end, wide.end), (CycleEnd::StickLost, CycleEnd::StickLost));
    let [found, expected] = [&wide, &narrow].map(|branch| branch.fold_m_per_s().unwrap());
    assert!((found / expected - 1.0).abs() < 1e-6, "{found} m/s, {expected} m/s");
}

/// Between the end of the instability and that of the cycle steady sliding is stable, but the blade can
/// chatter. A range of such speeds alone also has the cycle.
#[test]
fn a_range_above_the_instability_has_its_cycle() {
    let scene = committed("actual-blade");
    let whole = branch_of(&scene, 1.0);
    let part = CycleBranch::from_scene(&scene, 1.0, [0.26, 0.27], None).unwrap();
    assert_eq!(part.end, CycleEnd::EndOfRange);
    assert!(part.motions.iter().all(|motion| (0.26..=0.27).contains(&motion.speed_m_per_s)), "{part:?}");
    let cycle = part.cycles().first().unwrap();
    let expected = whole.find_cycle(&scene, cycle.speed_m_per_s).unwrap();
    assert!((cycle.period_s / expected.period_s - 1.0).abs() < 1e-8, "{cycle:?}, {expected:?}");
}

/// With a lip that is stiffer by a fifth, runs of the actual blade above 0.175 m/s still stick, in unequal
/// periods, although a cycle ends there. No end of chatter is given below the speeds at which runs stick.
#[test]
fn chatter_in_unequal_periods_has_no_end_below_it() {
    let scene = committed("actual-blade");
    let name = "blade.lip_stiffness_n_m_per_rad";
    let physical = wiperlab::stability::changes::write_in_physical_units(&scene).unwrap();
    let stiffer = physical.with_parameter(name, 1.2 * scene.value(name).unwrap()).unwrap();
    let branch = branch_of(&stiffer, 0.5);
    let mut late = stiffer.clone();
    late.drive = Drive::Uniform { speed_m_per_s: 0.2 };
    (late.start_s, late.run.stop_s) = (0.0, 2.0);
    late.start = StartKind::State(branch.cycles()[branch.before_end / 2].pose);
    let mut sticks = StickIntervals::default();
    assert_eq!(run_scene_with(&late, SolverOptions::new(1e-9), &mut sticks).status, RunStatus::Completed);
    assert!(sticks.0.last().unwrap()[1] > 1.9, "{sticks:?}");
    assert!(branch.fold_m_per_s().is_none_or(|end| end > 0.2), "{:?} {}", branch.end, branch.end_m_per_s);
}

/// Whether a tip sticks, and for how long after its release it does not.
#[derive(Default)]
struct SecondStick {
    is_released: bool,
    sticks_again: bool,
}

impl Observer for SecondStick {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        self.sticks_again |= self.is_released && piece.mode == TipMode::Stick;
        self.is_released |= piece.mode != TipMode::Stick;
    }
}

/// A belt has one cycle with stick: the motion from its release, if the mass sticks again. Bisection over
/// runs from the release gives the speed above which it does not.
#[test]
fn the_cycle_of_a_damped_belt_ends_where_a_released_mass_does_not_stick_again() {
    for (friction, kind, limit) in [(FALLING, CycleEnd::StickLost, 0.5), (COULOMB, CycleEnd::Grazing, 1.0)] {
        let scene = belt(friction, 0.1);
        let branch = branch_of(&scene, 2.0);
        assert_eq!(branch.end, kind);
        let sticks = |speed: f64| {
            let mut scene = scene.clone();
            scene.drive = Drive::Uniform { speed_m_per_s: speed };
            // just before the release, at which the spring pulls with the static limit and the damper against
            // it
            let deflection_m = -0.9 * limit + 0.1 * speed;
            scene.start = StartKind::Slider { deflection_m, tip_velocity_m_per_s: 0.0 };
            (scene.start_s, scene.run.stop_s) = (0.0, 1.0 / speed + 8.0);
            let mut seen = SecondStick::default();
            run_scene_with(&scene, SolverOptions::new(1e-12), &mut seen);
            assert!(seen.is_released);
            seen.sticks_again
        };
        let [mut below, mut above] = [0.2, 2.0];
        assert!(sticks(below) && !sticks(above));
        while above - below > 1e-9 {
            let middle = 0.5 * (below + above);
            if sticks(middle) { below = middle } else { above = middle }
        }
        let end = branch.fold_m_per_s().unwrap();
        assert!((end - below).abs() < 1e-6, "{kind:?}: {end} m/s, in runs {below} m/s");
    }
}

/// Sliding friction of a belt of Coulomb's is constant, so the velocity of the released mass is a damped
/// wave, known in closed form. The cycle ends by grazing at the speed of the belt that is the wave's next
/// crest.
#[test]
fn the_cycle_of_a_damped_coulomb_belt_ends_where_the_crest_of_its_slip_grazes_the_belt() {
    let (damping, drop) = (0.1_f64, 0.5_f64);
    let half = 0.5 * damping;
    let omega = (1.0 - half * half).sqrt();
    // velocity minus that of the belt at the crest of the wave that starts at the belt's speed with the
    // acceleration `-drop`
    let excess = |speed: f64| {
        let trough = (drop * omega).atan2(half * drop - speed).rem_euclid(std::f64::consts::PI);
        let t = (trough + std::f64::consts::PI) / omega;
        let wave = speed * (omega * t).cos() + (half * speed - drop) / omega * (omega * t).sin();
        (-half * t).exp() * wave - speed
    };
    let [mut sticks, mut passes] = [0.05, 5.0];
    assert!(excess(sticks) > 0.0 && excess(passes) < 0.0);
    for _ in 0..60 {
        let middle = 0.5 * (sticks + passes);
        if excess(middle) > 0.0 { sticks = middle } else { passes = middle }
    }
    let branch = branch_of(&belt(COULOMB, damping), 2.0);
    let end = branch.fold_m_per_s().unwrap();
    assert_eq!(branch.end, CycleEnd::Grazing);
    assert!((end / sticks - 1.0).abs() < 1e-7, "{end} m/s, exact {sticks} m/s");
}

/// Deflections at the instants at which the tip becomes faster than the head.
struct LeastDeflections {
    speed: f64,
    deflections_m: Vec<f64>,
}

impl Observer for LeastDeflections {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        let lead = |t: f64| piece.sample_at(t).tip_velocity_m_per_s - self.speed;
        // a run starts at such an instant
        if piece.start_s == 0.0 || lead(piece.start_s) >= 0.0 || lead(piece.end_s) < 0.0 {
            return;
        }
        let [mut before, mut after] = [piece.start_s, piece.end_s];
        for _ in 0..60 {
            let middle = 0.5 * (before + after);
            if lead(middle) < 0.0 { before = middle } else { after = middle }
        }
        let sample = piece.sample_at(after);
        self.deflections_m.push(sample.tip_x_m - sample.head_x_m);
    }
}

/// The return map of a belt from one instant at which the mass is as fast as the head to the next: how much
/// further the mass is from steady sliding then.
fn gain_of_a_period(scene: &Scene, speed: f64, deflection_m: f64) -> f64 {
    let mut scene = scene.clone();
    scene.drive = Drive::Uniform { speed_m_per_s: speed };
    scene.start = StartKind::Slider { deflection_m, tip_velocity_m_per_s: speed };
    (scene.start_s, scene.run.stop_s) = (0.0, 12.0);
    let mut seen = LeastDeflections { speed, deflections_m: Vec::new() };
    run_scene_with(&scene, SolverOptions::new(1e-12), &mut seen);
    deflection_m - seen.deflections_m[0]
}

/// The largest gain of a period, by golden section over the initial deflection between `low` and `high`.
fn largest_gain(scene: &Scene, speed: f64, [mut low, mut high]: [f64; 2]) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let gain = |deflection: f64| gain_of_a_period(scene, speed, deflection);
    for _ in 0..36 {
        let [a, b] = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)];
        if gain(a) > gain(b) { high = b } else { low = a }
    }
    gain(0.5 * (low + high))
}

/// If friction falls most steeply at a speed above zero, a belt vibrates without stick up to a smooth fold:
/// the speed above which no vibration grows in a period. A one-dimensional return map gives this speed
/// without any derivative. The multiplier at the fold is 1.
#[test]
fn a_cycle_ends_in_a_smooth_fold_where_no_vibration_gains_in_a_period() {
    let scene = belt(
        "law = \"stribeck\"\nlimit_at_zero = 0.5\ncoulomb_level = 0.2\nstribeck_speed_m_per_s = 0.5\n\
         stribeck_exponent = 4.0",
        0.3,
    );
    let branch = branch_of(&scene, 2.0);
    let end = branch.fold_m_per_s().unwrap();
    assert_eq!((branch.end, branch.sticks_below_end()), (CycleEnd::Fold, false));
    let last = branch.cycles().last().unwrap();
    assert!((last.largest_multiplier() - 1.0).abs() < 1e-4, "{last:?}");
    // steady sliding is where the spring holds the friction
    let slide_m = |speed: f64| -scene.linkage.friction.dynamic_coefficient(speed, 1.0);
    let gain = |speed: f64| {
        let sizes = [1.6, 1.0].map(|factor| slide_m(speed) - factor * last.amplitude_m);
        largest_gain(&scene, speed, sizes)
    };
    let [mut gains, mut decays] = [0.99 * end, 1.01 * end];
    assert!(gain(gains) > 0.0 && gain(decays) < 0.0);
    while decays - gains > 1e-9 {
        let middle = 0.5 * (gains + decays);
        if gain(middle) > 0.0 { gains = middle } else { decays = middle }
    }
    assert!((end - gains).abs() < 1e-6, "{end} m/s, by the return map {gains} m/s");
}

/// Integral over a run of the rate at which the motion of the belt contracts areas.
struct AreaGrowth<'a> {
    scene: &'a Scene,
    sum: f64,
}

impl Observer for AreaGrowth<'_> {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        const PARTS: usize = 200;
        let step = (piece.end_s - piece.start_s) / PARTS as f64;
        for part in 0..PARTS {
            let speed = piece.sample_at(piece.start_s + (part as f64 + 0.5) * step).tip_velocity_m_per_s;
            let law = &self.scene.linkage.friction;
            let slope = (law.dynamic_coefficient(speed + 1e-5, 1.0)
                - law.dynamic_coefficient(speed - 1e-5, 1.0))
                / 2e-5;
            self.sum -= step * (0.1 + slope);
        }
    }
}

fn run_period(scene: &Scene, pose: Pose, motion: &PeriodicMotion, observer: &mut impl Observer) {
    let mut scene = scene.clone();
    scene.drive = Drive::Uniform { speed_m_per_s: motion.speed_m_per_s };
    (scene.start_s, scene.run.stop_s, scene.start) = (0.0, motion.period_s, StartKind::State(pose));
    let result = run_scene_with(&scene, SolverOptions::new(1e-12), observer);
    assert_eq!(result.status, RunStatus::Completed);
}

/// The multiplier of a vibration without stick of a belt is the factor by which its motion changes areas
/// (Liouville's formula).
#[test]
fn the_multiplier_of_a_vibration_without_stick_is_the_change_of_areas() {
    let scene = belt(FALLING, 0.1);
    let branch = branch_of(&scene, 2.0);
    let beyond = &branch.motions[branch.before_end..];
    assert!(beyond.len() > 5);
    for motion in beyond.iter().take(5).filter(|motion| motion.speed_m_per_s < branch.end_m_per_s - 1e-3) {
        assert!(motion.sticks_s.is_empty() && !motion.is_stable());
        let mut area = AreaGrowth { scene: &scene, sum: 0.0 };
        run_period(&scene, motion.pose, motion, &mut area);
        let [[multiplier, _]] = motion.multipliers[..] else { panic!("{motion:?}") };
        let expected = area.sum.exp();
        assert!((multiplier / expected - 1.0).abs() < 1e-4, "{multiplier}, by areas {expected}");
    }
}

#[derive(Default)]
struct PoseAfterPeriod(Option<Pose>);

impl Observer for PoseAfterPeriod {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        self.0 = Some(piece.pose_at(piece.end_s));
    }
}

/// The multipliers of a blade's cycle, and 1 for a shift along it, are the eigenvalues of differences of runs
/// over a period.
#[test]
fn the_multipliers_of_a_blade_are_those_of_differences_of_runs() {
    for (name, speed) in [("actual-blade", 0.2), ("light-blade", 0.15)] {
        let scene = committed(name);
        let cycle = branch_of(&scene, 1.0).find_cycle(&scene, speed).unwrap();
        let states = |pose: &Pose| [pose.theta, pose.phi, pose.theta_rate, pose.phi_rate];
        let scales = [1.0, 1.0, 1e4, 1e4];
        let after = |column: usize, change: f64| {
            let mut y = states(&cycle.pose);
            y[column] += change * scales[column];
            let mut last = PoseAfterPeriod::default();
            let pose = Pose { theta: y[0], phi: y[1], theta_rate: y[2], phi_rate: y[3] };
            run_period(&scene, pose, &cycle, &mut last);
            states(&last.0.unwrap())
        };
        const STEP: f64 = 1e-6;
        let columns: Vec<_> = (0..4).map(|column| (after(column, STEP), after(column, -STEP))).collect();
        let map = Matrix4::from_fn(|row, column| {
            (columns[column].0[row] - columns[column].1[row]) / (2.0 * STEP * scales[row])
        });
        let mut by_runs: Vec<f64> = map.complex_eigenvalues().iter().map(|e| e.norm()).collect();
        let mut computed: Vec<f64> =
            cycle.multipliers.iter().map(|[re, im]| re.hypot(*im)).chain([1.0]).collect();
        by_runs.sort_by(f64::total_cmp);
        computed.sort_by(f64::total_cmp);
        for (a, b) in by_runs.iter().zip(&computed) {
            assert!((a - b).abs() < 1e-4, "{name}: {by_runs:?} in runs, {computed:?}");
        }
    }
}

#[test]
fn chatter_ends_where_a_slow_sweep_of_the_head_loses_its_stick() {
    for name in ["light-blade", "another-blade", "actual-blade"] {
        let scene = committed(name);
        let branch = branch_of(&scene, 1.0);
        let (found, end) = (simulated_chatter_end(&scene, &branch).unwrap(), branch.fold_m_per_s().unwrap());
        assert!((found / end - 1.0).abs() < 0.01, "{name}: {end} m/s, in sweeps {found} m/s");
    }
}

/// The number of the remedy is that of a study of the changed blade.
#[test]
fn the_remedy_ends_the_cycle_of_the_changed_blade_where_it_says() {
    let scene = committed("light-blade");
    let range = StudyRange { speeds_m_per_s: [0.0, 1.0], preloads_n: None, points: 50 };
    let log = &mut EvaluationLog::without_journal();
    let study = StabilityStudy::from_scene(&scene, range, log).unwrap();
    let chatter = study.summarise_chatter(&scene, None, log).unwrap();
    let (remedy, end) = (study.remedy.clone().unwrap(), study.leading_branch().unwrap().end_m_per_s);
    let name = remedy.parameter.as_str();
    let changed = scene.with_parameter(name, remedy.factor * scene.value(name).unwrap()).unwrap();
    let branch = branch_of(&changed, 1.0);
    let (stated, found) = (remedy.cycle_fold_m_per_s.unwrap(), branch.fold_m_per_s().unwrap());
    assert!(stated < end && (stated - found).abs() < 1e-6, "{stated} m/s, found {found} m/s");
    let swept = simulated_chatter_end(&changed, &branch).unwrap();
    assert!((swept / stated - 1.0).abs() < 0.01, "{stated} m/s, in sweeps {swept} m/s");
    assert!(chatter.numbers[&ChatterNumber::Feeding].value > 1.0);
}
