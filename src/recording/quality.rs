//! Quality of a recording: its rate, gaps and noise, measured on the traces, and findings on these
//! measurements.
//!
//! [`measure_quality`] measures; [`collect_findings`] judges and gives each finding a severity, a number and
//! advice; `verdict_lines` writes measurements and findings as text; [`Quality::component_visibility`] judges
//! whether an oscillation of a single frequency is visible.

mod checks;
mod columns;
mod filled;
mod finding;
mod jumps;
mod lag;
mod measurement;
mod mechanism;
mod motion;
mod outliers;
mod prefilter;
mod regression;
mod smoothing;
mod tilt;
mod untracked;

use super::{FrameGrid, Recording, Traces};
use crate::recording::channel::{Channel, ReversalInstants};
use crate::text::{format_decimals, format_or_dash, to_ascii};
pub(crate) use checks::check_position_steps;
pub use finding::{Check, QualityFinding, Severity};
pub(crate) use measurement::FrameGaps;
pub use measurement::{ChannelQuality, ComponentVisibility, Optics, Quality, Visibility, measure_quality};
use measurement::{FEWEST_CYCLES, NYQUIST_SHARE};
pub(crate) use mechanism::motion_lines;
pub use mechanism::{MotionSummary, check_scene_height, measure_motion};
pub use outliers::outlier_frames;
use serde::Serialize;
use std::ops::Range;
pub use tilt::{CameraTilt, Curvature, TiltNotFound, measure_tilt};
pub use untracked::{UntrackedFrames, drop_untracked, find_untracked_frames};

/// All findings on a recording and on its import, the gravest first. Within a severity, findings that change
/// the meaning of all numbers come first.
///
/// `measured` is the result of [`measure_quality`] for the same recording, and `instants` is the result of
/// [`ReversalInstants::find_instants`].
#[must_use]
pub fn collect_findings(
    recording: &Recording,
    measured: &Quality,
    optics: &Optics,
    instants: &ReversalInstants,
    import: &[QualityFinding],
) -> Vec<QualityFinding> {
    let motion = MeasuredMotion::measure(recording, measured, instants);
    judge_recording(recording, measured, optics, (instants, &motion), import)
}

/// Tilt and motion of a recording, which several findings need.
pub(crate) struct MeasuredMotion {
    pub tilt: Result<CameraTilt, TiltNotFound>,
    pub summary: MotionSummary,
}

impl MeasuredMotion {
    pub(crate) fn measure(recording: &Recording, measured: &Quality, instants: &ReversalInstants) -> Self {
        let tilt = measure_tilt(recording, instants, measured);
        Self { summary: mechanism::summarise_motion(recording, measured, instants, tilt.as_ref().ok()), tilt }
    }
}

/// Like [`collect_findings`], for a recording whose motion has been measured.
#[must_use]
pub(crate) fn judge_recording(
    recording: &Recording,
    measured: &Quality,
    optics: &Optics,
    (instants, known): (&ReversalInstants, &MeasuredMotion),
    import: &[QualityFinding],
) -> Vec<QualityFinding> {
    let exchanges = jumps::find_exchanges(recording, measured);
    let put_back = (!exchanges.is_empty())
        .then(|| change_traces(recording, |traces| jumps::put_back_exchanged(traces, &exchanges)))
        .flatten();
    let own_instants = put_back.as_ref().map(ReversalInstants::find_instants);
    let (recording, instants) =
        (put_back.as_ref().unwrap_or(recording), own_instants.as_ref().unwrap_or(instants));
    // (this check needs the original frames: resampling to a grid changes repeated positions and exact lines)
    let untracked = find_untracked_frames(recording, measured, optics);
    let original = recording.traces();
    let recording = &*recording.resample_to_grid();
    let columns = measurement::measured_columns(recording.traces(), measured);
    let mut found = import.to_vec();
    found.extend(checks::check_clock(recording));
    let rest = leave_out_filled(recording, measured, &untracked);
    let (tracked, quality) = rest.as_ref().map_or((recording, measured), |(rest, quality)| (rest, quality));
    let is_changed = put_back.is_some() || rest.is_some();
    let own_motion = is_changed.then(|| measure_motion(tracked, quality, instants));
    let motion = own_motion.as_ref().unwrap_or(&known.summary);
    let own_tilt = put_back.as_ref().map(|recording| measure_tilt(recording, instants, measured));
    let tilt = own_tilt.as_ref().unwrap_or(&known.tilt);
    let jumped = jumps::find_head_jumps(tracked, quality, &untracked);
    let stretch = (!jumped.is_empty())
        .then(|| change_traces(tracked, |traces| jumps::keep_longest_stretch(traces, &jumped)))
        .flatten();
    // (after a jump of both points, the halves of the recording are not alike, so no lag can be seen to grow)
    let may_grow = !jumped.iter().any(jumps::HeadJump::is_of_both);
    let reported_lag = motion.lag_frames.filter(|lag| {
        (may_grow || !lag::is_growing(*lag)) && !untracked::are_many(&untracked, measured.frames)
    });
    found.extend(jumps::check_exchanges(&exchanges));
    found.extend(jumps::check_head_jumps(&jumped));
    found.extend(columns::check_columns(stretch.as_ref().unwrap_or(tracked).traces(), quality, instants));
    found.extend(mechanism::check_mechanism(motion, measured));
    found.extend(
        columns.iter().filter_map(|column| prefilter::check_prefilter(column, measured.frame_rate_hz)),
    );
    found.extend(lag::check_lag(reported_lag));
    found.extend(checks::check_grid(measured));
    found.push(checks::check_exposure(measured));
    found.extend(motion::check_motion(recording));
    found.extend(tilt::check_tilt(recording, measured, tilt.as_ref().ok()));
    found.push(motion::check_turns(instants));
    for column in &columns {
        found.extend(checks::check_track_column(column, recording.grid(), optics));
    }
    found.extend(untracked::describe_untracked(original, &untracked, &(0..original.tip_x_m.len())));
    // (a stable sort keeps the order of the checks within a severity)
    found.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    found
}

/// Serious findings that make the frequencies of a channel doubtful within `frames`: those of `import` on the
/// clock, and those on positions that nobody tracked.
pub(crate) fn find_frequency_faults(
    recording: &Recording,
    optics: &Optics,
    import: &[QualityFinding],
    channel: Channel,
    frames: &Range<usize>,
) -> Vec<QualityFinding> {
    let measured = measure_quality(recording, optics.exposure_s);
    let mut untracked = find_untracked_frames(recording, &measured, optics);
    untracked.retain(|found| channel.columns().iter().any(|column| column.starts_with(found.channel)));
    let positions = untracked::describe_untracked(recording.traces(), &untracked, frames);
    let of_clock = |finding: &&QualityFinding| {
        matches!(finding.check, Check::UnevenClock | Check::ImpliedRate | Check::PickedFrames)
    };
    let found = import.iter().filter(of_clock).cloned().chain(positions);
    found.filter(|finding| finding.severity == Severity::Serious).collect()
}

/// The recording with changed traces.
fn change_traces(recording: &Recording, change: impl FnOnce(Traces) -> Traces) -> Option<Recording> {
    recording.clone().with_traces(change(recording.traces().clone())).ok()
}

/// The recording and its quality without repeated and interpolated positions, whose noise is too small.
/// `None` if there are none, or if the frames were resampled to a grid and differ from the untracked ones.
fn leave_out_filled(
    recording: &Recording,
    measured: &Quality,
    untracked: &[UntrackedFrames],
) -> Option<(Recording, Quality)> {
    let is_filled =
        |found: &&UntrackedFrames| matches!(found.check, Check::HeldPoints | Check::InterpolatedPoints);
    let filled: Vec<UntrackedFrames> = untracked.iter().filter(is_filled).cloned().collect();
    if filled.is_empty() || recording.is_resampled() {
        return None;
    }
    let rest = recording.clone().with_traces(drop_untracked(recording.traces().clone(), &filled)).ok()?;
    let quality = measure_quality(&rest, measured.exposure_s());
    Some((rest, quality))
}

/// Smallest amplitude of an oscillation that is visible in single frames, in standard deviations of the
/// noise.
const VISIBLE_COMPONENTS: f64 = 3.0;

/// Overall grade of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Grade {
    /// No finding graver than a note.
    Good,
    /// At least one caution, but no serious finding.
    UsableWithCare,
    /// A serious finding: frequencies, lengths or directions are probably wrong, or the recording can show
    /// nothing.
    NotUsable,
}

/// Grade of the gravest finding.
pub fn grade_findings(findings: &[QualityFinding]) -> Grade {
    match findings.iter().map(|finding| finding.severity).max() {
        None | Some(Severity::Note) => Grade::Good,
        Some(Severity::Caution) => Grade::UsableWithCare,
        Some(Severity::Serious) => Grade::NotUsable,
    }
}

/// The verdict, one statement per line: the grade with the visible frequencies, then the findings, the
/// gravest first. A finding on several channels becomes one line with its largest number. Notes without
/// advice are left out.
pub fn verdict_lines(measured: &Quality, findings: &[QualityFinding]) -> Vec<String> {
    let mut lines = vec![grade_line(measured, findings)];
    let mut stated: Vec<(Check, Severity)> = vec![];
    let shown = |f: &&QualityFinding| f.severity > Severity::Note || !f.advice.is_empty();
    let mut ordered: Vec<&QualityFinding> = findings.iter().filter(shown).collect();
    ordered.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    for finding in &ordered {
        let key = (finding.check, finding.severity);
        if finding.channel.is_none() {
            lines.push(finding.to_line());
        } else if !stated.contains(&key) {
            stated.push(key);
            lines.extend(join_channel_findings(&ordered, key));
        }
    }
    lines.extend(measured.deflection_floor_m().map(|floor_m| {
        format!(
            "note: a deflection above about {:.3} um stands out from the noise in single frames \
             ({VISIBLE_COMPONENTS} standard deviations)",
            VISIBLE_COMPONENTS * floor_m * 1e6
        )
    }));
    lines
}

fn grade_line(measured: &Quality, findings: &[QualityFinding]) -> String {
    if measured.missing_deflection_frames == measured.frames {
        return "not usable for deflection: in no frame are tip and head both tracked along the sweep; the \
            single channels may still serve"
            .to_owned();
    }
    let (low_hz, high_hz) = measured.band_hz();
    if low_hz >= high_hz {
        let Quality { frames, frame_rate_hz, .. } = measured;
        return format!(
            "too short for a spectrum: {frames} frames at {frame_rate_hz} frames/s hold fewer than \
             {FEWEST_CYCLES} cycles of anything they can show"
        );
    }
    let grade = match grade_findings(findings) {
        Grade::Good => "good: shows",
        Grade::UsableWithCare => "usable with care: shows",
        Grade::NotUsable => "not usable until the serious findings are resolved: would show",
    };
    format!(
        "{grade} oscillations from about {low_hz:.3} Hz ({FEWEST_CYCLES} cycles in the recording) to \
         {high_hz:.0} Hz ({NYQUIST_SHARE} of the Nyquist frequency)"
    )
}

/// Joins the findings of one check and severity on single channels into one line.
fn join_channel_findings(findings: &[&QualityFinding], key: (Check, Severity)) -> Option<String> {
    let alike = || findings.iter().filter(|f| f.channel.is_some() && (f.check, f.severity) == key);
    let channels: Vec<&str> = alike().filter_map(|finding| finding.channel.as_deref()).collect();
    let worst = alike().copied().reduce(|worst, f| if f.value > worst.value { f } else { worst })?;
    if channels.len() < 2 {
        return Some(worst.to_line());
    }
    let named = format!("{} (most in {})", channels.join(", "), worst.channel.as_deref().unwrap_or_default());
    Some(worst.clone().on_channel(&named).to_line())
}

/// The measurements as a text table in display units, one measurement per line.
pub(crate) fn measurement_table(quality: &Quality, start_s: f64) -> String {
    let grid = FrameGrid { start_s, frame_rate_hz: quality.frame_rate_hz, frames: quality.frames };
    let share = 100.0 * quality.missing_deflection_frames as f64 / quality.frames as f64;
    let end_s = grid.time_s(quality.frames.saturating_sub(1));
    let mut lines = vec![
        format!("frames            {} ({start_s} s to {end_s} s)", quality.frames),
        format!("duration          {:.6} s", quality.duration_s),
        format!("recording rate    {} frames/s (Nyquist {} Hz)", quality.frame_rate_hz, quality.nyquist_hz),
        format!(
            "no deflection     {} frames ({share:.1} %) in {} gaps",
            quality.missing_deflection_frames, quality.gaps
        ),
    ];
    if let Some(at_s) = quality.longest_gap_at_s {
        lines.push(format!("longest gap       {} frames from {at_s:.6} s", quality.longest_gap_frames));
    }
    let exposure = quality.exposure_half_power_hz.zip(quality.exposure_passes_at_nyquist);
    if let Some((half_hz, passes)) = exposure {
        lines.push(format!(
            "exposure          passes half the power at {half_hz:.0} Hz, {:.0} % of an amplitude at the \
             Nyquist frequency",
            100.0 * passes
        ));
    }
    lines.push(format!("{:<10}{:>10}{:>14}{:>14}", "channel", "missing", "noise (um)", "step (um)"));
    let micro = |value: Option<f64>| to_ascii(&format_or_dash(value, |v| format_decimals(v * 1e6, 4)));
    lines.extend(quality.channels().map(|(name, c)| {
        format!("{name:<10}{:>10}{:>14}{:>14}", c.missing_frames, micro(c.noise_m), micro(c.step_m))
    }));
    lines.push(
        "noise: median third difference as white noise, an upper estimate where the motion is fast"
            .to_owned(),
    );
    lines.join("\n")
}
