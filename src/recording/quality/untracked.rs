//! Positions that no tracker found in the picture: what each check finds, with counts and frames, and how
//! such positions are left out.

use super::filled::find_filled_frames;
use super::finding::{Check, QualityFinding, Severity};
use super::measurement::{ChannelQuality, Optics, Quality, measured_columns};
use super::outliers::outlier_frames;
use crate::recording::noise::noise_floor;
use crate::recording::{Recording, Traces};
use std::ops::Range;

/// Confidence below which a position is doubtful: the default cut-off of DeepLabCut (`pcutoff`).
const LOW_CONFIDENCE: f64 = 0.6;
/// Number of frames up to which a finding is a note: a few single samples change no spectrum.
const FEW_FRAMES: usize = 3;
/// Fraction of untracked frames of a point from which the finding is a caution: each such frame raises the
/// noise of a spectrum.
const MANY_FRAMES: f64 = 1e-3;
/// Fraction of doubtful positions of a point from which the finding is a caution: these are more than stray
/// outliers.
const MANY_DOUBTFUL: f64 = 0.01;
/// Fraction of untracked frames of a point above which the finding is serious: amplitudes and frequencies are
/// then wrong.
const MOST_FRAMES: f64 = 0.05;
/// Fraction of repeated frames above which the finding is serious: repeated frames also shift the times of
/// all later frames.
const MOST_REPEATED: f64 = 0.01;
/// Fraction of untracked frames of a point above which no lag is reported: filled positions are themselves a
/// few frames off, and not all of them are found.
const NO_LAG: f64 = 0.2;
/// Maximum number of runs whose frames are listed in a finding.
const NAMED_RUNS: usize = 4;

/// Frames in which a check found that a position was not tracked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UntrackedFrames {
    /// The check that found the frames.
    pub check: Check,
    /// The point (`tip`, `head`) or its column (`tip-x`, ...); empty if both points are concerned.
    pub channel: &'static str,
    /// Runs of consecutive frames, in order and apart from each other.
    pub runs: Vec<Range<usize>>,
}

impl UntrackedFrames {
    /// Untracked frames that a check found. `runs` are in order; runs that touch or overlap are joined.
    pub(super) fn new(
        check: Check,
        channel: &'static str,
        runs: impl IntoIterator<Item = Range<usize>>,
    ) -> Self {
        Self { check, channel, runs: join_runs(runs) }
    }

    /// The number of frames.
    #[must_use]
    pub fn count(&self) -> usize {
        self.runs.iter().map(Range::len).sum()
    }

    /// Number of frames, point and check in words.
    pub(crate) fn describe(&self) -> String {
        let point = if self.channel.is_empty() { "both points" } else { self.channel };
        format!("{} frames of {point} ({})", self.count(), self.check.name())
    }

    /// Whether a position of the point `name` is concerned.
    pub(super) fn concerns(&self, name: &str) -> bool {
        self.channel.is_empty() || self.channel.starts_with(name)
    }

    /// The finding on these frames; `tracked` is the number of frames in which the point has a position.
    fn to_finding(&self, tracked: usize) -> QualityFinding {
        let (what, why) = match self.check {
            Check::FrozenFrames => ("repeat the one before exactly", "frames of the video were doubled"),
            Check::HeldPoints => ("repeat the last position exactly", "the tracker lost the point"),
            Check::InterpolatedPoints => ("lie on exact lines between others", "gaps were filled by lines"),
            Check::LowConfidence => ("have a confidence below 0.6", "the tracker doubts these positions"),
            _ => ("lie far from their neighbours", "the tracker jumped away and came back"),
        };
        let (many, most, remedy) = match self.check {
            Check::FrozenFrames => (MANY_FRAMES, MOST_REPEATED, "track the file that the camera wrote"),
            Check::LowConfidence => (MANY_DOUBTFUL, MOST_FRAMES, "import again with --min-likelihood 0.6"),
            _ => (MANY_FRAMES, MOST_FRAMES, "track these frames again, or import with --drop-untracked"),
        };
        let (count, advice) = (self.count(), format!("{why}: {remedy}"));
        let share = count as f64 / tracked.max(1) as f64;
        let severity = match share {
            share if count <= FEW_FRAMES || share < many => Severity::Note,
            share if share <= most => Severity::Caution,
            _ => Severity::Serious,
        };
        let named = self.runs.iter().take(NAMED_RUNS).map(|run| match run.len() {
            1 => run.start.to_string(),
            _ => format!("{} to {}", run.start, run.end - 1),
        });
        let more = self.runs.len().saturating_sub(NAMED_RUNS);
        let more = if more > 0 {
            format!(" and {more} more run{}", if more == 1 { "" } else { "s" })
        } else {
            String::new()
        };
        let words = format!(
            "{count} of {tracked} frames ({:.1} %) {what}: frames {}{more}",
            100.0 * share,
            named.collect::<Vec<_>>().join(", ")
        );
        let found = QualityFinding::advise((self.check, severity), (count as f64, "frames"), words, advice);
        if self.channel.is_empty() { found } else { found.on_channel(self.channel) }
    }
}

/// Joins runs that touch or overlap. The runs must be in order.
pub(super) fn join_runs(runs: impl IntoIterator<Item = Range<usize>>) -> Vec<Range<usize>> {
    let mut joined: Vec<Range<usize>> = vec![];
    for run in runs {
        match joined.last_mut().filter(|last| last.end >= run.start) {
            Some(last) => last.end = last.end.max(run.end),
            None => joined.push(run),
        }
    }
    joined
}

/// Frames in which a position was written but not tracked, one entry per check and point. `measured` is the
/// result of [`super::measure_quality`] for the same recording.
#[must_use]
pub fn find_untracked_frames(
    recording: &Recording,
    measured: &Quality,
    optics: &Optics,
) -> Vec<UntrackedFrames> {
    let traces = recording.traces();
    let columns = measured_columns(traces, measured);
    let mut found = find_filled_frames(&columns);
    found.retain(|filled| !filled.runs.is_empty());
    // (positions that a program filled in make the noise too small)
    let rest = if found.is_empty() { None } else { Some(drop_untracked(traces.clone(), &found)) };
    for (index, column) in columns.iter().enumerate() {
        let tracked = rest.as_ref().and_then(|rest| rest.columns().nth(index));
        let noise_m = tracked.map_or(column.quality.noise_m, |(_, samples)| noise_floor(samples));
        let quality = ChannelQuality { noise_m, ..column.quality.clone() };
        let frames = outlier_frames(column.samples, &quality, optics.metres_per_pixel);
        let frames = frames.into_iter().map(|i| i..i + 1);
        let mut outliers = UntrackedFrames::new(Check::Outliers, column.name, frames);
        // (the jump after a run of repeats leads back to the true position)
        let held = |f: &&UntrackedFrames| f.check == Check::HeldPoints && column.name.starts_with(f.channel);
        for UntrackedFrames { runs, .. } in found.iter().filter(held) {
            outliers.runs.retain(|run| runs.binary_search_by_key(&run.start, |held| held.end).is_err());
        }
        found.push(outliers);
    }
    let tip = ("tip", &traces.tip_confidence, &traces.tip_x_m);
    for (name, confidence, x) in [tip, ("head", &traces.head_confidence, &traces.head_x_m)] {
        let Some(confidence) = confidence else { continue };
        let doubtful = |&i: &usize| x[i].is_some() && confidence[i].is_some_and(|p| p < LOW_CONFIDENCE);
        let frames = (0..x.len()).filter(doubtful).map(|i| i..i + 1);
        found.push(UntrackedFrames::new(Check::LowConfidence, name, frames));
    }
    found.retain(|untracked| !untracked.runs.is_empty());
    found
}

/// Whether a point was not tracked in so many of its frames that a lag of its track is not reliable.
pub(super) fn are_many(found: &[UntrackedFrames], frames: usize) -> bool {
    // (outliers of x and y may be the same frames)
    let of_point = |point| {
        let filled = found.iter().filter(|f| f.concerns(point) && f.check != Check::Outliers);
        filled.map(UntrackedFrames::count).sum::<usize>()
    };
    ["tip", "head"].into_iter().any(|point| of_point(point) as f64 > NO_LAG * frames as f64)
}

/// Findings on frames, within the range `frames`, in which a position was written but not tracked.
pub(super) fn describe_untracked(
    traces: &Traces,
    found: &[UntrackedFrames],
    frames: &Range<usize>,
) -> Vec<QualityFinding> {
    let Traces { tip_x_m, head_x_m, .. } = traces;
    let of = |untracked: &UntrackedFrames| {
        let clip = |run: &Range<usize>| run.start.max(frames.start)..run.end.min(frames.end);
        let runs = untracked.runs.iter().map(clip).filter(|run| !run.is_empty()).collect();
        let within = UntrackedFrames { runs, ..*untracked };
        let x = if untracked.concerns("tip") { tip_x_m } else { head_x_m };
        let tracked = x.get(frames.clone()).into_iter().flatten().flatten().count();
        (!within.runs.is_empty()).then(|| within.to_finding(tracked))
    };
    found.iter().filter_map(of).collect()
}

/// The traces without the positions that nobody tracked: both coordinates of the point are missing there.
#[must_use]
pub fn drop_untracked(mut traces: Traces, untracked: &[UntrackedFrames]) -> Traces {
    let Traces { tip_x_m, tip_y_m, head_x_m, head_y_m, .. } = &mut traces;
    for (name, columns) in [("tip", [tip_x_m, tip_y_m]), ("head", [head_x_m, head_y_m])] {
        for column in columns {
            for run in untracked.iter().filter(|found| found.concerns(name)).flat_map(|found| &found.runs) {
                column[run.clone()].fill(None);
            }
        }
    }
    traces
}
