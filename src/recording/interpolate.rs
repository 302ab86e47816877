//! A column between its frames: on the polynomial through six of them, which is low by 0.8 % half way between
//! frames of 5,000/s that show 900 Hz, where a straight line is low by 16 %.

use super::Recording;

/// Frames that the polynomial runs through.
pub(crate) const STENCIL: usize = 6;
/// A place this close to a frame, in frames, is the frame: well above the rounding of times near 1 s at 1e5
/// frames/s.
pub(crate) const ON_FRAME_TOLERANCE: f64 = 1e-6;

impl Recording {
    /// A column of this recording at a time, s: on the polynomial through three frames before and three
    /// after, and on a straight line where one of the outer four is missing. `None` beyond the frames and
    /// next to a missing one.
    #[must_use]
    pub fn interpolate_column(&self, column: &[Option<f64>], time_s: f64) -> Option<f64> {
        let place = (time_s - self.grid.start_s) * self.grid.frame_rate_hz;
        if let Some(frame) = frame_at(place) {
            return *column.get(frame)?;
        }
        let before = (place >= 0.0).then_some(place.floor() as usize)?;
        let (low, high) = ((*column.get(before)?)?, (*column.get(before + 1)?)?);
        let straight = || low + (place - before as f64) * (high - low);
        let curved =
            before.checked_sub(STENCIL / 2 - 1).and_then(|first| lagrange_through_six(column, first, place));
        Some(curved.unwrap_or_else(straight))
    }
}

/// The frame on which a place, in frames, falls, if it does; the column may be shorter.
pub(crate) fn frame_at(place: f64) -> Option<usize> {
    let nearest = place.round();
    (nearest >= 0.0 && (place - nearest).abs() < ON_FRAME_TOLERANCE).then_some(nearest as usize)
}

/// Lagrange's polynomial through the six frames from `first` on, at a place in frames; `None` where one of
/// them is missing.
pub(crate) fn lagrange_through_six(column: &[Option<f64>], first: usize, place: f64) -> Option<f64> {
    /// Products of the distances of each frame from the others.
    const APART: [f64; STENCIL] = [-120.0, 24.0, -12.0, 12.0, -24.0, 120.0];
    let place = place - first as f64;
    let mut sum = 0.0;
    for (i, (frame, apart)) in column.get(first..first + STENCIL)?.iter().zip(APART).enumerate() {
        let weight: f64 = (0..STENCIL).filter(|j| *j != i).map(|j| place - j as f64).product();
        sum += (*frame)? * weight / apart;
    }
    Some(sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{FrameGrid, Traces};

    fn recording(start_s: f64, of: impl Fn(f64) -> f64) -> Recording {
        let grid = FrameGrid { start_s, frame_rate_hz: 5000.0, frames: 10 };
        let column = (0..grid.frames).map(|i| Some(of(grid.time_s(i)))).collect();
        let missing = || vec![None; grid.frames];
        let traces = Traces {
            tip_x_m: missing(),
            tip_y_m: missing(),
            head_x_m: column,
            head_y_m: missing(),
            ..Traces::default()
        };
        Recording::new("r", grid, traces, true).unwrap()
    }

    #[test]
    fn a_fast_sine_keeps_its_height_and_a_polynomial_is_exact() {
        let quintic = |t: f64| 1.0 + 3e2 * t - 2e6 * t * t + 4e14 * t.powi(5);
        let at = |recording: &Recording, frames: f64| {
            recording.interpolate_column(&recording.traces().head_x_m, frames / 5000.0).unwrap()
        };
        let curve = recording(0.0, quintic);
        for place in [2.25, 4.5, 6.999] {
            let exact = quintic(place / 5000.0);
            assert!((at(&curve, place) / exact - 1.0).abs() < 1e-13, "{place}");
        }
        // half way between two frames that stand as far from the crest on either side
        let crest = |t: f64| (std::f64::consts::TAU * 900.0 * (t - 4.5 / 5000.0)).cos();
        let sine = recording(0.0, crest);
        assert!((at(&sine, 4.5) - 0.991_64).abs() < 1e-5, "{}", at(&sine, 4.5));
        let mut cut = sine.traces().head_x_m.clone();
        cut[2] = None;
        let straight = sine.interpolate_column(&cut, 4.5 / 5000.0).unwrap();
        assert!((straight - 0.844_33).abs() < 1e-5, "{straight}");
    }

    #[test]
    fn nothing_is_read_beyond_the_frames_or_next_to_a_missing_one() {
        let line = recording(1.0, |t| t);
        let mut column = line.traces().head_x_m.clone();
        column[5] = None;
        let at = |frames: f64| line.interpolate_column(&column, 1.0 + frames / 5000.0);
        assert!(
            (at(2.25).unwrap() - (1.0 + 2.25 / 5000.0)).abs() < 1e-12
                && at(9.0).is_some()
                && at(0.0).is_some()
        );
        assert_eq!([at(-0.3), at(9.2), at(4.5), at(5.0), at(5.5)], [None; 5]);
    }
}
