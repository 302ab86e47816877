//! Where the head turns.

use super::tracked::{TrackPoints, median_filter, value_range};

/// Least return of the head after a turn, m: one pixel of the usual 20 um, so that jitter of a resting head
/// is none.
pub(super) const LEAST_RETURN_M: f64 = 20e-6;
/// Least return in units of the tracking noise: two extremes of white noise in 1e5 frames are about 9 apart.
const RETURN_NOISES: f64 = 12.0;
/// Least return as a share of the head's whole travel, so that vibration of the drive is no turn.
const RETURN_TRAVEL: f64 = 0.005;
/// Turns are timed by a parabola through the frames within this many returns of the extremum.
const FIT_RETURNS: f64 = 4.0;

/// A turn of the head: its frame (a real number) and the frames of the parabola that timed it.
pub(super) struct HeadTurn {
    pub frame: f64,
    pub first: usize,
    pub last: usize,
}

/// Extrema from which the head returns by more than noise, jitter and vibration do.
pub(super) fn find_turns(head: &TrackPoints) -> Vec<HeadTurn> {
    let smooth = median_filter(&head.points);
    let (low, high) = value_range(&smooth);
    let least = LEAST_RETURN_M.max(RETURN_NOISES * head.noise_m).max(RETURN_TRAVEL * (high - low));
    alternating_extrema(&smooth, least)
        .into_iter()
        .map(|index| time_extremum(head, &smooth, index, FIT_RETURNS * least))
        .collect()
}

/// Indices of alternating maxima and minima, each followed by a return of at least `least` and preceded by an
/// approach of as much.
fn alternating_extrema(values: &[f64], least: f64) -> Vec<usize> {
    let Some(first) = values.first() else { return Vec::new() };
    let (mut top, mut bottom) = ((0, *first), (0, *first));
    let mut rising = None;
    let mut found = Vec::new();
    for (index, &x) in values.iter().enumerate() {
        if x > top.1 {
            top = (index, x);
        }
        if x < bottom.1 {
            bottom = (index, x);
        }
        if rising != Some(false) && top.1 - x >= least {
            if rising == Some(true) {
                found.push(top.0);
            }
            (rising, bottom) = (Some(false), (index, x));
        } else if rising != Some(true) && x - bottom.1 >= least {
            if rising == Some(false) {
                found.push(bottom.0);
            }
            (rising, top) = (Some(true), (index, x));
        }
    }
    found
}

/// Times an extremum by the vertex of a parabola through the frames within `reach_m` of it.
fn time_extremum(head: &TrackPoints, smooth: &[f64], index: usize, reach_m: f64) -> HeadTurn {
    let near = |i: &usize| (smooth[*i] - smooth[index]).abs() <= reach_m;
    let first = (0..=index).rev().take_while(near).last().unwrap_or(index);
    let last = (index..smooth.len()).take_while(near).last().unwrap_or(index);
    let points = &head.points[first..=last];
    let (start, end) = (head.points[first].0, head.points[last].0);
    let plain = HeadTurn { frame: head.points[index].0 as f64, first: start, last: end };
    match parabola_vertex(points) {
        Some(frame) if frame >= start as f64 && frame <= end as f64 => HeadTurn { frame, ..plain },
        _ => plain,
    }
}

/// Frame of the vertex of the least-squares parabola through the points.
fn parabola_vertex(points: &[(usize, f64)]) -> Option<f64> {
    let (first, last) = (points.first()?.0 as f64, points.last()?.0 as f64);
    let (centre, half) = ((first + last) / 2.0, (last - first) / 2.0);
    if points.len() < 5 || half <= 0.0 {
        return None;
    }
    let mut normal = nalgebra::Matrix3::zeros();
    let mut right = nalgebra::Vector3::zeros();
    for (frame, x) in points {
        let s = (*frame as f64 - centre) / half;
        let row = nalgebra::Vector3::new(1.0, s, s * s);
        normal += row * row.transpose();
        right += row * *x;
    }
    let fit = normal.cholesky()?.solve(&right);
    let s = -fit[1] / (2.0 * fit[2]);
    s.is_finite().then_some(centre + half * s)
}
