//! Frames that a camera or an export has lost, found where the head jumps. The head moves smoothly, so lines
//! through the frames on the two sides of a loss are apart by speed times lost time.

use crate::recording::{FrameGrid, Recording, Traces};

/// Number of frames of a line.
const LINE: usize = 12;
/// Smallest jump that counts, in its standard deviations. A recording has thousands of frames.
const CLEAR_SD: f64 = 7.0;
/// Number of frames next to a loss, on either side, that are left out, because its place is found to a frame.
const UNSURE: usize = 2;
/// Maximum number of losses; more jumps than this are no lost frames.
const MAX_GAPS: usize = 12;

/// Frames that are missing after the frame `after`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FrameGap {
    pub after: usize,
    pub count: usize,
}

/// Value and slope at place 0 of a line through values at places 0, 1, ..., and the mean square of the
/// residuals; `None` if half of the values are missing.
fn fit_line(values: impl Iterator<Item = Option<f64>>) -> Option<[f64; 3]> {
    let points: Vec<(f64, f64)> = values.enumerate().filter_map(|(k, x)| Some((k as f64, x?))).collect();
    let count = points.len() as f64;
    if points.len() < LINE / 2 {
        return None;
    }
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (place, value) = (mean(&|p| p.0), mean(&|p| p.1));
    let spread = mean(&|p| (p.0 - place) * (p.0 - place));
    let slope = mean(&|p| (p.0 - place) * (p.1 - value)) / spread;
    let start = value - slope * place;
    let square = mean(&|p| (p.1 - start - slope * p.0) * (p.1 - start - slope * p.0));
    Some([start, slope, square * count / (count - 2.0)])
}

/// Losses of frames that the motion of the head shows, in order of time.
pub(super) fn find_lost_frames(recording: &Recording) -> Vec<FrameGap> {
    /// Variance of the distance of the two lines, half a frame beyond each end, in units of the noise.
    const LINES_VARIANCE: f64 = 2.0 * 4.0 / LINE as f64;
    let head = &recording.traces().head_x_m;
    // standard deviations of the jump after each frame, and number of lost frames
    let jump = |after: usize| -> Option<(f64, f64)> {
        let before = fit_line(head[after + 1 - LINE..=after].iter().rev().copied())?;
        let behind = fit_line(head[after + 1..after + 1 + LINE].iter().copied())?;
        let per_frame = 0.5 * (behind[1] - before[1]);
        let apart = behind[0] - before[0] - per_frame;
        let sd = (0.5 * (before[2] + behind[2]) * LINES_VARIANCE).sqrt();
        Some((apart.abs() / sd, apart / per_frame))
    };
    let last = head.len().saturating_sub(LINE);
    let all: Vec<(usize, f64, f64)> = (LINE..last)
        .filter_map(|after| jump(after).map(|(sds, frames)| (after, sds, frames)))
        .filter(|(_, sds, frames)| *sds > CLEAR_SD && frames.round() >= 1.0)
        .collect();
    let is_peak = |(after, sds, _): &&(usize, f64, f64)| {
        all.iter().all(|(other, theirs, _)| other.abs_diff(*after) > LINE || theirs <= sds)
    };
    let found: Vec<FrameGap> = (all.iter().filter(is_peak))
        .map(|(after, _, frames)| FrameGap { after: *after, count: frames.round() as usize })
        .collect();
    if found.len() > MAX_GAPS { Vec::new() } else { found }
}

/// The recording with empty frames in place of those that are missing; `None` if it would have too few
/// frames.
pub(super) fn insert_lost_frames(recording: &Recording, gaps: &[FrameGap]) -> Option<Recording> {
    let open = |column: &Vec<Option<f64>>| {
        let mut opened = Vec::with_capacity(column.len());
        for (frame, value) in column.iter().enumerate() {
            let is_sure = |gap: &FrameGap| frame + UNSURE <= gap.after || frame > gap.after + UNSURE;
            opened.push(value.filter(|_| gaps.iter().all(is_sure)));
            let lost = gaps.iter().filter(|gap| gap.after == frame).map(|gap| gap.count).sum();
            opened.extend(std::iter::repeat_n(None, lost));
        }
        opened
    };
    let traces = recording.traces();
    let opened = Traces {
        tip_x_m: open(&traces.tip_x_m),
        tip_y_m: open(&traces.tip_y_m),
        head_x_m: open(&traces.head_x_m),
        head_y_m: open(&traces.head_y_m),
        tip_confidence: None,
        head_confidence: None,
    };
    let grid = FrameGrid { frames: opened.tip_x_m.len(), ..recording.grid() };
    Recording::new(recording.name(), grid, opened, recording.is_synthetic()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Head that moves by a parabola, with alternating errors of 1 um.
    fn recording(frames: impl Iterator<Item = usize>) -> Recording {
        let place = |i: usize| {
            4e-5 * i as f64 - 1e-8 * (i * i) as f64 + if i.is_multiple_of(2) { 1e-6 } else { -1e-6 }
        };
        let head_x_m: Vec<Option<f64>> = frames.map(|i| Some(place(i))).collect();
        let frames = head_x_m.len();
        let grid = FrameGrid { start_s: 0.0, frame_rate_hz: 5000.0, frames };
        let none = vec![None; frames];
        let (tip_x_m, tip_y_m, head_y_m) = (none.clone(), none.clone(), none);
        let traces = Traces { tip_x_m, tip_y_m, head_x_m, head_y_m, ..Traces::default() };
        Recording::new("head", grid, traces, true).unwrap()
    }

    #[test]
    fn lost_frames_are_found_and_inserted() {
        assert_eq!(find_lost_frames(&recording(0..600)), []);
        let closed_up = recording((0..200).chain(207..400).chain(402..600));
        let gaps = [FrameGap { after: 199, count: 7 }, FrameGap { after: 392, count: 2 }];
        assert_eq!(find_lost_frames(&closed_up), gaps);
        let (opened, whole) = (insert_lost_frames(&closed_up, &gaps).unwrap(), recording(0..600));
        assert_eq!(opened.grid(), whole.grid());
        let pairs = || opened.traces().head_x_m.iter().zip(&whole.traces().head_x_m);
        assert!(pairs().all(|(opened, whole)| opened.is_none() || opened == whole));
        assert_eq!(pairs().filter(|(opened, _)| opened.is_none()).count(), 9 + 2 * (2 * UNSURE));
    }
}
