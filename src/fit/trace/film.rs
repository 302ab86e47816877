//! A recording as data of a trace fit.

use crate::recording::Recording;
use crate::recording::noise_model::{Ar, Whitener};
use crate::simulate::scene::Drive;

/// What of a recording is fitted, and what is known of its camera.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmSettings {
    /// Whether the tip's place along the sweep is data.
    pub tip_x: bool,
    /// Whether the head's drop is data.
    pub head_drop: bool,
    /// Time for which the shutter is open, s.
    pub exposure_s: f64,
    /// Noise of the tip's x and of the head's y, m.
    pub noise: [Ar; 2],
    /// Frames that are fitted, from the first to before the second.
    pub frames: [usize; 2],
}

/// A recording as data: places on its frame grid.
#[derive(Debug, Clone)]
pub struct Film {
    /// Instants of the frames, s.
    pub times_s: Vec<f64>,
    /// Frames a second.
    pub rate_hz: f64,
    /// The tip along the sweep, m; empty cells where it is lost or no data.
    pub tip_x_m: Vec<Option<f64>>,
    /// The head's drop, m, likewise.
    pub drop_m: Vec<Option<f64>>,
    /// Where the drive has the head, in the picture, m.
    pub head_m: Vec<f64>,
    /// Whether that is the recording's own head; else it is the scene's, in true lengths.
    pub own_head: bool,
    /// Standard deviation of `head_m`, m, and the time over which its error stays alike, s.
    pub head_error: [f64; 2],
    /// Mean of `head_m`, about which a tilt turns, m.
    pub centre_m: f64,
    /// What is fitted.
    pub settings: FilmSettings,
}

impl Film {
    /// The frames of a recording; `drive` is the head's motion on which its model runs, `shared` what the
    /// other point shows of the noise of the tip's x and of the head's y, m.
    #[must_use]
    pub fn new(
        recording: &Recording,
        drive: &Drive,
        own_head: bool,
        settings: FilmSettings,
        shared: &[Option<Vec<Option<f64>>>; 2],
    ) -> Self {
        let (grid, traces) = (recording.grid(), recording.traces());
        let times_s: Vec<f64> = (0..grid.frames).map(|i| grid.time_s(i)).collect();
        let head_m: Vec<f64> = times_s.iter().map(|&t| drive.at(t).position_m).collect();
        let [first, last] = settings.frames;
        let centre_m = head_m[first..last].iter().sum::<f64>() / (last - first) as f64;
        let data = |wanted: bool, column: &[Option<f64>], shared: &Option<Vec<Option<f64>>>, sign: f64| {
            let noise = |i: usize| shared.as_ref().and_then(|shared| shared[i]).unwrap_or(0.0);
            let cell = |(i, x): (usize, &Option<f64>)| x.filter(|_| wanted).map(|x| sign * (x - noise(i)));
            column.iter().enumerate().map(cell).collect::<Vec<Option<f64>>>()
        };
        let head_error = match drive {
            Drive::Recorded(spline) if own_head => spline.error(),
            _ => [0.0; 2],
        };
        Self {
            tip_x_m: data(settings.tip_x, &traces.tip_x_m, &shared[0], 1.0),
            drop_m: data(settings.head_drop, &traces.head_y_m, &shared[1], -1.0),
            times_s,
            rate_hz: grid.frame_rate_hz,
            head_m,
            own_head,
            head_error,
            centre_m,
            settings,
        }
    }

    /// First guesses of the offsets along the sweep and of the drop, m: a blade leans as far to one side as
    /// to the other, and its head is highest where it is upright.
    pub(super) fn offsets(&self, tilt_rad: f64) -> [f64; 2] {
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
        let both_sides = low < 0.0 && high > 0.0;
        let middle = if both_sides { 0.5 * (low + high) } else { 0.0 };
        let upright =
            if drops.is_empty() { 0.0 } else { at(&drops, UPRIGHT) + 2.0 * self.settings.noise[1].sd() };
        [middle, if both_sides { upright } else { 0.0 }]
    }

    /// Half the time for which the shutter is open, s: a run starts this long before its first frame.
    pub(super) fn lead_s(&self) -> f64 {
        0.5 * self.settings.exposure_s
    }

    /// Number of data in frames `first` to before `last`.
    pub(super) fn count(&self, first: usize, last: usize) -> usize {
        let present = |column: &[Option<f64>]| column[first..last].iter().flatten().count();
        present(&self.tip_x_m) + present(&self.drop_m)
    }

    /// Frames of a segment with data: of the tip, of the drop.
    pub(super) fn frames(&self, first: usize, last: usize) -> [Vec<usize>; 2] {
        [&self.tip_x_m, &self.drop_m].map(|column| (first..last).filter(|&i| column[i].is_some()).collect())
    }

    /// What turns residuals of a segment, in metres, into ones of unit variance without correlation.
    pub(super) fn whitening(&self, first: usize, last: usize) -> Whitening {
        let frames = self.frames(first, last);
        let noise = &self.settings.noise;
        let maps = [0, 1].map(|k| {
            let is_white = noise[k].coefficients().is_empty();
            if is_white {
                Map::Scale(1.0 / noise[k].sd())
            } else {
                Map::Full(Whitener::new(&noise[k], &frames[k]))
            }
        });
        let mut whitening = Whitening { tips: frames[0].len(), maps, shared: Vec::new(), share: 0.0 };
        whitening.lift(self.head_variance(first, last));
        whitening
    }

    /// Variance of the head's place that is common to the frames of a segment, m2: more where its error stays
    /// alike for longer than the segment, because neighbours then share it.
    fn head_variance(&self, first: usize, last: usize) -> f64 {
        let [sd_m, alike_s] = self.head_error;
        let length_s = (last - first) as f64 / self.rate_hz;
        sd_m * sd_m * (alike_s / length_s).max(1.0)
    }
}

/// The map of a segment's residuals to white ones.
pub(super) struct Whitening {
    tips: usize,
    maps: [Map; 2],
    /// What an error of the head does to the tip's frames, in units of its standard deviation, whitened.
    shared: Vec<f64>,
    /// Share of that pattern that is taken out.
    share: f64,
}

enum Map {
    Scale(f64),
    Full(Whitener),
}

impl Whitening {
    /// Takes an error that all of the tip's frames share into account: the covariance of what is whitened so
    /// far is `I + u u^T`, of which `I - share u u^T` is the inverse root.
    fn lift(&mut self, variance: f64) {
        let mut shared = vec![variance.sqrt(); self.tips];
        self.maps[0].apply(&mut shared);
        let size: f64 = shared.iter().map(|x| x * x).sum();
        if size > 0.0 {
            (self.shared, self.share) = (shared, (1.0 - 1.0 / (1.0 + size).sqrt()) / size);
        }
    }

    /// Whitens a column: the tip's frames, then the drop's.
    pub fn apply(&self, column: &mut [f64]) {
        let (tip, drop) = column.split_at_mut(self.tips);
        self.maps[0].apply(tip);
        self.maps[1].apply(drop);
        if self.share > 0.0 {
            let along: f64 = tip.iter().zip(&self.shared).map(|(x, u)| x * u).sum();
            tip.iter_mut().zip(&self.shared).for_each(|(x, u)| *x -= self.share * along * u);
        }
    }
}

impl Map {
    fn apply(&self, part: &mut [f64]) {
        match self {
            Self::Scale(per_sd) => part.iter_mut().for_each(|x| *x *= per_sd),
            Self::Full(whitener) => whitener.apply(part),
        }
    }
}
