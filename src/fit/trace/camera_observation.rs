//! A recording in the form in which a trace fit uses it.

use crate::model::Linkage;
use crate::recording::Recording;
use crate::recording::channel::median_in_place;
use crate::recording::noise::{AutoregressiveNoise, Whitener};
use crate::recording::quality::CameraTilt;
use crate::simulate::drive::HeadSpline;
use crate::simulate::equilibrium::equilibrium_angles;
use crate::simulate::scene::Drive;
use nalgebra::{DMatrix, SMatrix, SVector};
use portable_math as math;
use std::sync::Arc;

/// Channels and frames of a recording that are fitted, its exposure time and its noise.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservationSettings {
    /// Whether the tip's position along the sweep is fitted.
    pub tip_x: bool,
    /// Whether the head's drop is fitted.
    pub head_drop: bool,
    /// Exposure time of a frame, s.
    pub exposure_s: f64,
    /// Noise of the tip's position along the sweep and of the head's drop, m.
    pub noise: [AutoregressiveNoise; 2],
    /// Index of the first fitted frame, and of the frame after the last fitted frame.
    pub frames: [usize; 2],
}

/// Data of a recording, frame by frame.
#[derive(Debug, Clone)]
pub struct CameraObservation {
    /// Times of the frames, s.
    pub times_s: Vec<f64>,
    pub rate_hz: f64,
    /// Position of the tip along the sweep, m; `None` where the tip is lost or not fitted.
    pub tip_x_m: Vec<Option<f64>>,
    /// Drop of the head, m; `None` where the head is lost or not fitted.
    pub drop_m: Vec<Option<f64>>,
    /// Position of the head along the sweep in every frame, as given by the drive, m.
    pub head_m: Vec<f64>,
    /// Position of the head along the sweep as it was tracked, m.
    pub seen_head_m: Vec<Option<f64>>,
    /// Whether the recorded head drives the model. If so, `head_m` is in lengths as measured in the picture,
    /// which include its scale error; otherwise it is in true lengths.
    pub own_head: bool,
    /// The smooth curve from which `head_m` is taken; `None` if the scene drives the model.
    pub own_curve: Option<Arc<HeadSpline>>,
    /// Mean of `head_m` over the fitted frames, m. A tilt of the camera rotates the picture about this
    /// position.
    pub centre_m: f64,
    /// Angle from the x axis of the picture to the glass, and its standard deviation, rad, measured on the
    /// path of the tip. Both are 0 if the path shows no clear angle.
    pub tilt_rad: [f64; 2],
    /// Distance between the extreme positions of the head in the fitted frames, m.
    pub head_travel_m: f64,
    /// Length of the shortest segments, s: the time scale of the blade.
    pub first_segment_s: f64,
    pub settings: ObservationSettings,
}

/// Maximum number of frames from which the offsets are guessed.
const GUESS_FRAMES: usize = 10_000;
/// Minimum number of frames from which the offsets are guessed: the cubic has four coefficients.
const FEWEST_POINTS: usize = 20;
/// The leans (tip position minus head position) are sorted, and this fraction of them is ignored at each end.
const LEAN_TAIL: f64 = 0.1;

/// Measured lean and drop, m, of the upright blade, for a blade that leans to both sides. `points` are its
/// measured leans and drops; `ends` are its usual leans to the two sides. `None` if there are too few
/// points, or if no cubic can be fitted to the drops.
fn upright_point(points: &[[f64; 2]], ends: [f64; 2]) -> Option<[f64; 2]> {
    /// Width of the range in which the offset is sought, as a fraction of the distance between `ends`. The
    /// range is centred between them.
    const SOUGHT: f64 = 0.5;
    /// Number of offsets that are tried in each round.
    const TRIED: usize = 21;
    /// Ratio of the distance between neighbouring offsets in a round to that in the round before.
    const FINER: f64 = 0.1;
    /// Number of rounds; in the last one, neighbouring offsets differ by 2e-5 of the distance between `ends`.
    const ROUNDS: usize = 4;
    if points.len() < FEWEST_POINTS {
        return None;
    }
    let reach = ends[1] - ends[0];
    let (mut middle, mut width) = (0.5 * (ends[0] + ends[1]), SOUGHT * reach);
    let mut best: Option<(f64, [f64; 2])> = None;
    for _ in 0..ROUNDS {
        let place = |k: usize| middle + width * (k as f64 / (TRIED - 1) as f64 - 0.5);
        let tried = (0..TRIED).filter_map(|k| {
            let (left_over, drop) = fit_drops(points, place(k), reach)?;
            Some((left_over, [place(k), drop]))
        });
        best = best.into_iter().chain(tried).min_by(|a, b| a.0.total_cmp(&b.0));
        middle = best?.1[0];
        width *= FINER;
    }
    best.map(|(_, point)| point)
}

/// Fits a cubic in the squared lean to the drops; leans are counted from `offset_m`. Returns the sum of the
/// squared residuals, m^2, and the drop of the upright blade, m.
fn fit_drops(points: &[[f64; 2]], offset_m: f64, reach_m: f64) -> Option<(f64, f64)> {
    const TERMS: usize = 4;
    let mut normal = SMatrix::<f64, TERMS, TERMS>::zeros();
    let mut right = SVector::<f64, TERMS>::zeros();
    let mut squares = 0.0;
    for [lean, drop] in points {
        let square = math::powi((lean - offset_m) / reach_m, 2);
        let powers = SVector::<f64, TERMS>::from_fn(|k, _| math::powi(square, k as i32));
        normal += powers * powers.transpose();
        right += powers * *drop;
        squares += drop * drop;
    }
    let coefficients = normal.cholesky()?.solve(&right);
    Some((squares - coefficients.dot(&right), coefficients[0]))
}

/// Median difference, m, between the measured drop and the drop of the blade at rest with the same lean. It
/// is the median drop if no blade at rest has such a lean.
fn drop_offset_at_rest(points: &[[f64; 2]], linkage: &Linkage) -> f64 {
    /// Maximum number of points that are compared.
    const COMPARED: usize = 200;
    let apart = points.len().div_ceil(COMPARED).max(1);
    let above = |[lean, drop]: &[f64; 2]| {
        let [theta, phi] = equilibrium_angles(linkage, *lean)?;
        let upright = |length: f64, angle: f64| length * (1.0 - math::cos(angle));
        Some(drop - upright(linkage.l1_m, theta) - upright(linkage.l2_m, phi))
    };
    let mut offsets: Vec<f64> = points.iter().step_by(apart).filter_map(above).collect();
    let mut drops: Vec<f64> = points.iter().map(|[_, drop]| *drop).collect();
    median_in_place(&mut offsets).or_else(|| median_in_place(&mut drops)).unwrap_or(0.0)
}

/// The lowest and the highest value.
fn find_range(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)))
}

impl CameraObservation {
    /// Data of a recording. `drive` moves the head in the model of the recording. `shared` is the noise in
    /// each frame, m, that tip and head have in common, along the sweep and in height; it is subtracted from
    /// the tip's position and from the head's height. `glass` is the glass in the picture.
    pub(crate) fn new(
        recording: &Recording,
        drive: &Drive,
        own_head: bool,
        settings: ObservationSettings,
        shared: &[Option<Vec<Option<f64>>>; 2],
        glass: Option<&CameraTilt>,
        first_segment_s: f64,
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
        let tilt = glass.filter(|tilt| tilt.is_clear());
        let (low_m, high_m) = find_range(&head_m[first..last]);
        Self {
            tip_x_m: data(settings.tip_x, &traces.tip_x_m, &shared[0], 1.0),
            drop_m: data(settings.head_drop, &traces.head_y_m, &shared[1], -1.0),
            seen_head_m: traces.head_x_m.clone(),
            tilt_rad: tilt.map_or([0.0; 2], |tilt| [tilt.angle_rad, tilt.sd_rad]),
            times_s,
            rate_hz: grid.frame_rate_hz,
            head_m,
            own_head,
            own_curve,
            centre_m,
            head_travel_m: high_m - low_m,
            first_segment_s,
            settings,
        }
    }

    /// Initial guesses, m, of the offsets of the tip's position and of the head's drop.
    ///
    /// The drop of a blade is smallest where the blade is upright, and it is a function of the square of the
    /// lean. If the blade leans to both sides, the offset along the sweep is the one with which a cubic in
    /// this square fits the drops best. If it leans to one side only, nothing shows where it is upright. Then
    /// the offset along the sweep is 0 or, if the head is not tracked, the median lean; the drop is that of
    /// the blade at rest with the remaining lean.
    pub(super) fn guess_offsets_m(&self, tilt_rad: f64, linkage: &Linkage) -> [f64; 2] {
        let [first, last] = self.settings.frames;
        let apart = (last - first).div_ceil(GUESS_FRAMES).max(1);
        // in a tilted picture, a recorded head appears beside the tip under it
        let beside_m = if self.own_head { linkage.upright_height_m() * math::sin(tilt_rad) } else { 0.0 };
        let lean = |i: usize| Some(self.tip_x_m[i]? - self.head_m[i] - beside_m);
        let level = |i: usize| Some(self.drop_m[i]? + tilt_rad * (self.head_m[i] - self.centre_m));
        let frames = || (first..last).step_by(apart);
        let mut leans: Vec<f64> = frames().filter_map(lean).collect();
        leans.sort_by(f64::total_cmp);
        let at = |share: f64| leans.get((share * leans.len() as f64) as usize).copied().unwrap_or(0.0);
        let (low, high) = (at(LEAN_TAIL), at(1.0 - LEAN_TAIL));
        // (if the offset is larger than the lean, all measured leans have the same sign, although the blade
        // leans to both sides)
        let both_sides = (low < 0.0 && high > 0.0) || self.reverses();
        let points: Vec<[f64; 2]> = frames().filter_map(|i| Some([lean(i)?, level(i)?])).collect();
        let along = match both_sides {
            true => 0.5 * (low + high),
            false if self.own_head => 0.0,
            false => at(0.5),
        };
        let upright = if both_sides { upright_point(&points, [low, high]) } else { None };
        upright.unwrap_or_else(|| {
            let leans: Vec<[f64; 2]> = points.iter().map(|[lean, drop]| [lean - along, *drop]).collect();
            [along, drop_offset_at_rest(&leans, linkage)]
        })
    }

    /// Whether the head reverses its motion within the fitted frames, so that the blade leans to both sides.
    fn reverses(&self) -> bool {
        /// The blade leans to the other side if `beyond`, divided by the distance between the extreme
        /// positions of the head, exceeds this value.
        const LEAST: f64 = 0.05;
        let [first, last] = self.settings.frames;
        let heads = &self.head_m[first..last];
        let (low, high) = find_range(heads);
        let [Some(start), Some(end)] = [heads.first(), heads.last()] else { return false };
        // distance by which the head moves outside the range between its first and last position
        let beyond = (high - start.max(*end)).max(start.min(*end) - low);
        beyond > LEAST * (high - low)
    }

    /// Time of a frame relative to the middle of the fitted frames, s.
    pub(super) fn after_middle_s(&self, frame: usize) -> f64 {
        let [first, last] = self.settings.frames;
        self.times_s[frame] - 0.5 * (self.times_s[first] + self.times_s[last - 1])
    }

    /// Time from the start of a run to the middle of its first frame's exposure, s: half the exposure time.
    pub(crate) fn lead_s(&self) -> f64 {
        0.5 * self.settings.exposure_s
    }

    /// Number of measured values in the frames from `first` up to but not including `last`.
    pub(super) fn count_data(&self, first: usize, last: usize) -> usize {
        let present = |column: &[Option<f64>]| column[first..last].iter().flatten().count();
        present(&self.tip_x_m) + present(&self.drop_m)
    }

    /// Indices of the frames of a segment in which the tip is measured, and of those in which the drop is
    /// measured.
    pub(super) fn data_frames(&self, [first, last]: [usize; 2]) -> [Vec<usize>; 2] {
        [&self.tip_x_m, &self.drop_m].map(|column| (first..last).filter(|&i| column[i].is_some()).collect())
    }

    /// The linear map that turns the residuals of a segment, m, into uncorrelated residuals of unit variance.
    pub(super) fn segment_whitening(&self, segment: [usize; 2]) -> SegmentWhitening {
        let frames = self.data_frames(segment);
        let maps = [0, 1].map(|k| {
            let noise = &self.settings.noise[k];
            if noise.coefficients().is_empty() {
                ChannelWhitening::Scale(1.0 / noise.sd())
            } else {
                ChannelWhitening::Full(Whitener::new(noise, &frames[k]))
            }
        });
        SegmentWhitening { tips: frames[0].len(), maps }
    }

    /// Derivatives of the whitened data of a segment with respect to the coefficients of the curve through
    /// the recorded head positions. Returns the index of the first coefficient with an effect, and one column
    /// per coefficient. `None` if the scene drives the head.
    pub(super) fn head_curve_derivatives(&self, [first, last]: [usize; 2]) -> Option<(usize, DMatrix<f64>)> {
        let curve = self.own_curve.as_ref()?;
        let from = curve.position_weights(first).0;
        let (to, weights) = curve.position_weights(last - 1);
        let mut columns = DMatrix::zeros(self.count_data(first, last), to + weights.len() - from);
        for (row, frame) in self.data_frames([first, last])[0].iter().enumerate() {
            let (at, weights) = curve.position_weights(*frame);
            weights.iter().enumerate().for_each(|(k, weight)| columns[(row, at - from + k)] = *weight);
        }
        self.segment_whitening([first, last]).whiten_columns(&mut columns);
        Some((from, columns))
    }
}

/// The linear map that turns the residuals of a segment, m, into uncorrelated residuals of unit variance.
pub(super) struct SegmentWhitening {
    tips: usize,
    maps: [ChannelWhitening; 2],
}

enum ChannelWhitening {
    Scale(f64),
    Full(Whitener),
}

impl SegmentWhitening {
    /// Whitens a column of residuals, m: first those of the tip, frame by frame, then those of the drop.
    pub(super) fn whiten_column(&self, column: &mut [f64]) {
        let (tip, drop) = column.split_at_mut(self.tips);
        for (map, part) in self.maps.iter().zip([tip, drop]) {
            match map {
                ChannelWhitening::Scale(per_sd) => part.iter_mut().for_each(|x| *x *= per_sd),
                ChannelWhitening::Full(whitener) => whitener.whiten_column(part),
            }
        }
    }

    /// Whitens every column of a matrix.
    pub(super) fn whiten_columns(&self, matrix: &mut DMatrix<f64>) {
        let rows = matrix.nrows().max(1);
        matrix.as_mut_slice().chunks_mut(rows).for_each(|column| self.whiten_column(column));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{FrameGrid, Traces};
    use crate::simulate::drive::smooth_head_motion;

    /// Recording of a tip that trails its head by 1 mm, whichever way the head moves. The camera adds
    /// `offset_m` to the position of the tip; `stroke` is the position of the head as a function of time.
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
        CameraObservation::new(&recording, &drive, true, settings, &[None, None], None, 0.004)
    }

    fn linkage() -> Linkage {
        let text = include_str!("../../../data/scenes/actual-blade.toml");
        crate::simulate::scene::Scene::parse("actual-blade.toml", text).unwrap().linkage
    }

    /// A blade leans farther to one side than to the other, because friction depends on speed. Its drop
    /// depends only on the square of its lean.
    #[test]
    fn a_blade_that_leans_unequally_far_to_both_sides_shows_where_it_is_upright() {
        let ends = [-1.1e-3, 1.7e-3];
        for (offset_m, zero_m) in [(0.0, 0.0), (2.8e-4, 4e-3), (-1.3e-4, -0.1)] {
            let lean = |k: usize| ends[0] + (ends[1] - ends[0]) * k as f64 / 499.0;
            let drop = |lean: f64| 40.0 * lean * lean + 3e6 * math::powi(lean, 4) + zero_m;
            let points: Vec<[f64; 2]> = (0..500).map(|k| [lean(k) + offset_m, drop(lean(k))]).collect();
            let found = upright_point(&points, ends.map(|end| end + offset_m)).unwrap();
            assert!((found[0] - offset_m).abs() < 1e-7 && (found[1] - zero_m).abs() < 1e-9, "{found:?}");
        }
    }

    #[test]
    fn a_marker_that_is_farther_off_than_the_blade_leans_is_found_where_the_head_turns() {
        let there_and_back = |t: f64| 0.05 * (1.0 - (6.0 * (t + 0.1)).cos());
        for offset_m in [0.0, 3e-4, -1.5e-3, 4e-3] {
            let [found, _] = film(offset_m, there_and_back).guess_offsets_m(0.0, &linkage());
            assert!((found - offset_m).abs() < 1e-5, "{found} {offset_m}");
        }
        // if the head moves only one way, nothing shows how far the blade leans to the other side
        assert_eq!(film(1.5e-3, |t| 0.05 * t).guess_offsets_m(0.0, &linkage()), [0.0, 0.0]);
    }
}
