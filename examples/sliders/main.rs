//! Tests whether fits recover the known values of sliders, whose recordings are synthetic. Each slider is
//! simulated with Runge-Kutta steps of a fixed length, whose events are bisected. This simulation shares no
//! function with the library. The sensors have noise, steps and a difference between their zeros.
//!
//! `cargo run --release --example sliders` fits forty sliders and prints how many parameters the fits
//! identify, how often the 95 % intervals contain the true values, and how wide the intervals are.
//! `-- 0..10` fits the first ten.

#[path = "../recovery/information.rs"]
#[allow(dead_code)] // the priors are given here
mod information;

use information::{descend_from, find_deviations};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;
use wiperlab::fit::job::Job;
use wiperlab::fit::{MeasuredRecording, Problem};
use wiperlab::recording::{FrameGrid, Recording, Traces};
use wiperlab::simulate::scene::Scene;

const NAMES: [&str; 3] = ["friction.c", "slider.stiffness_n_per_m", "slider.damping_n_s_per_m"];
/// Length of a step of the simulation, s.
const STEP_S: f64 = 1e-4;
/// Number of steps per frame.
const STEPS: usize = 40;
const FRAMES: usize = 2501;
/// Step of the sensors, m.
const SENSOR_STEP_M: f64 = 0.78e-6;
/// Largest arm, m, of the slider in the model; the scale of its starting states.
const ARM_M: f64 = (1u64 << 60) as f64;

/// A slider on a head that moves as a cosine.
struct Slider {
    mass: f64,
    stiffness: f64,
    damping: f64,
    normal: f64,
    friction: f64,
    amplitude: f64,
    omega: f64,
    phase: f64,
}

impl Slider {
    fn draw_slider(random: &mut Xoshiro256PlusPlus) -> Self {
        let mut within = |low: f64, high: f64| low * (high / low).powf(random.random());
        let (mass, stiffness, normal) = (within(1.0, 5.0), within(500.0, 3000.0), within(2.0, 20.0));
        let friction = within(0.15, 0.6);
        let slack_m = friction * normal / stiffness;
        Self {
            mass,
            stiffness,
            damping: 2.0 * within(0.005, 0.05) * (stiffness * mass).sqrt(),
            normal,
            friction,
            amplitude: slack_m * within(1.5, 4.0),
            omega: (stiffness / mass).sqrt() * within(0.2, 0.6),
            phase: TAU * random.random::<f64>(),
        }
    }

    fn head_motion(&self, t: f64) -> [f64; 2] {
        let (sin, cos) = (self.omega * t + self.phase).sin_cos();
        [self.amplitude * cos, -self.amplitude * self.omega * sin]
    }

    /// Force of spring and damper on the slider.
    fn pull_force(&self, t: f64, [x, v]: [f64; 2]) -> f64 {
        let [head, speed] = self.head_motion(t);
        self.stiffness * (head - x) + self.damping * (speed - v)
    }

    fn friction_limit(&self) -> f64 {
        self.friction * self.normal
    }

    /// The state after a step of slip in the direction `sign`.
    fn slip_step(&self, t: f64, state: [f64; 2], sign: f64, h: f64) -> [f64; 2] {
        let rate =
            |t: f64, s: [f64; 2]| [s[1], (self.pull_force(t, s) - sign * self.friction_limit()) / self.mass];
        let after = |k: [f64; 2], h: f64| [state[0] + h * k[0], state[1] + h * k[1]];
        let a = rate(t, state);
        let b = rate(t + 0.5 * h, after(a, 0.5 * h));
        let c = rate(t + 0.5 * h, after(b, 0.5 * h));
        let d = rate(t + h, after(c, h));
        std::array::from_fn(|i| state[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]))
    }

    /// Positions at the frames, from rest with a relaxed spring.
    fn frame_positions(&self) -> Vec<f64> {
        let (mut state, mut sign) = ([self.head_motion(0.0)[0], 0.0], 0.0);
        let mut found = vec![state[0]];
        for step in 0..STEPS * (FRAMES - 1) {
            let (mut t, end) = (step as f64 * STEP_S, (step + 1) as f64 * STEP_S);
            while t < end {
                let from = t;
                if sign == 0.0 {
                    // the share of the step until friction reaches its limit
                    let excess = |share: f64| {
                        self.pull_force(from + share * (end - from), state).abs() - self.friction_limit()
                    };
                    let share = find_onset(|share| excess(share) > 0.0);
                    t = from + share * (end - from);
                    if excess(share) > 0.0 {
                        sign = self.pull_force(t, state).signum();
                    }
                } else {
                    let after = |share: f64| self.slip_step(from, state, sign, share * (end - from));
                    // a slip begins at rest, so only a motion against its direction ends it
                    let share = find_onset(|share| after(share)[1] * sign < 0.0);
                    state = after(share);
                    t = from + share * (end - from);
                    if state[1] * sign <= 0.0 {
                        state[1] = 0.0;
                        let pull = self.pull_force(t, state);
                        sign = if pull.abs() > self.friction_limit() { pull.signum() } else { 0.0 };
                    }
                }
                if end - t < 1e-12 {
                    break;
                }
            }
            if (step + 1) % STEPS == 0 {
                found.push(state[0]);
            }
        }
        found
    }

    /// The scene with these values, in which mass and normal force have the given relative errors.
    fn write_scene(&self, errors: [f64; 2]) -> Scene {
        let Self { mass, stiffness, damping, normal, friction, .. } = self;
        let (mass, normal) = (mass * (1.0 + errors[0]), normal * (1.0 + errors[1]));
        let text = format!(
            "format = 1\ntitle = \"slider\"\n[slider]\nmass_kg = {mass}\nnormal_force_n = {normal}\n\
             stiffness_n_per_m = {stiffness}\ndamping_n_s_per_m = {damping}\n\
             [friction]\na = 0.0\nb_s_per_m = 0.0\nc = {friction}\n[drive]\nspeed_m_per_s = 0.0\n\
             [run]\nstop_s = 10.0\nsample_rate_hz = 250.0\n"
        );
        Scene::parse("scene.toml", &text).expect("a scene")
    }

    fn true_values(&self) -> [f64; 3] {
        [self.friction, self.stiffness, self.damping]
    }
}

/// The smallest fraction of a step at which `happens` is true, up to rounding; 1 if it is not true at 1.
fn find_onset(happens: impl Fn(f64) -> bool) -> f64 {
    let [mut low, mut high] = [0.0, 1.0];
    if happens(high) {
        for _ in 0..48 {
            let middle = 0.5 * (low + high);
            if happens(middle) { high = middle } else { low = middle }
        }
    }
    high
}

fn normal_number(random: &mut Xoshiro256PlusPlus) -> f64 {
    let [a, b]: [f64; 2] = [random.random(), random.random()];
    (-2.0 * (1.0 - a).ln()).sqrt() * (TAU * b).cos()
}

fn record_slider(slider: &Slider, random: &mut Xoshiro256PlusPlus) -> Recording {
    let noise_m = 0.5e-6 * 10f64.powf(random.random());
    let zeros: [f64; 2] = std::array::from_fn(|_| 1e-4 * normal_number(random));
    let mut read = |true_m: f64, zero_m: f64| {
        let noisy = true_m + zero_m + noise_m * normal_number(random);
        Some((noisy / SENSOR_STEP_M).round() * SENSOR_STEP_M)
    };
    let grid = FrameGrid { start_s: 0.0, frame_rate_hz: 1.0 / (STEPS as f64 * STEP_S), frames: FRAMES };
    let traces = Traces {
        tip_x_m: slider.frame_positions().into_iter().map(|x| read(x, zeros[0])).collect(),
        head_x_m: (0..FRAMES).map(|i| read(slider.head_motion(grid.time_s(i))[0], zeros[1])).collect(),
        tip_y_m: vec![None; FRAMES],
        head_y_m: vec![None; FRAMES],
        ..Traces::default()
    };
    Recording::new("slider", grid, traces, true).expect("a recording")
}

fn write_job(slider: &Slider, number: u64) -> Job {
    let bounds = |name: &str, low: f64, high: f64, scale: &str| {
        format!("[[parameter]]\nname = \"{name}\"\nlower = {low}\nupper = {high}\nscale = \"{scale}\"\n")
    };
    let [_, stiffness, _] = slider.true_values();
    let most = 0.4 * (stiffness * slider.mass).sqrt();
    let text = format!(
        "format = 1\ntitle = \"slider\"\nscene = \"scene.toml\"\nseed = {number}\n\
         nuisance = [{{ name = \"slider.mass_kg\", sd = \"1 %\" }}, {{ name = \"slider.normal_force_n\", sd = \"1 %\" }}]\n\
         [[recording]]\npath = \"recording\"\n{}{}{}[[trace]]\nchannels = [\"tip-x\"]\n[trace.camera]\noffset_sd_m = 0.002\n",
        bounds(NAMES[0], 0.03, 1.5, "log"),
        bounds(NAMES[1], stiffness / 6.0, stiffness * 10.0, "log"),
        bounds(NAMES[2], 1e-3 * most, most, "log"),
    );
    Job::parse("job.toml", &text).expect("a job")
}

fn main() {
    let range = std::env::args().nth(1).unwrap_or("0..40".to_owned());
    let (from, to) = range.split_once("..").expect("a range such as 0..40");
    let [from, to] = [from, to].map(|end| end.parse::<u64>().expect("a number"));
    let (mut answered, mut contained, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
    println!(
        "slider  explained  parameter                      truth    estimate  half width / (1.96 bound)"
    );
    for number in from..to {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(number);
        let slider = Slider::draw_slider(&mut random);
        let recording = record_slider(&slider, &mut random);
        let errors = std::array::from_fn(|_| 0.01 * normal_number(&mut random));
        let measured = vec![MeasuredRecording { recording, exposure_s: Some(0.0) }];
        let problem = Problem::new(write_job(&slider, number), vec![slider.write_scene(errors)], measured)
            .expect("a problem");
        let result = problem.fit().expect("a fit");
        let truth = descend_from(&problem, &slider.write_scene([0.0; 2]));
        let bounds = truth.as_ref().and_then(|(model, at)| {
            let lip = 1e-6 / ARM_M;
            find_deviations(model, at, [0.0, lip, 0.0, lip * (slider.stiffness / slider.mass).sqrt()])
        });
        let explained = result.misfit.as_ref().is_some_and(|misfit| misfit.explained);
        if !explained {
            let from_truth = truth.map_or(f64::NAN, |(_, at)| at.cost);
            println!("{number:6}  cost {:.1}, from the true values {from_truth:.1}", result.cost);
        }
        let mut hits = Vec::new();
        for (name, truth) in NAMES.into_iter().zip(slider.true_values()) {
            let found = &result.parameters[name];
            let known = found.verdict.name() == "identified";
            answered.push(f64::from(known));
            let ends = found.lower_95.zip(found.upper_95).filter(|_| known);
            hits.extend(ends.map(|(low, high)| f64::from(low < truth && truth < high)));
            let bound = bounds.as_ref().and_then(|bounds| bounds.get(name)).copied();
            let ratio = ends.zip(bound).map(|((low, high), bound)| (high / low).ln() / (2.0 * 1.96 * bound));
            ratios.extend(ratio);
            let ratio = ratio.map_or_else(|| found.reasons.join("; "), |ratio| format!("{ratio:.2}"));
            println!("{number:6}  {explained:9}  {name:25} {truth:10.4}  {:10.4}  {ratio}", found.estimate);
        }
        if !hits.is_empty() {
            contained.push(mean_value(&hits));
        }
    }
    let (coverage, count) = (mean_value(&contained), contained.len() as f64);
    let scatter =
        mean_value(&contained.iter().map(|c| (c - coverage).powi(2)).collect::<Vec<_>>()) / (count - 1.0);
    ratios.sort_by(f64::total_cmp);
    if ratios.is_empty() {
        return;
    }
    println!("\nanswered: {:.3} of {} parameters", mean_value(&answered), answered.len());
    println!("coverage of 95 % intervals: {coverage:.3} +- {:.3} (sliders as units)", 1.96 * scatter.sqrt());
    println!("half width over 1.96 Cramér-Rao deviations: median {:.2}", ratios[ratios.len() / 2]);
    println!("  90 % of them below {:.2}", ratios[9 * ratios.len() / 10]);
}

fn mean_value(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
