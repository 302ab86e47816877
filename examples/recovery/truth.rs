//! Blades whose true values are known, the values that the job of a fit has, and their films.

use crate::camera::Filming;
use crate::linkage_run::{Place, run_linkage};
use portable_math::StandardNormal;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::collections::BTreeMap;
use std::fmt::Write;
use wiperlab::model::Pose;
use wiperlab::recording::Recording;
use wiperlab::simulate::equilibrium::steady_slip_pose;
use wiperlab::simulate::outputs::SampleObserver;
use wiperlab::simulate::scene::contact::ContactLossRule;
use wiperlab::simulate::scene::{Scene, StartKind};
use wiperlab::simulate::{RunStatus, SolverOptions, run_scene_with};

/// Parameters that a fit seeks. For a blade of the scene's size, time scale and mass: the range from which
/// the true value is drawn, evenly in the logarithm, and the bounds of the fit.
pub const SOUGHT: [(&str, [f64; 2], [f64; 2]); 5] = [
    ("friction.a", [0.07, 0.2], [0.03, 0.4]),
    ("friction.b_s_per_m", [2.5, 9.0], [1.0, 20.0]),
    ("friction.c", [0.2, 0.4], [0.1, 0.6]),
    ("blade.neck_stiffness_n_m_per_rad", [0.0013, 0.0027], [0.0009, 0.0038]),
    ("shoulder.stiffness_n_m_per_rad", [0.018, 0.055], [0.008, 0.12]),
];
/// Times from the start of a run to the reversal, and from the reversal to the end, s, at time scale 1.
const BEFORE_S: f64 = 0.108;
const AFTER_S: f64 = 0.482;
/// Maximum number of draws until a blade is accepted.
const TRIES: u64 = 400;

/// Error of a blade or its film that the fit does not allow for.
#[derive(Clone, Copy, PartialEq)]
pub enum Fault {
    /// The constant with this name is 5 to 6 standard deviations of its prior off.
    Constant(&'static str),
    /// The tip's marker is 5 to 6 mm off the edge of the lip; the standard deviation of its prior is 1 mm.
    Marker,
    /// The tip leaves the glass. The runs by Lagrange's equations have no flight: there the tracked tip is
    /// off by ten standard deviations of the noise, for 30 ms at time scale 1.
    Contact,
}

const FAULTS: [Fault; 6] = [
    Fault::Constant("blade.preload_force_n"),
    Fault::Constant("blade.head_mass_kg"),
    Fault::Constant("blade.neck_length_m"),
    Fault::Constant("blade.lip_inertia_kg_m2"),
    Fault::Marker,
    Fault::Contact,
];

impl Fault {
    /// The fault of blade `number`. Neighbouring numbers share a fault, so that both makers have every fault.
    pub fn of_number(number: u64) -> Self {
        FAULTS[(number / 2) as usize % FAULTS.len()]
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Constant(name) => name.trim_start_matches("blade."),
            Self::Marker => "tip marker",
            Self::Contact => "contact",
        }
    }
}

/// A blade with its film.
pub struct Blade {
    /// Factors by which lengths, times and masses differ from those of the scene.
    pub size: f64,
    pub time: f64,
    mass: f64,
    /// The scene of the job, and the true scene.
    pub believed: Scene,
    pub filmed: Scene,
    pub filming: Filming,
    pub recording: Recording,
    /// Largest distance, m, between the tips of this run and of the library's run, in the first 50 ms at time
    /// scale 1.
    pub apart_m: f64,
}

/// Draws blade `number`: the first draw that runs to its end, flips over, and stays in contact (or leaves the
/// glass, if that is its fault). `prior_sd` are the standard deviations of the priors of the fit. Lagrange's
/// equations move the blades with odd numbers.
pub fn draw_blade(
    scene: &Scene,
    prior_sd: &BTreeMap<String, f64>,
    number: u64,
    fault: Option<Fault>,
) -> Option<Blade> {
    let seed = number << 20 | if fault.is_some() { 1 << 60 } else { 0 };
    (0..TRIES).find_map(|try_| {
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed + try_);
        draw_once(scene, prior_sd, &mut generator, !number.is_multiple_of(2), fault)
    })
}

fn draw_once(
    scene: &Scene,
    prior_sd: &BTreeMap<String, f64>,
    generator: &mut Xoshiro256PlusPlus,
    by_lagrange: bool,
    fault: Option<Fault>,
) -> Option<Blade> {
    let mut log = |[low, high]: [f64; 2]| low * (high / low).powf(generator.random::<f64>());
    let (size, time) = (log([0.3, 3.0]), log([0.5, 3.0]));
    let mass = size * size * log([0.5, 2.0]);
    let [amplitude, rate] = [log([0.7, 1.4]), log([0.7, 1.4])];
    let truths = SOUGHT.map(|(name, range, _)| (name, log(range)));
    let unit = |name: &str| unit_of(name, size, time, mass);
    let mut believed = scene.clone();
    for (name, value) in scene.written_values() {
        believed = believed.with_parameter(name, value * unit(name)).ok()?;
    }
    for (name, factor) in [("drive.amplitude_m", amplitude), ("drive.frequency_hz", rate)] {
        believed = believed.with_parameter(name, factor * believed.value(name)?).ok()?;
    }
    let reversal_s = 0.5 / believed.value("drive.frequency_hz")?;
    (believed.start_s, believed.run.stop_s) = (reversal_s - BEFORE_S * time, reversal_s + AFTER_S * time);
    let mut filmed = believed.clone();
    for (name, sd) in prior_sd {
        let z: f64 = match fault {
            Some(Fault::Constant(wrong)) if wrong == name => beyond(generator),
            _ => generator.sample(StandardNormal),
        };
        filmed = filmed.with_parameter(name, believed.value(name)? * (sd * z).exp()).ok()?;
    }
    for (name, value) in truths {
        filmed = filmed.with_parameter(name, value * unit(name)).ok()?;
    }
    let speed = filmed.drive.motion_at(filmed.start_s).velocity_m_per_s;
    let pose = steady_slip_pose(&filmed.linkage, speed)?;
    let mut near = |angle: f64| angle * (1.0 + 0.1 * generator.sample::<f64, _>(StandardNormal));
    filmed.start = StartKind::State(Pose {
        theta: near(pose.theta),
        phi: near(pose.phi),
        theta_rate: 0.0,
        phi_rate: 0.0,
    });
    let stroke_m = 2.0 * filmed.value("drive.amplitude_m")?;
    let mut filming =
        Filming::draw(generator, size, time, stroke_m, filmed.value("blade.lip_natural_frequency_hz")?);
    if fault == Some(Fault::Marker) {
        filming.tip_marker_m[generator.random_range(0..2)] = 1e-3 * beyond(generator);
    }
    let flies = fault == Some(Fault::Contact) && !by_lagrange;
    if fault == Some(Fault::Contact) && by_lagrange {
        let frames = |time_s: f64| (time_s * time * filming.frame_rate_hz) as usize;
        filming.glued = Some([frames(generator.random_range(0.2..0.4)), frames(0.03)]);
    }
    let step_s = 1.0 / (filming.frame_rate_hz * filming.steps[0] as f64);
    let count = ((filmed.run.stop_s - filmed.start_s) / step_s) as usize;
    let of_library = run_library(&filmed, flies, step_s, count)?;
    let height_m = filmed.linkage.upright_height_m();
    let lean = |place: &Place| (place.tip_x_m - place.head_x_m) / height_m;
    let flips = lean(&of_library[0]) * lean(&of_library[count - 1]) < 0.0;
    let flown = of_library.iter().filter(|place| place.tip_height_m > filming.noise_m).count();
    if !flips || flies && (flown as f64 * step_s) < 5e-4 * time {
        return None;
    }
    let places = if by_lagrange { run_linkage(&filmed, step_s, count).ok()? } else { of_library.clone() };
    let early = places.iter().zip(&of_library).take((0.05 * time / step_s) as usize);
    let apart_m = early.map(|(a, b)| (a.tip_x_m - b.tip_x_m).abs()).fold(0.0, f64::max);
    let recording = filming.film(&places, height_m, generator);
    Some(Blade { size, time, mass, believed, filmed, filming, recording, apart_m })
}

/// A distance of 5 to 6 standard deviations, to either side.
fn beyond(generator: &mut Xoshiro256PlusPlus) -> f64 {
    let far = generator.random_range(5.0..6.0);
    if generator.random::<bool>() { far } else { -far }
}

/// Places of the blade in a run of the library; `None` if the run does not reach its end.
fn run_library(scene: &Scene, flies: bool, step_s: f64, count: usize) -> Option<Vec<Place>> {
    let mut scene = scene.clone();
    scene.loss = if flies { ContactLossRule::Fly } else { ContactLossRule::Stop };
    let mut places = Vec::with_capacity(count);
    let start_s = scene.start_s;
    let times = (0..count).map(|i| start_s + i as f64 * step_s);
    let mut observer = SampleObserver::new(times, |sample| {
        places.push(Place {
            head_x_m: sample.head_x_m,
            drop_m: sample.head_drop_m,
            tip_x_m: sample.tip_x_m,
            tip_height_m: sample.tip_height_m,
            lip_rad: sample.pose.phi,
        });
    });
    let run = run_scene_with(&scene, SolverOptions::from_scene(&scene), &mut observer);
    (run.status == RunStatus::Completed && places.len() == count).then_some(places)
}

/// Factor of the quantity `name` if lengths, times and masses are multiplied by `size`, `time` and `mass`.
fn unit_of(name: &str, size: f64, time: f64, mass: f64) -> f64 {
    match name.rsplit_once('.').map_or(name, |(_, key)| key) {
        key if key.ends_with("_kg") => mass,
        key if key.ends_with("_kg_m2") => mass * size * size,
        key if key.ends_with("_s_per_m") => time / size,
        key if key.ends_with("_n_m_per_rad") => mass * size * size / (time * time),
        key if key.ends_with("_hz") => 1.0 / time,
        key if key.ends_with("_force_n") => mass * size / (time * time),
        key if key.ends_with("_m") => size,
        _ => 1.0,
    }
}

/// The job of a blade. Its bounds are wider than the ranges of the true values, and the constants have the
/// default priors.
pub fn write_job(blade: &Blade, number: u64) -> String {
    let mut text = format!(
        "format = 1\ntitle = \"Recovery\"\nscene = \"scene\"\nseed = {}\n[[recording]]\npath = \"film\"\n",
        number + 1
    );
    for (name, _, bounds) in SOUGHT {
        let [lower, upper] = bounds.map(|bound| bound * unit_of(name, blade.size, blade.time, blade.mass));
        let _ = write!(
            text,
            "[[parameter]]\nname = \"{name}\"\nlower = {lower}\nupper = {upper}\nscale = \"log\"\n"
        );
    }
    text + "[[trace]]\n"
}
