//! Labels of single pictures: somebody picked frames of a video, and the rows are no motion.

use crate::import::reader::findings::new_finding;
use crate::import::reader::track_file::Clock;
use crate::recording::quality::{Check, QualityFinding, Severity};
use std::collections::BTreeMap;

const PICKED_FRAMES_ADVICE: &str = "import the positions that the program finds in every frame of the video, not the labels \
    it is trained with";

/// What to say of rows whose frames follow each other in no common step.
pub(crate) fn picked_frames_finding(file: &str, clock: &Clock) -> Option<QualityFinding> {
    let frames: Vec<f64> = clock.frame.as_ref()?.iter().flatten().collect();
    let (first, last) = (*frames.first()?, *frames.last()?);
    let mut steps: BTreeMap<i64, usize> = BTreeMap::new();
    frames.windows(2).for_each(|pair| *steps.entry((pair[1] - pair[0]) as i64).or_default() += 1);
    // (of several as common the smallest: a gap among consecutive frames is a gap)
    let (usual, count) =
        steps.iter().rev().max_by_key(|step| *step.1).map(|(step, count)| (*step, *count))?;
    let of_all = 2 * count;
    let is_series = of_all > frames.len() - 1 || (usual == 1 && of_all == frames.len() - 1);
    let found = format!(
        "{file}: the rows are {} pictures picked from the frames {first} to {last} in no common step: they are \
         no time series, and no spectrum, transition or fit of them has a meaning",
        frames.len()
    );
    (!is_series).then(|| {
        new_finding(
            Check::PickedFrames,
            Severity::Serious,
            (frames.len() as f64, "frames"),
            found,
            PICKED_FRAMES_ADVICE,
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_picked(frames: &[f64]) -> bool {
        let clock = Clock { frame: Some(frames.iter().copied().map(Some).collect()), ..Clock::default() };
        picked_frames_finding("a.csv", &clock).is_some()
    }

    #[test]
    fn frames_in_no_common_step_are_picked() {
        for series in
            [&[0.0, 1.0, 2.0][..], &[0.0, 1.0, 3.0], &[3.0, 5.0], &[0.0, 5.0, 10.0, 15.0, 25.0], &[7.0]]
        {
            assert!(!is_picked(series), "{series:?}");
        }
        for labels in [&[1.0, 4.0, 10.0][..], &[0.0, 7.0, 8.0, 31.0, 90.0], &[12.0, 145.0, 301.0, 480.0]] {
            assert!(is_picked(labels), "{labels:?}");
        }
    }
}
