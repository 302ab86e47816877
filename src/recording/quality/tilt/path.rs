//! The path of the tip, stroke by stroke.

use crate::recording::Recording;
use crate::recording::channel::ReversalInstants;

/// Most frames looked at, every n-th of a longer recording: they give the angle far better than it matters.
const MOST_FRAMES: usize = 100_000;
/// Share of the places of a stroke at either end that do not count for its travel, so that outliers do not.
const TRIMMED: f64 = 0.01;

/// The tip in a frame that has both its coordinates.
#[derive(Debug, Clone, Copy)]
pub(super) struct TipPoint {
    /// Its number among the frames that are looked at.
    pub frame: usize,
    /// Stroke that it belongs to: the number of turns before it.
    pub stroke: usize,
    pub x_m: f64,
    pub y_m: f64,
}

/// The path of the tip.
pub(super) struct TipPath {
    /// In order of frames.
    pub points: Vec<TipPoint>,
    pub strokes: usize,
}

impl TipPath {
    pub(super) fn from_recording(recording: &Recording, instants: &ReversalInstants) -> Self {
        let (grid, traces) = (recording.grid(), recording.traces());
        let turns_s: Vec<f64> = instants.reversals.iter().map(|turn| turn.reversal_s).collect();
        let mut stroke = 0;
        let apart = grid.frames.div_ceil(MOST_FRAMES).max(1);
        let both = traces.tip_x_m.iter().zip(&traces.tip_y_m).step_by(apart).enumerate();
        let points = both.filter_map(|(frame, (x, y))| {
            while turns_s.get(stroke).is_some_and(|turn_s| *turn_s <= grid.time_s(apart * frame)) {
                stroke += 1;
            }
            Some(TipPoint { frame, stroke, x_m: (*x)?, y_m: (*y)? })
        });
        Self { points: points.collect(), strokes: turns_s.len() + 1 }
    }

    /// The points for which `kept` holds.
    pub(super) fn select_points(&self, kept: &[bool]) -> Self {
        let points = self.points.iter().zip(kept).filter(|(_, kept)| **kept).map(|(point, _)| *point);
        Self { points: points.collect(), strokes: self.strokes }
    }

    /// The points of each stroke that has any.
    pub(super) fn points_by_stroke(&self) -> impl Iterator<Item = &[TipPoint]> {
        self.points.chunk_by(|a, b| a.stroke == b.stroke)
    }

    /// Longest travel within a stroke, m, without the outermost places.
    pub(super) fn travel_m(&self) -> f64 {
        self.points_by_stroke().map(stroke_travel_m).fold(0.0, f64::max)
    }
}

fn stroke_travel_m(stroke: &[TipPoint]) -> f64 {
    let mut places: Vec<f64> = stroke.iter().map(|point| point.x_m).collect();
    places.sort_unstable_by(f64::total_cmp);
    let trimmed = (TRIMMED * places.len() as f64) as usize;
    match (places.get(trimmed), places.get(places.len().saturating_sub(1 + trimmed))) {
        (Some(low), Some(high)) => high - low,
        _ => 0.0,
    }
}
