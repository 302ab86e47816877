//! What each part of a scene costs, as the ratio of its time to that of the plain light blade, measured in
//! alternation in one run.
//!
//! `cargo bench --bench scene_parts`
//!
//! Parts that a scene contains but its motion never meets (a shoulder out of reach, leave to fly, to jam)
//! show what their presence costs; the list of transitions is then the plain one's, which is asserted. Parts
//! that change the motion are compared by the right-hand side.

use std::time::Instant;
use wiperlab::simulate::outputs::{EnergyAudit, SampleObserver, Transitions};
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::{Observer, RunResult, SolverOptions, run_scene_with};

const SCENE: &str = include_str!("../data/scenes/light-blade.toml");
/// Rounds in which every case runs once; the least time of each counts.
const ROUNDS: usize = 60;
const TOLERANCE: f64 = 1e-8;

/// A case: what it is, how the scene's text changes, and whether its motion is that of the plain scene.
struct Case {
    name: &'static str,
    scene: Scene,
    observe: fn(&Scene) -> RunResult,
    same_motion: bool,
}

fn nothing(scene: &Scene) -> RunResult {
    run_scene_with(scene, SolverOptions::new(TOLERANCE), &mut ())
}

fn watched(scene: &Scene, mut observer: impl Observer) -> RunResult {
    run_scene_with(scene, SolverOptions::new(TOLERANCE), &mut observer)
}

fn sampled(scene: &Scene) -> RunResult {
    let frames = ((scene.run.stop_s - scene.start_s) * scene.run.sample_rate_hz) as usize;
    let times = (0..frames).map(|i| scene.start_s + i as f64 / scene.run.sample_rate_hz);
    watched(
        scene,
        SampleObserver::new(times, |sample| {
            std::hint::black_box(sample.normal_n);
        }),
    )
}

fn case(name: &'static str, add: &str, observe: fn(&Scene) -> RunResult, same_motion: bool) -> Case {
    let text = SCENE.replace("[friction]", &format!("{add}\n[friction]"));
    Case { name, scene: Scene::parse("light-blade.toml", &text).expect("a scene"), observe, same_motion }
}

fn without(name: &'static str, key: &str, value: &str) -> Case {
    let line = SCENE.lines().find(|line| line.starts_with(key)).expect("a key of the scene");
    let scene =
        Scene::parse("light-blade.toml", &SCENE.replace(line, &format!("{key} = {value}"))).expect("a scene");
    Case { name, scene, observe: nothing, same_motion: false }
}

fn main() {
    const SHOULDER: &str = "[shoulder]\ncontact_angle_rad = 1.5\nstiffness_ratio = 10.0\ndamping_ratio = 0.1";
    let cases = [
        case("plain", "", nothing, true),
        case("shoulder, out of reach", SHOULDER, nothing, true),
        case(
            "leave to fly and to jam",
            "[contact]\nloss = \"fly\"\njam = \"impact\"\nrestitution = 0.5",
            nothing,
            true,
        ),
        without("no lip damping", "lip_damping_ratio", "0.0"),
        without("no falling friction", "a", "0.0"),
        case("transitions listed", "", |scene| watched(scene, Transitions::default()), true),
        case("sampled at 10 kHz", "", sampled, true),
        case("energy audited", "", |scene| watched(scene, EnergyAudit::default()), true),
    ];
    let mut least = [f64::INFINITY; 8];
    let runs: Vec<RunResult> = cases.iter().map(|case| (case.observe)(&case.scene)).collect();
    for _ in 0..ROUNDS {
        for (case, least) in cases.iter().zip(&mut least) {
            let clock = Instant::now();
            std::hint::black_box((case.observe)(&case.scene));
            *least = least.min(clock.elapsed().as_secs_f64());
        }
    }
    println!(
        "{:<26} {:>11} {:>9} {:>10} {:>11} {:>17}",
        "scene", "transitions", "rhs", "time, ms", "time ratio", "ratio by the rhs"
    );
    for ((case, run), seconds) in cases.iter().zip(&runs).zip(least) {
        assert!(!case.same_motion || run.transitions == runs[0].transitions, "{}: another motion", case.name);
        let ratio = seconds / least[0];
        let by_rhs = ratio * runs[0].work.rhs_evaluations as f64 / run.work.rhs_evaluations as f64;
        println!(
            "{:<26} {:>11} {:>9} {:>10.3} {ratio:>11.3} {by_rhs:>17.3}",
            case.name,
            run.transitions,
            run.work.rhs_evaluations,
            1e3 * seconds
        );
    }
}
