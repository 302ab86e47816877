//! Findings about the quality of the data that can be made only while the exported file is read: rounded
//! times, lost points, doubtful units.

use super::column::CoordinateUnit;
use super::rate::{FrameRate, find_quantum_s};
use super::track_file::Clock;
use crate::import::options::CoordinateScale;
use crate::recording::clock::OFF_GRID_LIMIT_FRAMES;
use crate::recording::quality::{Check, FrameGaps, QualityFinding, Severity};
use crate::text::format_rate;
use std::collections::BTreeMap;

/// Minimum number of consecutive frames at exactly (0, 0) for a finding about a lost point. In a single
/// frame, the point may really be at the origin.
const ZERO_RUN: usize = 3;
/// Value of both coordinates of a lost point, as scripts that use OpenCV often write it. In pixels, (-1, -1)
/// is outside the picture, so a single frame is enough for a finding.
const OUTSIDE_PICTURE: f64 = -1.0;
/// Coordinates above this number may be pixels if their declared unit is a millimetre or larger. A view that
/// resolves the lip of a wiper is rarely wider than 100 mm, and a picture is hardly ever narrower than 100
/// pixels.
const PIXEL_LIKE_LIMIT: f64 = 100.0;
/// Largest coordinate of a wiper, m: the longest blades travel about 1.5 m along their arc. Smaller ones are
/// only worth a note, because the unit is declared.
const LARGEST_COORDINATE_M: f64 = 1.5;
/// Smallest declared unit for which [`PIXEL_LIKE_LIMIT`] is used, m. In micrometres, the coordinates of every
/// view exceed the limit.
const MILLIMETRE_M: f64 = 1e-3;
/// Minimum number of coordinates for the conclusion that they are pixels because all are whole numbers.
const FEWEST_WHOLE: usize = 8;
/// Rounding step of the times, in frames, above which the finding is a caution. An error of 0.1 frames shifts
/// the phase of a component at a fifth of the frame rate by 7 degrees.
const COARSE_FRAMES: f64 = 0.1;

/// Finding about times that are rounded to a noticeable fraction of a frame; `implied_hz` is the rate that
/// they imply.
pub(crate) fn rounded_times_finding(file: &str, clock: &Clock, implied_hz: f64) -> Option<QualityFinding> {
    let quantum_s = find_quantum_s(clock).filter(|_| !clock.times().is_empty())?;
    let frames = quantum_s * implied_hz;
    // the rounding changes nothing if a frame lasts a whole number of rounding steps
    let even = (1.0 / frames - (1.0 / frames).round()).abs() <= 1e-6 && frames <= 1.0 + 1e-6;
    let severity = if frames > COARSE_FRAMES { Severity::Caution } else { Severity::Note };
    let found = format!("{file}: the times are rounded to {quantum_s} s, {frames:.2} of a frame");
    let advice = "the frames are taken from the grid of the rate, so nothing is lost; export frame numbers or \
        more digits if the rate is in doubt";
    (!even && frames > OFF_GRID_LIMIT_FRAMES / 100.0)
        .then(|| QualityFinding::advise((Check::RoundedTimes, severity), (quantum_s, "s"), found, advice))
}

/// Finding about the frame rate `implied_hz` that the times imply. `playback` says whether the times are
/// playback times.
pub(crate) fn implied_rate_finding(file: &str, implied_hz: f64, playback: bool) -> QualityFinding {
    let meaning = if playback { "taken as playback: the times only count frames" } else { "as declared" };
    let found = format!("{file}: the times imply {implied_hz:.6} rows/s ({meaning})");
    QualityFinding::advise((Check::ImpliedRate, Severity::Note), (implied_hz, "1/s"), found, "")
}

/// Finding about two statements of the frame rate that differ by more than their errors.
pub(crate) fn rate_difference(used: &FrameRate, other: &FrameRate) -> Option<QualityFinding> {
    let difference = used.difference(other);
    let found = format!(
        "{} says {} frames/s, but {}: {} frames/s. They differ by {:.2} %; a wrong rate changes every frequency by as much",
        used.source,
        used.describe(),
        other.source,
        other.describe(),
        100.0 * difference
    );
    let advice = "find out from the camera which is right, and give it as --frame-rate-hz";
    let value = (other.hz, "1/s");
    (difference > used.error + other.error)
        .then(|| QualityFinding::advise((Check::ImpliedRate, Severity::Caution), value, found, advice))
}

/// Finding about times that lie on no grid and are ignored, because the file also has frame numbers.
pub(crate) fn ignored_times_finding(file: &str) -> QualityFinding {
    let found = format!("{file}: the times follow no even rate, but its frame numbers place the rows");
    let advice = "if the camera has no even rate, name the column of times alone (--columns time=...)";
    QualityFinding::advise((Check::UnevenClock, Severity::Caution), (0.0, ""), found, advice)
}

/// Largest allowed relative error of a frame rate without a finding. A larger error shifts the frequencies
/// visibly in figures.
const COARSE_RATE: f64 = 0.01;

/// Finding about times with so few digits that the frame rate from them has a large error.
pub(crate) fn coarse_rate_finding(rate: &FrameRate) -> Option<QualityFinding> {
    let found = format!(
        "{} imply {} frames/s: their steps have so few digits that the rate, and with it every frequency, is \
         known to {:.1} % only",
        rate.source,
        format_rate(rate.hz),
        100.0 * rate.error
    );
    let advice = "give the rate of the camera as --frame-rate-hz, or export more digits";
    let value = (rate.hz * rate.error, "1/s");
    (rate.error > COARSE_RATE)
        .then(|| QualityFinding::advise((Check::ImpliedRate, Severity::Caution), value, found, advice))
}

/// Finding about times that are declared as seconds but look like frame numbers.
pub(crate) fn counted_frames_finding(implied: &FrameRate) -> QualityFinding {
    let found = format!(
        "the times imply {} frames/s: they look like frame numbers, not seconds",
        format_rate(implied.hz)
    );
    let advice = "if they are, say --time frames and give --frame-rate-hz";
    QualityFinding::advise((Check::ImpliedRate, Severity::Serious), (implied.hz, "1/s"), found, advice)
}

/// Finding about coordinates in pixels that `--scale` takes for lengths.
pub(crate) fn unit_mismatch_finding(
    scale: CoordinateScale,
    unit: CoordinateUnit,
    why: &str,
) -> QualityFinding {
    let (declared, stated) = (scale.describe(), unit.describe());
    let found = format!("--scale takes the coordinates for {declared}, but they are {stated} ({why})");
    let advice = "--scale counts; leave it out or correct it unless the coordinates were converted since";
    QualityFinding::advise((Check::Unit, Severity::Caution), (scale.metres(), "m"), found, advice)
}

/// Finding about a direction of y in `--y-axis` that differs from the one that the file or its format states.
pub(crate) fn y_axis_mismatch_finding(declared: &str, stated: &str, why: &str) -> QualityFinding {
    let found = format!("--y-axis says {declared}, but y points {stated} ({why})");
    let advice = "--y-axis counts; leave it out unless the picture or the coordinates were turned over";
    QualityFinding::advise((Check::YAxis, Severity::Caution), (0.0, ""), found, advice)
}

/// Findings about consecutive frames with a point at exactly (0, 0) or (-1, -1), and about coordinates that
/// look like pixels but are declared as lengths. `x` and `y` have one value per frame, in the unit of the
/// file.
pub(crate) fn position_findings(
    name: &str,
    x: &[Option<f64>],
    y: &[Option<f64>],
    scale: CoordinateScale,
) -> Vec<QualityFinding> {
    let mut findings = vec![];
    let in_pixels = matches!(scale, CoordinateScale::MetresPerPixel(_));
    for (check, value, fewest) in [
        (Check::ZeroRun, 0.0, ZERO_RUN),
        (Check::MinusOneRun, OUTSIDE_PICTURE, if in_pixels { 1 } else { ZERO_RUN }),
    ] {
        let is_at = |place: &Option<f64>| *place == Some(value);
        let runs = FrameGaps::count_gaps(x.iter().zip(y).map(|(x, y)| !(is_at(x) && is_at(y))));
        let (frame, run) = (runs.longest_from, runs.longest);
        if run >= fewest {
            let found = format!(
                "{name}: {run} frames in a row from frame {frame} at exactly ({value}, {value}), which often \
                 means a lost point"
            );
            let advice = "if so, have the program export lost points as empty cells";
            findings.push(QualityFinding::advise(
                (check, Severity::Caution),
                (run as f64, "frames"),
                found,
                advice,
            ));
        }
    }
    let (mut count, mut whole, mut largest) = (0, true, 0.0_f64);
    x.iter().chain(y).flatten().for_each(|value| {
        (count, whole, largest) = (count + 1, whole && value.fract() == 0.0, largest.max(value.abs()));
    });
    let whole = whole && count >= FEWEST_WHOLE && largest > 0.0;
    let large = largest > PIXEL_LIKE_LIMIT && scale.metres() >= MILLIMETRE_M;
    if !in_pixels && (whole || large) {
        let sign = if whole {
            "are all whole numbers"
        } else {
            "are larger than lengths in a camera's view usually are"
        };
        let found = format!("{name}: the coordinates {sign} (largest {largest:.6e})");
        let advice = "they look like pixels; if so, give --scale as a length a pixel";
        let possible = !whole && largest * scale.metres() <= LARGEST_COORDINATE_M;
        let severity = if possible { Severity::Note } else { Severity::Caution };
        findings.push(QualityFinding::advise((Check::UnitSuspicion, severity), (largest, ""), found, advice));
    }
    findings
}

/// Finding about positions that were removed because their confidence is below `limit`.
pub(crate) fn rejected_finding(name: &str, count: usize, tracked: usize, limit: f64) -> QualityFinding {
    let share = count as f64 / tracked.max(1) as f64;
    let found = format!(
        "{name}: {count} of {tracked} positions below the confidence {limit} count as missing ({:.1} %)",
        100.0 * share
    );
    QualityFinding::advise((Check::ConfidenceRejected, Severity::Note), (share, ""), found, "")
}

// Tables whose rows are labels of single pictures that were picked from a video.

const PICKED_FRAMES_ADVICE: &str = "import the positions that the program finds in every frame of the video, not the labels \
    it is trained with";

/// Finding about rows that are single pictures picked from a video: their frame numbers increase by no common
/// step.
pub(crate) fn picked_frames_finding(file: &str, clock: &Clock) -> Option<QualityFinding> {
    let frames: Vec<f64> = clock.frame.as_ref()?.iter().flatten().collect();
    let (first, last) = (*frames.first()?, *frames.last()?);
    let mut steps: BTreeMap<i64, usize> = BTreeMap::new();
    frames.windows(2).for_each(|pair| *steps.entry((pair[1] - pair[0]) as i64).or_default() += 1);
    // (of several equally common steps, the smallest is used, because larger steps are gaps)
    let (usual, count) =
        steps.iter().rev().max_by_key(|step| *step.1).map(|(step, count)| (*step, *count))?;
    let of_all = 2 * count;
    let is_series = of_all > frames.len() - 1 || (usual == 1 && of_all == frames.len() - 1);
    let count = frames.len();
    let found = format!(
        "{file}: the rows are {count} pictures picked from the frames {first} to {last} in no common step: they \
         are no time series, and no spectrum, transition or fit of them has a meaning"
    );
    let value = (count as f64, "frames");
    (!is_series).then(|| {
        QualityFinding::advise((Check::PickedFrames, Severity::Serious), value, found, PICKED_FRAMES_ADVICE)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_declared_as_millimetres_are_suspected_whole_or_not() {
        let cautions = |from: f64, step: f64, scale| {
            let x: Vec<Option<f64>> = (0..20).map(|i| Some(from + f64::from(i) * step)).collect();
            position_findings("tip", &x, &[None; 20], scale)
                .iter()
                .filter(|found| found.check == Check::UnitSuspicion && found.severity > Severity::Note)
                .count()
        };
        let millimetres = CoordinateScale::Unit(1e-3);
        assert_eq!(cautions(1511.37, 0.75, millimetres), 1);
        assert_eq!(cautions(3.0, 1.0, millimetres), 1);
        // a stroke of half a metre
        assert_eq!(cautions(451.37, 0.75, millimetres), 0);
        assert_eq!(cautions(20.37, 0.75, millimetres), 0);
        assert_eq!(cautions(5113.7, 7.5, CoordinateScale::Unit(1e-6)), 0);
        assert_eq!(cautions(511.37, 0.75, CoordinateScale::MetresPerPixel(2e-5)), 0);
    }

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
