//! The model's clock and origin on those of a recording.

use crate::recording::Recording;
use crate::recording::channel::{Anchor, Instants};

/// What is added to the model's times and positions so that its head runs with the recorded one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Aligned {
    /// Of its times, s.
    pub shift_s: f64,
    /// Of head and tip along the sweep, m.
    pub along_m: f64,
    /// Of the head drop, m.
    pub drop_m: f64,
}

/// Steps of the least squares: the head's path is smooth, and three bring it to a nanosecond.
const STEPS: usize = 8;
/// A shorter step ends them, s.
const LEAST_STEP_S: f64 = 1e-9;
/// Most frames that are used: more would not move the clock by a microsecond.
const MOST_FRAMES: usize = 20_000;

impl Aligned {
    /// Starts from the first turn of the head in both, then least squares over the frames that both show: neither a camera's origin nor its
    /// clock is the model's.
    pub fn of(measured: &Recording, model: &Recording) -> Self {
        let turn = |recording: &Recording| Instants::find(recording).time_s(Anchor::Reversal, 1).ok();
        let turns = turn(measured).zip(turn(model));
        let mut shift_s = turns.map_or_else(|| nearest_s(measured, model), |(measured, model)| measured - model);
        let mut along_m = 0.0;
        for _ in 0..STEPS {
            let Some((step_s, mean_m)) = step(measured, model, shift_s) else { break };
            shift_s += step_s;
            along_m = mean_m;
            if step_s.abs() < LEAST_STEP_S {
                break;
            }
        }
        Self { shift_s, along_m, drop_m: drop_m(measured, model, shift_s) }
    }
}

/// Of the places of the recording along the model's run, the one where the head's path is most like the model's: for a recording without a turn.
fn nearest_s(measured: &Recording, model: &Recording) -> f64 {
    const PLACES: u32 = 200;
    const FRAMES: usize = 100;
    let end_s = |recording: &Recording| recording.grid().time_s(recording.grid().frames.saturating_sub(1));
    let ends = [measured.grid().start_s - model.grid().start_s, end_s(measured) - end_s(model)];
    let frames: Vec<usize> = used(measured).step_by(used(measured).count().div_ceil(FRAMES).max(1)).collect();
    let spread = |shift_s: f64| {
        let apart = |i: &usize| {
            let t = measured.grid().time_s(*i) - shift_s;
            Some((*measured.traces().head_x_m.get(*i)?)? - between(model, &model.traces().head_x_m, t)?)
        };
        let all: Vec<f64> = frames.iter().filter_map(apart).collect();
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        (2 * all.len() > frames.len()).then(|| all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / all.len() as f64)
    };
    let places = (0..=PLACES).map(|k| ends[0] + (ends[1] - ends[0]) * f64::from(k) / f64::from(PLACES));
    let best = places.filter_map(|shift_s| Some((shift_s, spread(shift_s)?))).min_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or(0.0, |(shift_s, _)| shift_s)
}

/// The frames that are used.
fn used(recording: &Recording) -> impl Iterator<Item = usize> {
    let frames = recording.grid().frames;
    (0..frames).step_by(frames.div_ceil(MOST_FRAMES).max(1))
}

/// One step of Gauss and Newton for a time and a mean distance of the heads.
fn step(measured: &Recording, model: &Recording, shift_s: f64) -> Option<(f64, f64)> {
    let (grid, frame_s) = (measured.grid(), 1.0 / model.grid().frame_rate_hz);
    let head = |t: f64| between(model, &model.traces().head_x_m, t);
    let point = |i: usize| {
        let t = grid.time_s(i) - shift_s;
        let speed = (head(t + frame_s)? - head(t - frame_s)?) / (2.0 * frame_s);
        Some((speed, (*measured.traces().head_x_m.get(i)?)? - head(t)?))
    };
    let points: Vec<(f64, f64)> = used(measured).filter_map(point).collect();
    let count = points.len() as f64;
    let mean = points.iter().fold((0.0, 0.0), |sum, p| (sum.0 + p.0 / count, sum.1 + p.1 / count));
    let (spread, both) = points.iter().fold((0.0, 0.0), |sum, p| (sum.0 + (p.0 - mean.0).powi(2), sum.1 + (p.0 - mean.0) * (p.1 - mean.1)));
    // a later model is a head that lags by its speed times the time
    let step_s = if spread > 0.0 { -both / spread } else { 0.0 };
    (count > 0.0).then_some((step_s, mean.1 + step_s * mean.0))
}

fn drop_m(measured: &Recording, model: &Recording, shift_s: f64) -> f64 {
    let grid = measured.grid();
    let difference = |i: usize| Some(between(model, &model.traces().head_y_m, grid.time_s(i) - shift_s)? - (*measured.traces().head_y_m.get(i)?)?);
    let all: Vec<f64> = used(measured).filter_map(difference).collect();
    if all.is_empty() { 0.0 } else { all.iter().sum::<f64>() / all.len() as f64 }
}

/// A column of a recording at a time, on a straight line between two frames; `None` beyond its frames and beside a missing one.
pub(super) fn between(recording: &Recording, column: &[Option<f64>], time_s: f64) -> Option<f64> {
    /// Rounding of a time, frames.
    const ON_FRAME: f64 = 1e-6;
    let grid = recording.grid();
    let place = (time_s - grid.start_s) * grid.frame_rate_hz;
    let nearest = place.round();
    if nearest < 0.0 || nearest >= column.len() as f64 {
        return None;
    }
    if (place - nearest).abs() < ON_FRAME {
        return *column.get(nearest as usize)?;
    }
    let before = (place >= 0.0).then_some(place.floor() as usize)?;
    let (low, high) = ((*column.get(before)?)?, (*column.get(before + 1)?)?);
    Some(low + (place - before as f64) * (high - low))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{FrameGrid, Traces};

    fn recording(start_s: f64, frames: usize, origin_m: f64, of: impl Fn(f64) -> f64) -> Recording {
        let grid = FrameGrid { start_s, frame_rate_hz: 5000.0, frames };
        let column = |sign: f64| (0..frames).map(|i| Some(origin_m + sign * of(grid.time_s(i)))).collect::<Vec<_>>();
        let traces = Traces { tip_x_m: column(1.0), tip_y_m: vec![None; frames], head_x_m: column(1.0), head_y_m: column(-1.0), ..Traces::default() };
        Recording::new("r", grid, traces, true).unwrap()
    }

    #[test]
    fn the_clock_and_the_origin_are_found_to_a_share_of_a_frame() {
        let head = |t: f64| 0.05 * (1.0 - (6.0 * t).cos());
        let (model, measured) = (recording(0.3, 3000, 0.0, head), recording(0.0, 2000, 1e-3, |t| head(t + 0.40007)));
        let found = Aligned::of(&measured, &model);
        assert!((found.shift_s + 0.40007).abs() < 1e-7, "{found:?}");
        assert!((found.along_m - 1e-3).abs() < 1e-7 && (found.drop_m + 1e-3).abs() < 1e-7, "{found:?}");
    }

    #[test]
    fn a_part_without_a_turn_is_found_in_the_run() {
        let head = |t: f64| 0.05 * (1.0 - (6.0 * t).cos());
        let (model, measured) = (recording(0.1, 4000, 0.0, head), recording(0.0, 600, 1e-3, |t| head(t + 0.20007)));
        let found = Aligned::of(&measured, &model);
        assert!((found.shift_s + 0.20007).abs() < 1e-6 && (found.along_m - 1e-3).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn nothing_is_read_beyond_the_frames_or_beside_a_missing_one() {
        let line = recording(1.0, 10, 0.0, |t| t);
        let mut column = line.traces().head_x_m.clone();
        column[5] = None;
        let at = |frames: f64| between(&line, &column, 1.0 + frames / 5000.0);
        assert!((at(2.25).unwrap() - (1.0 + 2.25 / 5000.0)).abs() < 1e-12 && at(9.0).is_some() && at(0.0).is_some());
        assert_eq!([at(-0.3), at(9.2), at(4.5), at(5.0), at(5.5)], [None; 5]);
    }
}
