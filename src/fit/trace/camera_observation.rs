//! A recording as data of a trace fit.

use crate::recording::Recording;
use crate::recording::noise_model::{AutoregressiveNoise, Whitener};
use crate::simulate::drive::HeadSpline;
use crate::simulate::scene::Drive;
use nalgebra::DMatrix;
use std::sync::Arc;

/// What of a recording is fitted, and what is known of its camera.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservationSettings {
    /// Whether the tip's place along the sweep is data.
    pub tip_x: bool,
    /// Whether the head's drop is data.
    pub head_drop: bool,
    /// Time for which the shutter is open, s.
    pub exposure_s: f64,
    /// Noise of the tip's x and of the head's y, m.
    pub noise: [AutoregressiveNoise; 2],
    /// Frames that are fitted, from the first to before the second.
    pub frames: [usize; 2],
}

/// A recording as data: places on its frame grid.
#[derive(Debug, Clone)]
pub struct CameraObservation {
    /// Instants of the frames, s.
    pub times_s: Vec<f64>,
    pub rate_hz: f64,
    /// The tip along the sweep, m; empty cells where it is lost or no data.
    pub tip_x_m: Vec<Option<f64>>,
    /// The head's drop, m, likewise.
    pub drop_m: Vec<Option<f64>>,
    /// Where the drive has the head, in the picture, m.
    pub head_m: Vec<f64>,
    /// Whether that is the recording's own head; else it is the scene's, in true lengths.
    pub own_head: bool,
    /// The curve behind `head_m` where that is the recording's own.
    pub own_curve: Option<Arc<HeadSpline>>,
    /// Mean of `head_m`, about which a tilt turns, m.
    pub centre_m: f64,
    pub settings: ObservationSettings,
}

impl CameraObservation {
    /// The frames of a recording; `drive` is the head's motion on which its model runs, `shared` what the
    /// other point shows of the noise of the tip's x and of the head's y, m.
    pub(crate) fn new(
        recording: &Recording,
        drive: &Drive,
        own_head: bool,
        settings: ObservationSettings,
        shared: &[Option<Vec<Option<f64>>>; 2],
    ) -> Self {
        let (grid, traces) = (recording.grid(), recording.traces());
        let times_s: Vec<f64> = (0..grid.frames).map(|i| grid.time_s(i)).collect();
        let head_m: Vec<f64> = times_s.iter().map(|&t| drive.motion_at(t).position_m).collect();
        let [first, last] = settings.frames;
        let centre_m = head_m[first..last].iter().sum::<f64>() / (last - first) as f64;
        let data = |wanted: bool, column: &[Option<f64>], shared: &Option<Vec<Option<f64>>>, sign: f64| {
            let noise = |i: usize| shared.as_ref().and_then(|shared| shared[i]).unwrap_or(0.0);
            let cell = |(i, x): (usize, &Option<f64>)| x.filter(|_| wanted).map(|x| sign * (x - noise(i)));
            column.iter().enumerate().map(cell).collect::<Vec<Option<f64>>>()
        };
        let own_curve = match drive {
            Drive::Recorded(spline) if own_head => Some(Arc::clone(spline)),
            _ => None,
        };
        Self {
            tip_x_m: data(settings.tip_x, &traces.tip_x_m, &shared[0], 1.0),
            drop_m: data(settings.head_drop, &traces.head_y_m, &shared[1], -1.0),
            times_s,
            rate_hz: grid.frame_rate_hz,
            head_m,
            own_head,
            own_curve,
            centre_m,
            settings,
        }
    }

    /// First guesses of the offsets along the sweep and of the drop, m: a blade leans as far to one side as
    /// to the other, and its head is highest where it is upright.
    pub(super) fn guess_offsets_m(&self, tilt_rad: f64) -> [f64; 2] {
        /// Share of the frames left out at the ends of a distribution.
        const TAIL: f64 = 0.1;
        /// Share of the frames around the upright blade.
        const UPRIGHT: f64 = 0.005;
        let [first, last] = self.settings.frames;
        let sorted = |mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values
        };
        let at = |values: &[f64], share: f64| {
            values.get((share * values.len() as f64) as usize).copied().unwrap_or(0.0)
        };
        let leans = sorted((first..last).filter_map(|i| Some(self.tip_x_m[i]? - self.head_m[i])).collect());
        let level = |i: usize| Some(self.drop_m[i]? + tilt_rad * (self.head_m[i] - self.centre_m));
        let drops = sorted((first..last).filter_map(level).collect());
        let [low, high] = [at(&leans, TAIL), at(&leans, 1.0 - TAIL)];
        // (a marker that is farther off than the blade leans shows one side alone)
        let both_sides = (low < 0.0 && high > 0.0) || self.reverses();
        let middle = if both_sides { 0.5 * (low + high) } else { 0.0 };
        let upright =
            if drops.is_empty() { 0.0 } else { at(&drops, UPRIGHT) + 2.0 * self.settings.noise[1].sd() };
        [middle, if both_sides { upright } else { 0.0 }]
    }

    /// Whether the head moves one way in part of the frames and the other way in another part, so that the
    /// blade has leaned to both sides.
    fn reverses(&self) -> bool {
        /// Least share of the head's way that counts: a blade follows within a few millimetres of a stroke.
        const LEAST: f64 = 0.05;
        let [first, last] = self.settings.frames;
        let heads = &self.head_m[first..last];
        let (low, high) =
            heads.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
        let [Some(start), Some(end)] = [heads.first(), heads.last()] else { return false };
        // the way there and back exceeds what lies between the ends by twice the return
        let beyond = (high - start.max(*end)).max(start.min(*end) - low);
        beyond > LEAST * (high - low)
    }

    /// Time of a frame after the middle of those that are fitted, s.
    pub(super) fn after_middle_s(&self, frame: usize) -> f64 {
        let [first, last] = self.settings.frames;
        self.times_s[frame] - 0.5 * (self.times_s[first] + self.times_s[last - 1])
    }

    /// Half the time for which the shutter is open, s: a run starts this long before its first frame.
    pub(super) fn lead_s(&self) -> f64 {
        0.5 * self.settings.exposure_s
    }

    /// Number of data in frames `first` to before `last`.
    pub(super) fn count_data(&self, first: usize, last: usize) -> usize {
        let present = |column: &[Option<f64>]| column[first..last].iter().flatten().count();
        present(&self.tip_x_m) + present(&self.drop_m)
    }

    /// Frames of a segment with data: of the tip, of the drop.
    pub(super) fn data_frames(&self, first: usize, last: usize) -> [Vec<usize>; 2] {
        [&self.tip_x_m, &self.drop_m].map(|column| (first..last).filter(|&i| column[i].is_some()).collect())
    }

    /// What turns residuals of a segment, in metres, into ones of unit variance without correlation.
    pub(super) fn segment_whitening(&self, first: usize, last: usize) -> SegmentWhitening {
        let frames = self.data_frames(first, last);
        let noise = &self.settings.noise;
        let maps = [0, 1].map(|k| {
            let is_white = noise[k].coefficients().is_empty();
            if is_white {
                ChannelWhitening::Scale(1.0 / noise[k].sd())
            } else {
                ChannelWhitening::Full(Whitener::new(&noise[k], &frames[k]))
            }
        });
        SegmentWhitening { tips: frames[0].len(), maps }
    }

    /// How a segment's data, whitened, depend on the coefficients of the head's own curve: the first that
    /// counts, and a column each; `None` where the head is not the recording's.
    pub(super) fn head_curve_derivatives(&self, first: usize, last: usize) -> Option<(usize, DMatrix<f64>)> {
        let curve = self.own_curve.as_ref()?;
        let from = curve.position_weights(first).0;
        let (to, weights) = curve.position_weights(last - 1);
        let mut columns = DMatrix::zeros(self.count_data(first, last), to + weights.len() - from);
        for (row, frame) in self.data_frames(first, last)[0].iter().enumerate() {
            let (at, weights) = curve.position_weights(*frame);
            weights.iter().enumerate().for_each(|(k, weight)| columns[(row, at - from + k)] = *weight);
        }
        let whitening = self.segment_whitening(first, last);
        let rows = columns.nrows().max(1);
        columns.as_mut_slice().chunks_mut(rows).for_each(|column| whitening.whiten_column(column));
        Some((from, columns))
    }
}

/// The map of a segment's residuals to white ones.
pub(super) struct SegmentWhitening {
    tips: usize,
    maps: [ChannelWhitening; 2],
}

enum ChannelWhitening {
    Scale(f64),
    Full(Whitener),
}

impl SegmentWhitening {
    /// Whitens a column: the tip's frames, then the drop's.
    pub(crate) fn whiten_column(&self, column: &mut [f64]) {
        let (tip, drop) = column.split_at_mut(self.tips);
        self.maps[0].whiten_column(tip);
        self.maps[1].whiten_column(drop);
    }
}

impl ChannelWhitening {
    fn whiten_column(&self, part: &mut [f64]) {
        match self {
            Self::Scale(per_sd) => part.iter_mut().for_each(|x| *x *= per_sd),
            Self::Full(whitener) => whitener.whiten_column(part),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{FrameGrid, Traces};
    use crate::simulate::drive::smooth_head_motion;

    /// A tip that trails a head by 1 mm there and back, in view of a camera that adds `offset_m` to the tip.
    fn film(offset_m: f64, stroke: impl Fn(f64) -> f64) -> CameraObservation {
        let grid = FrameGrid { start_s: 0.0, frame_rate_hz: 1000.0, frames: 1000 };
        let place = |i: usize| stroke(i as f64 / 1000.0);
        let trailing = |i: usize| place(i) - 1e-3 * (place(i + 1) - place(i)).signum() + offset_m;
        let column = |of: &dyn Fn(usize) -> f64| (0..grid.frames).map(|i| Some(of(i))).collect::<Vec<_>>();
        let traces = Traces {
            tip_x_m: column(&trailing),
            tip_y_m: vec![None; grid.frames],
            head_x_m: column(&place),
            head_y_m: vec![None; grid.frames],
            ..Traces::default()
        };
        let recording = Recording::new("film", grid, traces, true).unwrap();
        let drive = Drive::Recorded(Arc::new(smooth_head_motion(&recording).unwrap()));
        let white = || AutoregressiveNoise::white(1e-6).unwrap();
        let noise = [white(), white()];
        let settings = ObservationSettings {
            tip_x: true,
            head_drop: false,
            exposure_s: 0.0,
            noise,
            frames: [0, grid.frames],
        };
        CameraObservation::new(&recording, &drive, true, settings, &[None, None])
    }

    #[test]
    fn a_marker_that_is_farther_off_than_the_blade_leans_is_found_where_the_head_turns() {
        let there_and_back = |t: f64| 0.05 * (1.0 - (6.0 * (t + 0.1)).cos());
        for offset_m in [0.0, 3e-4, -1.5e-3, 4e-3] {
            let [found, _] = film(offset_m, there_and_back).guess_offsets_m(0.0);
            assert!((found - offset_m).abs() < 1e-5, "{found} {offset_m}");
        }
        // of a head that moves one way nothing says how far a blade leans to the other side
        assert_eq!(film(1.5e-3, |t| 0.05 * t).guess_offsets_m(0.0), [0.0, 0.0]);
    }
}
