//! Missing frames of a column.

/// Numbers and lengths of the runs of consecutive missing frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct FrameGaps {
    pub missing: usize,
    pub runs: usize,
    /// Length of the longest run, frames.
    pub longest: usize,
    pub longest_from: usize,
    /// Greatest common divisor of the distances between present frames: n if every n-th frame was tracked, 0
    /// if fewer than two frames are present.
    pub stride: usize,
}

impl FrameGaps {
    pub(crate) fn count_gaps(present: impl Iterator<Item = bool>) -> Self {
        let (mut gaps, mut run, mut last) = (Self::default(), 0, None);
        for (frame, present) in present.enumerate() {
            if present {
                gaps.stride = last.map_or(0, |last| greatest_common_divisor(gaps.stride, frame - last));
                last = Some(frame);
            }
            run = if present { 0 } else { run + 1 };
            gaps.missing += usize::from(!present);
            gaps.runs += usize::from(run == 1);
            if run > gaps.longest {
                (gaps.longest, gaps.longest_from) = (run, frame + 1 - run);
            }
        }
        gaps
    }
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stride_is_what_all_distances_between_frames_present_share() {
        let stride =
            |present: &[usize]| FrameGaps::count_gaps((0..100).map(|frame| present.contains(&frame))).stride;
        assert_eq!([stride(&[]), stride(&[3]), stride(&[3, 4, 90])], [0, 0, 1]);
        assert_eq!([stride(&[1, 38, 75]), stride(&[0, 6, 15, 99]), stride(&[2, 4, 8])], [37, 3, 2]);
    }

    #[test]
    fn gaps_at_both_ends_and_the_first_of_equal_ones_count() {
        let present = [false, true, false, false, true, true, false, false];
        assert_eq!(
            FrameGaps::count_gaps(present.into_iter()),
            FrameGaps { missing: 5, runs: 3, longest: 2, longest_from: 2, stride: 1 }
        );
        assert_eq!(
            FrameGaps::count_gaps([true; 3].into_iter()),
            FrameGaps { stride: 1, ..FrameGaps::default() }
        );
    }
}
