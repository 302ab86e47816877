//! Alignment of the model's clock and origin with those of a recording.

use crate::recording::Recording;
use crate::recording::channel::{Channel, ReversalInstants, central_moments};
use portable_math as math;
use serde::Serialize;

/// Offsets that are added to the model's times and positions so that its head follows the recorded head.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Alignment {
    /// Offset of the model's times, s.
    pub shift_s: f64,
    /// Offset of the model's head and tip along the sweep, m.
    pub along_m: f64,
    /// Offset of the model's tip relative to its head along the sweep, m.
    pub tip_m: f64,
    /// Offset of the model's head drop, m.
    pub drop_m: f64,
    /// Point whose path in the model is aligned with its recorded path.
    pub followed: AlignmentPoint,
    /// Standard deviation of the time shift, s; infinite if the path does not determine the shift, `None` if
    /// no path is fitted.
    pub shift_sd_s: Option<f64>,
    /// Whether the recorded head turns in the opposite direction to the model's head; the paths are then
    /// aligned only at the turn.
    pub opposite_turn: bool,
}

/// The point whose path aligns a model with a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum AlignmentPoint {
    /// The head.
    #[default]
    Head,
    /// The tip, if no head was tracked.
    Tip,
}

impl AlignmentPoint {
    fn path(self, recording: &Recording) -> &[Option<f64>] {
        match self {
            Self::Head => &recording.traces().head_x_m,
            Self::Tip => &recording.traces().tip_x_m,
        }
    }
}

/// Whether a column has any value.
pub(crate) fn is_tracked(column: &[Option<f64>]) -> bool {
    column.iter().any(Option::is_some)
}

/// Maximum number of least-squares steps. The head's path is smooth, and three steps find the time shift to a
/// nanosecond.
const MAX_STEPS: usize = 8;
/// Step of the time shift below which the iteration ends, s.
const MIN_STEP_S: f64 = 1e-9;
/// Maximum number of frames from which an alignment is estimated; more frames would change the time shift by
/// less than a microsecond.
const MAX_FRAMES: usize = 20_000;

impl Alignment {
    /// Estimates the time shift and the offsets; a camera has its own clock and origin. The estimate starts
    /// from the first turn of the head in recording and model, then minimises the squared distance of their
    /// head paths, or of their tip paths if no head was tracked.
    pub(crate) fn estimate(measured: &Recording, model: &Recording) -> Self {
        let turns = ReversalInstants::first_turn_s(measured).zip(ReversalInstants::first_turn_s(model));
        let head_tracked = is_tracked(&measured.traces().head_x_m);
        let by = if head_tracked { AlignmentPoint::Head } else { AlignmentPoint::Tip };
        let mut shift_s = turns
            .map_or_else(|| best_overlap_shift_s(measured, model, by), |(measured, model)| measured - model);
        let (mut along_m, mut shift_sd_s) = (0.0, None);
        let opposite = turns.filter(|(of_measured, of_model)| {
            head_turn_m(measured, *of_measured) * head_turn_m(model, *of_model) < 0.0
        });
        if let Some((of_measured, of_model)) = opposite {
            let at = |recording, t| head_at(recording, t).unwrap_or_default();
            along_m = at(measured, of_measured) - at(model, of_model);
        }
        for _ in 0..if opposite.is_some() { 0 } else { MAX_STEPS } {
            let Some(step) = AlignmentStep::least_squares(measured, model, by, shift_s) else { break };
            shift_s += step.time_s;
            (along_m, shift_sd_s) = (step.mean_m, Some(step.time_sd_s));
            if step.time_s.abs() < MIN_STEP_S {
                break;
            }
        }
        let drop_m = mean_drop_offset_m(measured, model, shift_s);
        let opposite_turn = opposite.is_some();
        Self { shift_s, along_m, tip_m: 0.0, drop_m, followed: by, shift_sd_s, opposite_turn }
    }

    /// Offset that is added to a channel of the model, m.
    pub(crate) fn offset_m(&self, channel: Channel) -> f64 {
        match channel {
            Channel::TipX => self.along_m + self.tip_m,
            Channel::HeadX => self.along_m,
            Channel::Deflection => self.tip_m,
            Channel::HeadDrop => self.drop_m,
        }
    }
}

fn head_at(recording: &Recording, t: f64) -> Option<f64> {
    recording.interpolate_column(&recording.traces().head_x_m, t)
}

/// Travel of the head in a short time after a turn, m; its sign is the direction after the turn. Of a few
/// trial times, the longest at whose end the head is tracked is used; 0 if there is none.
fn head_turn_m(recording: &Recording, turn_s: f64) -> f64 {
    const TIMES_S: [f64; 4] = [0.04, 0.02, 0.01, 0.005];
    let travel = |time_s: &f64| Some(head_at(recording, turn_s + time_s)? - head_at(recording, turn_s)?);
    TIMES_S.iter().find_map(travel).unwrap_or_default()
}

/// Time shift at which the recorded path differs least from the model's path, apart from a constant offset.
/// The trial shifts are evenly spaced. The function is used if recording or model has no turn.
fn best_overlap_shift_s(measured: &Recording, model: &Recording, by: AlignmentPoint) -> f64 {
    const PLACES: u32 = 200;
    const FRAMES: usize = 100;
    let end_s = |recording: &Recording| recording.grid().time_s(recording.grid().frames.saturating_sub(1));
    let ends = [measured.grid().start_s - model.grid().start_s, end_s(measured) - end_s(model)];
    let frames: Vec<usize> =
        used_frames(measured).step_by(used_frames(measured).count().div_ceil(FRAMES).max(1)).collect();
    let spread = |shift_s: f64| {
        let apart = |i: &usize| {
            let t = measured.grid().time_s(*i) - shift_s;
            Some((*by.path(measured).get(*i)?)? - model.interpolate_column(by.path(model), t)?)
        };
        let all: Vec<f64> = frames.iter().filter_map(apart).collect();
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        (2 * all.len() > frames.len())
            .then(|| all.iter().map(|x| math::powi(x - mean, 2)).sum::<f64>() / all.len() as f64)
    };
    let places = (0..=PLACES).map(|k| ends[0] + (ends[1] - ends[0]) * f64::from(k) / f64::from(PLACES));
    let best =
        places.filter_map(|shift_s| Some((shift_s, spread(shift_s)?))).min_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or(0.0, |(shift_s, _)| shift_s)
}

/// Indices of at most [`MAX_FRAMES`] evenly spaced frames.
fn used_frames(recording: &Recording) -> impl Iterator<Item = usize> {
    let frames = recording.grid().frames;
    (0..frames).step_by(frames.div_ceil(MAX_FRAMES).max(1))
}

/// One Gauss-Newton step of the time shift, and the mean offset of the recorded path from the model's path,
/// m.
struct AlignmentStep {
    time_s: f64,
    /// Standard deviation of the time shift from the residuals, s.
    time_sd_s: f64,
    mean_m: f64,
}

impl AlignmentStep {
    fn least_squares(
        measured: &Recording,
        model: &Recording,
        by: AlignmentPoint,
        shift_s: f64,
    ) -> Option<Self> {
        let (grid, frame_s) = (measured.grid(), 1.0 / model.grid().frame_rate_hz);
        let place = |t: f64| model.interpolate_column(by.path(model), t);
        let point = |i: usize| {
            let t = grid.time_s(i) - shift_s;
            let speed = (place(t + frame_s)? - place(t - frame_s)?) / (2.0 * frame_s);
            Some((speed, (*by.path(measured).get(i)?)? - place(t)?))
        };
        let points: Vec<(f64, f64)> = used_frames(measured).filter_map(point).collect();
        let count = points.len() as f64;
        let ([mean_speed, mean_m], [spread, both]) = central_moments(&points);
        // if the model is late by a time, its position lags by its speed times this time
        let time_s = if spread > 0.0 { -both / spread } else { 0.0 };
        let residual = |p: &(f64, f64)| p.1 - mean_m + time_s * (p.0 - mean_speed);
        let left: f64 = points.iter().map(|p| math::powi(residual(p), 2)).sum();
        let time_sd_s =
            if spread > 0.0 && count > 2.0 { (left / (count - 2.0) / spread).sqrt() } else { f64::INFINITY };
        (count > 0.0).then_some(Self { time_s, time_sd_s, mean_m: mean_m + time_s * mean_speed })
    }
}

fn mean_drop_offset_m(measured: &Recording, model: &Recording, shift_s: f64) -> f64 {
    let grid = measured.grid();
    let (column, measured_m) = (&model.traces().head_y_m, &measured.traces().head_y_m);
    let difference =
        |i: usize| Some(model.interpolate_column(column, grid.time_s(i) - shift_s)? - (*measured_m.get(i)?)?);
    let all: Vec<f64> = used_frames(measured).filter_map(difference).collect();
    if all.is_empty() { 0.0 } else { all.iter().sum::<f64>() / all.len() as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{FrameGrid, Traces};

    fn recording(start_s: f64, frames: usize, origin_m: f64, of: impl Fn(f64) -> f64) -> Recording {
        let grid = FrameGrid { start_s, frame_rate_hz: 5000.0, frames };
        let column =
            |sign: f64| (0..frames).map(|i| Some(origin_m + sign * of(grid.time_s(i)))).collect::<Vec<_>>();
        let traces = Traces {
            tip_x_m: column(1.0),
            tip_y_m: vec![None; frames],
            head_x_m: column(1.0),
            head_y_m: column(-1.0),
            ..Traces::default()
        };
        Recording::new("r", grid, traces, true).unwrap()
    }

    #[test]
    fn the_clock_and_the_origin_are_found_to_a_share_of_a_frame() {
        let head = |t: f64| 0.05 * (1.0 - (6.0 * t).cos());
        let (model, measured) =
            (recording(0.3, 3000, 0.0, head), recording(0.0, 2000, 1e-3, |t| head(t + 0.40007)));
        let found = Alignment::estimate(&measured, &model);
        assert!((found.shift_s + 0.40007).abs() < 1e-7, "{found:?}");
        assert!((found.along_m - 1e-3).abs() < 1e-7 && (found.drop_m + 1e-3).abs() < 1e-7, "{found:?}");
        assert!(
            found.followed == AlignmentPoint::Head && found.shift_sd_s.is_some_and(|sd| sd < 1e-6),
            "{found:?}"
        );
    }

    #[test]
    fn a_head_that_turns_the_other_way_is_brought_to_the_turn_alone() {
        let head = |t: f64| 0.05 * (1.0 - (6.0 * t).cos());
        let (model, measured) =
            (recording(0.3, 3000, 0.0, head), recording(0.0, 2000, 0.0, |t| 1e-3 - head(t + 0.4)));
        let found = Alignment::estimate(&measured, &model);
        assert!(
            found.opposite_turn && (found.shift_s + 0.4).abs() < 2e-3 && (found.along_m + 0.199).abs() < 1e-5,
            "{found:?}"
        );
        assert!(!Alignment::estimate(&model, &model).opposite_turn);
    }

    #[test]
    fn without_a_head_the_tip_is_followed() {
        let path = |t: f64| 0.05 * (1.0 - (6.0 * t).cos());
        let model = recording(0.1, 4000, 0.0, path);
        let whole = recording(0.0, 600, 1e-3, |t| path(t + 0.20007));
        let traces =
            Traces { head_x_m: vec![None; 600], head_y_m: vec![None; 600], ..whole.traces().clone() };
        let found = Alignment::estimate(&Recording::new("r", whole.grid(), traces, true).unwrap(), &model);
        assert!(
            found.followed == AlignmentPoint::Tip
                && (found.shift_s + 0.20007).abs() < 1e-6
                && (found.along_m - 1e-3).abs() < 1e-6,
            "{found:?}"
        );
    }

    #[test]
    fn a_path_that_hardly_bends_does_not_fix_the_clock() {
        let head = |t: f64| 0.05 * (1.0 - (6.0 * t).cos());
        let mut state = 7_u64;
        let mut noisy = |x: f64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            x + 7e-6 * ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5)
        };
        let short = recording(0.26, 30, 0.0, head);
        let traces = Traces {
            head_x_m: short.traces().head_x_m.iter().map(|x| x.map(&mut noisy)).collect(),
            ..short.traces().clone()
        };
        let found = Alignment::estimate(
            &Recording::new("r", short.grid(), traces, true).unwrap(),
            &recording(0.1, 4000, 0.0, head),
        );
        let sd_s = found.shift_sd_s.unwrap();
        assert!(sd_s > 1e-4 && found.shift_s.abs() < 4.0 * sd_s, "{found:?}");
    }

    #[test]
    fn a_part_without_a_turn_is_found_in_the_run() {
        let head = |t: f64| 0.05 * (1.0 - (6.0 * t).cos());
        let (model, measured) =
            (recording(0.1, 4000, 0.0, head), recording(0.0, 600, 1e-3, |t| head(t + 0.20007)));
        let found = Alignment::estimate(&measured, &model);
        assert!((found.shift_s + 0.20007).abs() < 1e-6 && (found.along_m - 1e-3).abs() < 1e-6, "{found:?}");
    }
}
