//! Hypotheses that may explain a recording, and the problem that each of them implies.

use super::lost_frames::{find_lost_frames, insert_lost_frames};
use crate::fit::bounds::{Bounds, BoundsSpacing};
use crate::fit::job::{FreeParameter, HeadSource, is_same_quantity};
use crate::fit::problem::Problem;
use crate::fit::trace_data::MIN_SEGMENT_FRAMES;
use crate::model::parameters::find_parameter;
use crate::recording::{Recording, Traces};
use crate::text::format_trimmed;
use portable_math as math;

/// Reason why a model may not explain its recordings. A hypothesis changes all recordings of a job in the
/// same way.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Hypothesis {
    /// Nothing is wrong; the other hypotheses are compared with this one.
    Unchanged,
    /// The tracks of tip and head are exchanged.
    SwappedPoints,
    /// Positions along the sweep have the wrong sign.
    MirroredSweep,
    /// Heights have the wrong sign.
    MirroredHeights,
    /// The true frame rate, divided by the rate of the recording.
    FrameRate(f64),
    /// True lengths, divided by the lengths of the recording.
    Scale(f64),
    /// Time, s, by which the track of the head is late.
    HeadLate(f64),
    /// Frames were lost, and the remaining frames were closed up.
    LostFrames,
    /// The constant with this name has another value; the search starts at this factor on its value.
    Constant(&'static str, f64),
    /// The neck has a shoulder at this angle, rad.
    Shoulder(f64),
    /// Friction changed during the recording, so each half is fitted apart.
    ChangedFriction,
}

/// Factors by which a frame rate may be off: powers of ten, playback for recording rates, and 60 for 50.
const RATE_FACTORS: [f64; 11] = [0.01, 0.1, 0.25, 0.5, 0.7, 1.0 / 1.2, 1.2, 1.4, 2.0, 4.0, 10.0];
/// Factors by which lengths may be off: units of a file, a radius for a diameter, and a badly read scale.
const SCALE_FACTORS: [f64; 10] = [0.001, 0.1, 0.5, 0.7, 1.0 / 1.2, 1.2, 1.4, 2.0, 10.0, 1000.0];
/// Times by which the head's track may be late, in units of the length of the shortest segments.
const LATE_SEGMENTS: [f64; 6] = [-0.8, -0.3, -0.1, 0.1, 0.3, 0.8];
/// Constants whose values are doubted: those that are read off a picture, weighed or pressed.
const CONSTANTS: [&str; 7] = [
    "blade.neck_length_m",
    "blade.lip_length_m",
    "blade.head_mass_kg",
    "blade.neck_mass_kg",
    "blade.lip_mass_kg",
    "blade.preload_force_n",
    "blade.preload_displacement_m",
];
/// Factors on a constant at which the search starts, and the largest factor, in either direction, by which it
/// departs from them.
const CONSTANT_FACTORS: [f64; 3] = [0.6, 1.0, 1.6];
const MAX_CONSTANT_FACTOR: f64 = 3.0;
/// Angles at which a neck may meet a shoulder, rad.
const SHOULDER_ANGLES_RAD: [f64; 2] = [0.05, 0.1];
/// Lowest and highest stiffness of a shoulder, divided by that of the neck, and angles at which the neck may
/// meet it, divided by the angle that is tried.
const SHOULDER_RATIOS: [f64; 2] = [2.0, 40.0];
const SHOULDER_ANGLE_FACTORS: [f64; 2] = [0.4, 2.5];

impl Hypothesis {
    /// All hypotheses that are tried on a problem.
    pub(super) fn list_all(problem: &Problem) -> Vec<Self> {
        let shortest_s = problem.segment_s().first().copied().unwrap_or_default();
        let scenes =
            || problem.traces.iter().map(|traced| &problem.model.conditions()[traced.condition].scene);
        let is_slider = scenes().any(|scene| scene.linkage.is_slider());
        let is_free =
            |name: &str| problem.job.parameters.iter().any(|free| is_same_quantity(&free.name, name));
        let mut all = vec![Self::SwappedPoints];
        if !is_slider {
            all.push(Self::MirroredHeights);
        }
        // the model of a blade that is driven by its recorded head is symmetric
        if problem.traces.iter().any(|traced| traced.head == HeadSource::Scene) {
            all.push(Self::MirroredSweep);
        }
        // another unit of length changes the friction of a slider by the same factor, and another unit of
        // time changes friction, stiffness and damping: if these are free, the fit has tried all units
        let has_free_friction = is_slider && is_free("friction.c");
        let has_free_times =
            has_free_friction && is_free("slider.stiffness_n_per_m") && is_free("slider.damping_n_s_per_m");
        if !has_free_times {
            all.extend(RATE_FACTORS.map(Self::FrameRate));
        }
        if !has_free_friction {
            all.extend(SCALE_FACTORS.map(Self::Scale));
        }
        all.extend(LATE_SEGMENTS.map(|part| Self::HeadLate(part * shortest_s)));
        all.push(Self::LostFrames);
        let is_held = |name: &&str| {
            scenes().all(|scene| scene.written_values().any(|(own, value)| own == *name && value > 0.0))
                && !is_free(name)
        };
        let each = |name| CONSTANT_FACTORS.map(|factor| Self::Constant(name, factor));
        all.extend(CONSTANTS.into_iter().filter(is_held).flat_map(each));
        if scenes().all(|scene| scene.linkage.shoulder.is_none()) {
            all.extend(SHOULDER_ANGLES_RAD.map(Self::Shoulder));
        }
        if problem.job.parameters.iter().any(|free| free.name.starts_with("friction.")) {
            all.push(Self::ChangedFriction);
        }
        all
    }

    /// Name in `result.json`.
    pub(super) fn kind_name(&self) -> &'static str {
        match self {
            Self::Unchanged => "unchanged",
            Self::SwappedPoints => "swapped-points",
            Self::MirroredSweep => "mirrored-sweep",
            Self::MirroredHeights => "mirrored-heights",
            Self::FrameRate(_) => "frame-rate",
            Self::Scale(_) => "scale",
            Self::HeadLate(_) => "head-late",
            Self::LostFrames => "lost-frames",
            Self::Constant(..) => "constant",
            Self::Shoulder(_) => "shoulder",
            Self::ChangedFriction => "changed-friction",
        }
    }

    /// Whether two hypotheses differ at most in their number.
    pub(super) fn is_same_kind(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Constant(a, _), Self::Constant(b, _)) => a == b,
            _ => self.kind_name() == other.kind_name(),
        }
    }

    /// The number of the hypothesis as a coordinate for a search, and the first step of this search; `None`
    /// without a number that is searched for.
    pub(super) fn search_coordinate(&self, problem: &Problem) -> Option<[f64; 2]> {
        let shortest_s = problem.segment_s().first()?;
        match self {
            Self::FrameRate(factor) | Self::Scale(factor) => Some([math::ln(*factor), 0.08]),
            Self::HeadLate(late_s) => Some([late_s / shortest_s, 0.1]),
            _ => None,
        }
    }

    /// The hypothesis with another coordinate.
    pub(super) fn with_coordinate(&self, coordinate: f64, problem: &Problem) -> Self {
        let shortest_s = problem.segment_s().first().copied().unwrap_or_default();
        match self {
            Self::FrameRate(_) => Self::FrameRate(math::exp(coordinate)),
            Self::Scale(_) => Self::Scale(math::exp(coordinate)),
            Self::HeadLate(_) => Self::HeadLate(coordinate * shortest_s),
            other => other.clone(),
        }
    }

    /// The hypothesis with the usual numbers near its own: usual factors, or whole frames.
    pub(super) fn usual_numbers(&self, problem: &Problem) -> Vec<Self> {
        /// Largest factor between a number and a usual one near it.
        const NEAR: f64 = 1.25;
        let near = |list: &[f64], found: f64| -> Vec<f64> {
            let is_near = |usual: &f64| (found / NEAR..found * NEAR).contains(usual);
            list.iter().copied().filter(is_near).collect()
        };
        match self {
            Self::FrameRate(factor) => {
                near(&RATE_FACTORS, *factor).into_iter().map(Self::FrameRate).collect()
            }
            Self::Scale(factor) => near(&SCALE_FACTORS, *factor).into_iter().map(Self::Scale).collect(),
            Self::HeadLate(late_s) => {
                /// Largest distance from whole frames, in frames.
                const NEAR_FRAME: f64 = 0.1;
                let rate_hz =
                    fitted_recordings(problem).next().map_or(0.0, |first| first.grid().frame_rate_hz);
                let frames = (late_s * rate_hz).round();
                let is_near = frames != 0.0 && (late_s * rate_hz - frames).abs() < NEAR_FRAME;
                if is_near { vec![Self::HeadLate(frames / rate_hz)] } else { Vec::new() }
            }
            _ => Vec::new(),
        }
    }

    /// The problems that the hypothesis implies: one, or one for each half of the recordings. Empty if the
    /// hypothesis does not apply.
    pub(super) fn change_problem(&self, problem: &Problem) -> Vec<Problem> {
        let mut changed = problem.clone();
        let applies = match self {
            Self::ChangedFriction => return halve_problem(problem),
            Self::Constant(name, factor) => changed.free_constant(name, *factor),
            Self::Shoulder(angle_rad) => changed.add_shoulder(*angle_rad),
            Self::LostFrames => changed.insert_frames(),
            _ => changed.change_recordings(|recording| self.change_recording(recording)),
        };
        let keeps_noise = match self {
            Self::Unchanged | Self::Constant(..) | Self::Shoulder(_) => true,
            // (the positions of a slider do not move)
            Self::HeadLate(_) => changed.model.conditions().iter().all(|one| one.scene.linkage.is_slider()),
            _ => false,
        };
        if !keeps_noise {
            changed.traces.iter_mut().for_each(|traced| traced.noise = None);
        }
        if let Self::FrameRate(_) = self {
            changed.limit_exposures();
        }
        if let Self::Scale(factor) = self {
            changed
                .traces
                .iter_mut()
                .filter_map(|t| t.noise_m.as_mut())
                .for_each(|noise_m| *noise_m *= factor);
        }
        if applies && changed.keep_possible_stages() { vec![changed] } else { Vec::new() }
    }

    /// The recording with the error of the hypothesis removed; `None` if this is not possible.
    fn change_recording(&self, recording: &Recording) -> Option<Recording> {
        let (mut grid, mut traces) = (recording.grid(), recording.traces().clone());
        let multiply = |column: &mut Vec<Option<f64>>, factor: f64| {
            column.iter_mut().flatten().for_each(|value| *value *= factor);
        };
        match self {
            Self::SwappedPoints => {
                let Traces { tip_x_m, tip_y_m, head_x_m, head_y_m, tip_confidence, head_confidence } = traces;
                traces = Traces {
                    tip_x_m: head_x_m,
                    tip_y_m: head_y_m,
                    head_x_m: tip_x_m,
                    head_y_m: tip_y_m,
                    tip_confidence: head_confidence,
                    head_confidence: tip_confidence,
                };
            }
            Self::MirroredSweep => {
                [&mut traces.tip_x_m, &mut traces.head_x_m].into_iter().for_each(|x| multiply(x, -1.0));
            }
            Self::MirroredHeights => {
                [&mut traces.tip_y_m, &mut traces.head_y_m].into_iter().for_each(|y| multiply(y, -1.0));
            }
            Self::Scale(factor) => {
                let columns =
                    [&mut traces.tip_x_m, &mut traces.tip_y_m, &mut traces.head_x_m, &mut traces.head_y_m];
                columns.into_iter().for_each(|column| multiply(column, *factor));
            }
            Self::FrameRate(factor) => grid.frame_rate_hz *= factor,
            Self::HeadLate(late_s) => {
                let shift = |column: &[Option<f64>]| {
                    (0..grid.frames)
                        .map(|frame| recording.interpolate_column(column, grid.time_s(frame) + late_s))
                        .collect()
                };
                (traces.head_x_m, traces.head_y_m) = (shift(&traces.head_x_m), shift(&traces.head_y_m));
            }
            _ => {}
        }
        let synthetic = recording.is_synthetic();
        Recording::new(recording.name(), grid, traces, synthetic).ok()
    }

    /// The condition under which the model would explain the recordings, in words that follow "if". `sd` is
    /// the standard deviation of the number, and `changed` are the problems with the estimates of their
    /// parameters.
    pub(super) fn describe_condition(
        &self,
        problem: &Problem,
        found: Option<[f64; 2]>,
        parts: &[Vec<(String, f64)>],
    ) -> String {
        let value = |part: usize, name: &str| {
            let list = parts.get(part)?;
            list.iter().find(|(own, _)| own == name).map(|(_, value)| *value)
        };
        let number = |value: f64| format_trimmed(value, 3);
        let prefers = found.map_or(String::new(), |[factor, sd]| {
            format!(
                " (the data prefer a factor of {} +- {})",
                format_trimmed(factor, 4),
                format_trimmed(sd, 2)
            )
        });
        match self {
            Self::Unchanged => "nothing is changed".to_owned(),
            Self::SwappedPoints => "the points of tip and head are swapped".to_owned(),
            Self::MirroredSweep => "positions along the sweep have the other sign".to_owned(),
            Self::MirroredHeights => {
                "heights have the other sign, so that y points down instead of up or the reverse".to_owned()
            }
            Self::FrameRate(factor) => {
                let mut rates: Vec<f64> =
                    fitted_recordings(problem).map(|one| one.grid().frame_rate_hz).collect();
                rates.dedup();
                match rates[..] {
                    [stated_hz] => {
                        let [rate, stated] = [factor * stated_hz, stated_hz].map(format_frame_rate);
                        format!("the frame rate is {rate} instead of {stated} frames/s{prefers}")
                    }
                    _ => format!("the frame rates are {} times those stated{prefers}", number(*factor)),
                }
            }
            Self::Scale(factor) => {
                format!("all lengths are {} times those of the recording{prefers}", number(*factor))
            }
            Self::HeadLate(late_s) => {
                let rate_hz =
                    fitted_recordings(problem).next().map_or(0.0, |first| first.grid().frame_rate_hz);
                let when = if *late_s > 0.0 { "late" } else { "early" };
                let sd =
                    found.map_or(String::new(), |[_, sd]| format!(" +- {}", format_trimmed(1e3 * sd, 2)));
                format!(
                    "the head's clock is {}{sd} ms ({} frames) {when}",
                    number(1e3 * late_s.abs()),
                    number((late_s * rate_hz).abs())
                )
            }
            Self::LostFrames => {
                let lost = fitted_recordings(problem).flat_map(|recording| {
                    let at = |frame: usize| recording.grid().time_s(frame);
                    find_lost_frames(recording)
                        .into_iter()
                        .map(move |gap| format!("{} after {} s", gap.count, format_trimmed(at(gap.after), 5)))
                });
                format!("frames were lost and the others closed up: {}", lost.collect::<Vec<_>>().join(", "))
            }
            Self::Constant(name, _) => {
                let row = find_parameter(name);
                let (meaning, unit) = row.map_or((*name, ""), |row| (row.meaning, row.unit));
                let stated = scene_value(problem, name);
                let words = value(0, name).map_or(String::new(), |value| format!("{} {unit}", number(value)));
                let sd = found.map_or(String::new(), |[factor, sd]| {
                    format!(" (a factor of {} +- {})", format_trimmed(factor, 4), format_trimmed(sd, 2))
                });
                format!("the {meaning} is {words} instead of {} {unit}{sd}", number(stated))
            }
            Self::Shoulder(_) => {
                let angle = value(0, "shoulder.contact_angle_rad").map_or(String::new(), number);
                let ratio = value(0, "shoulder.stiffness_ratio").map_or(String::new(), number);
                format!(
                    "the neck meets a shoulder, which the scene does not have, at {angle} rad, and this adds {ratio} \
                     times the stiffness of the neck"
                )
            }
            Self::ChangedFriction => {
                let free = problem.job.parameters.iter().filter(|free| free.name.starts_with("friction."));
                let change = |free: &FreeParameter| {
                    let symbol = find_parameter(&free.name)?.symbol;
                    let [first, second] = [0, 1].map(|part| value(part, &free.name).map(number));
                    Some(format!("{symbol} is {} and then {}", first?, second?))
                };
                let changes: Vec<String> = free.filter_map(change).collect();
                format!(
                    "friction changed during the recording, whose halves are explained apart: {}",
                    changes.join(", ")
                )
            }
        }
    }
}

/// A frame rate with four digits and a comma before each three digits, such as 50,000.
fn format_frame_rate(rate_hz: f64) -> String {
    let text = format_trimmed(rate_hz, 4);
    let whole = text.split('.').next().unwrap_or_default();
    if text.contains('e') || whole.len() <= 3 {
        return text;
    }
    let digits = whole.char_indices().map(|(at, digit)| {
        let starts_group = at > 0 && (whole.len() - at).is_multiple_of(3);
        if starts_group { format!(",{digit}") } else { digit.to_string() }
    });
    digits.collect::<String>() + &text[whole.len()..]
}

/// The recordings whose traces are fitted.
fn fitted_recordings(problem: &Problem) -> impl Iterator<Item = &Recording> {
    problem.traces.iter().filter_map(|traced| problem.recordings[traced.condition].as_ref())
}

/// Value of a constant in the scene of the first trace.
pub(super) fn scene_value(problem: &Problem, name: &str) -> f64 {
    let first = problem.traces.first().map(|traced| &problem.model.conditions()[traced.condition].scene);
    first.and_then(|scene| scene.value(name)).unwrap_or(f64::NAN)
}

/// The problems of the first and of the second half of all recordings.
fn halve_problem(problem: &Problem) -> Vec<Problem> {
    let half = |second: bool| {
        let mut half = problem.clone();
        for traced in &mut half.traces {
            let middle = traced.frames.start.midpoint(traced.frames.end);
            traced.frames = if second { middle..traced.frames.end } else { traced.frames.start..middle };
        }
        half.keep_possible_stages().then_some(half)
    };
    [half(false), half(true)].into_iter().collect::<Option<_>>().unwrap_or_default()
}

impl Problem {
    /// Replaces all fitted recordings; returns whether this was possible.
    fn change_recordings(&mut self, change: impl Fn(&Recording) -> Option<Recording>) -> bool {
        self.traces.iter().all(|traced| {
            let changed = self.recordings[traced.condition].as_ref().and_then(&change);
            let possible = changed.is_some();
            self.recordings[traced.condition] = changed;
            possible
        })
    }

    /// Limits the exposure times of all fitted recordings to the time between frames.
    fn limit_exposures(&mut self) {
        for traced in &self.traces {
            let Some(recording) = &self.recordings[traced.condition] else { continue };
            let exposure_s = &mut self.model.conditions_mut()[traced.condition].instrument.camera.exposure_s;
            *exposure_s = exposure_s.min(1.0 / recording.grid().frame_rate_hz);
        }
    }

    /// Makes a constant of the scene a free parameter; returns whether this is possible.
    fn free_constant(&mut self, name: &str, factor: f64) -> bool {
        let value = factor * scene_value(self, name);
        self.constants.retain(|constant| !is_same_quantity(&constant.name, name));
        self.free_within(name, [value / MAX_CONSTANT_FACTOR, value * MAX_CONSTANT_FACTOR])
    }

    fn free_within(&mut self, name: &str, [lower, upper]: [f64; 2]) -> bool {
        let Ok(bounds) = Bounds::new(lower, upper, BoundsSpacing::Log) else { return false };
        self.job.parameters.push(FreeParameter { name: name.to_owned(), bounds, prior: None });
        true
    }

    /// Adds a shoulder to all scenes, with free angle and stiffness; returns whether this is possible.
    fn add_shoulder(&mut self, angle_rad: f64) -> bool {
        let ratio = (SHOULDER_RATIOS[0] * SHOULDER_RATIOS[1]).sqrt();
        for condition in self.model.conditions_mut() {
            let Ok(scene) = condition.scene.with_shoulder(angle_rad, ratio) else { return false };
            condition.scene = scene;
        }
        self.free_within(
            "shoulder.contact_angle_rad",
            SHOULDER_ANGLE_FACTORS.map(|factor| factor * angle_rad),
        ) && self.free_within("shoulder.stiffness_ratio", SHOULDER_RATIOS)
    }

    /// Inserts the frames that are missing in the recordings; returns whether any are.
    fn insert_frames(&mut self) -> bool {
        let mut any = false;
        for traced in &mut self.traces {
            let Some(recording) = &self.recordings[traced.condition] else { continue };
            let gaps = find_lost_frames(recording);
            let shift = |frame: usize| {
                frame + gaps.iter().filter(|gap| gap.after < frame).map(|gap| gap.count).sum::<usize>()
            };
            traced.frames = shift(traced.frames.start)..shift(traced.frames.end);
            any |= !gaps.is_empty();
            self.recordings[traced.condition] = insert_lost_frames(recording, &gaps);
        }
        any && self.traces.iter().all(|traced| self.recordings[traced.condition].is_some())
    }

    /// Keeps the stages whose segments have enough frames in all recordings; returns whether any are left.
    fn keep_possible_stages(&mut self) -> bool {
        let (traces, recordings) = (&self.traces, &self.recordings);
        self.segment_s.retain(|length_s| {
            traces.iter().all(|traced| {
                let rate_hz = recordings[traced.condition].as_ref().map_or(0.0, |r| r.grid().frame_rate_hz);
                let frames = (length_s * rate_hz).round() as usize;
                (MIN_SEGMENT_FRAMES..=traced.frames.len()).contains(&frames)
            })
        });
        !self.segment_s.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::format_frame_rate;

    #[test]
    fn a_frame_rate_has_commas() {
        let rates = [999.0, 5000.0, 50_000.0, 1234.5].map(format_frame_rate);
        assert_eq!(rates, ["999", "5,000", "50,000", "1,234"]);
    }
}
