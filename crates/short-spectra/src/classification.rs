//! The criteria for and against a component's frequency, one for each reason.

use super::SampledRecord;
use super::component::{AliasSource, Component, ComponentReason, ComponentVerdict};
use super::frequency_drift::FULLY_FOLLOWED;
use super::relations::{describe_relations, find_relations};
use super::settings::{CLEAR_DB, MIN_CYCLES, SpectrumSettings};
use crate::sampling::{aliased_frequencies_hz, exposure_gain};

/// Exposure gain below which a reason is given: a loss of a tenth exceeds the uncertainty of a scale.
const ATTENUATED_BELOW: f64 = 0.9;
/// Deviations by which a richer trend may move a frequency.
const MOST_TREND_SHIFT: f64 = 3.0;
/// Share of a component's amplitude that may be left around it: with more, a second line or a drift has as
/// much to say.
const MOST_RESIDUAL: f64 = 0.25;
/// Resolutions between two oscillations below which one could be taken for the other: of equal pairs half a
/// resolution apart at 50 dB, one fit is as good as two.
const LEAST_SEPARATION: f64 = 0.5;
/// Resolutions of a drift that two lines cannot imitate: pairs up to 1.7 apart looked like one component that
/// drifts by up to five.
const LEAST_CLEAR_DRIFT: f64 = 5.0;
/// Damping ratio from which an oscillation is over within a cycle: its amplitude falls to a quarter.
pub(super) const SINGLE_CYCLE_DAMPING: f64 = 0.22;
/// Most distance of a drifting frequency from its extrapolated rate, resolutions of its segments: noise in
/// bands of 5 to 40 resolutions strays by 0.35 and more, a measured cycle by up to 0.26.
const MOST_STRAY: f64 = 0.3;
/// Deviations from zero from which an amplitude is known.
const LEAST_DEVIATIONS: f64 = 3.0;
/// What the camera and the motion allow.
#[derive(Debug, Clone, Copy)]
pub(super) struct RecordContext {
    pub frame_rate_hz: f64,
    pub exposure_s: Option<f64>,
    pub resolution_hz: f64,
    pub fastest_hz: f64,
}

impl RecordContext {
    pub(super) fn new(record: &SampledRecord, resolution_hz: f64, settings: &SpectrumSettings) -> Self {
        let SampledRecord { frame_rate_hz, exposure_s, .. } = *record;
        Self { frame_rate_hz, exposure_s, resolution_hz, fastest_hz: settings.fastest_hz }
    }
}

/// Evidence for and against one component.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Evidence {
    /// Whether the trend could grow no further and the component is slow enough to be a piece of a step.
    pub trend_exhausted: bool,
    /// Shift of the frequency with a richer trend, in its own deviations.
    pub trend_shift: f64,
    /// Largest amplitude left within the lobe around it, as a share of its own; only what stands out of the
    /// noise.
    pub residual_ratio: f64,
    /// Whether a frequency that drifts evenly or an amplitude that falls in a line explains more.
    pub unsteady: bool,
    /// Distance to the nearest other oscillation, resolutions.
    pub nearest: Option<f64>,
    /// Distance to another oscillation, resolutions, where one of the two may be a piece of the other.
    pub fragment_distance: Option<f64>,
    /// Share of the segments in which one that drifts was followed.
    pub followed_share: Option<f64>,
    /// Whether it is as slow as what a trend that had to grow describes.
    pub slow: bool,
    /// Whether two more near it begin late or are over soon, as it does.
    pub crowded: bool,
    /// Distance of a drifting frequency from its extrapolated rate, resolutions of its segments: the median.
    pub median_stray: Option<f64>,
    /// How far it drifts, resolutions.
    pub drift: Option<f64>,
    /// Whether it changes over a record that is too long for a fit.
    pub changes: bool,
    /// Whether it stayed at the peak that it was found at.
    pub keeps_peak: bool,
}

/// Judges components, largest first, each with its evidence.
pub(super) fn classify_components(components: &mut [Component], evidence: &[Evidence], at: &RecordContext) {
    find_relations(components, at);
    for (c, evidence) in components.iter_mut().zip(evidence) {
        let passes = |hz: f64| at.exposure_s.map(|exposure_s| exposure_gain(hz, exposure_s));
        let source = |frequency_hz| AliasSource { frequency_hz, exposure_passes: passes(frequency_hz) };
        let aliases = aliased_frequencies_hz(c.frequency_hz, at.frame_rate_hz, at.fastest_hz);
        c.exposure_passes = passes(c.frequency_hz);
        c.folded_from = aliases.into_iter().map(source).collect();
        c.reasons = collect_reasons(c, evidence, at);
        c.verdict = c.reasons.first().map_or(ComponentVerdict::Clear, |reason| reason.verdict);
    }
}

/// Every reason against a component, gravest first.
fn collect_reasons(c: &Component, evidence: &Evidence, at: &RecordContext) -> Vec<ComponentReason> {
    let mut found = Vec::new();
    let mut add =
        |verdict, words: Option<String>| found.extend(words.map(|words| ComponentReason { verdict, words }));
    let cycles = c.frequency_hz / at.resolution_hz;
    let few = || format!("{cycles:.1} cycles in the window, of {MIN_CYCLES} at least");
    add(ComponentVerdict::NotResolvable, (cycles < MIN_CYCLES).then(few));
    add(ComponentVerdict::AliasSuspected, (!c.folded_from.is_empty()).then(|| describe_aliases(c, at)));
    describe_ambiguities(c, evidence).into_iter().for_each(|words| add(ComponentVerdict::Ambiguous, words));
    describe_relations(c).into_iter().for_each(|(verdict, words)| add(verdict, words));
    let attenuated = c.exposure_passes.filter(|passes| *passes < ATTENUATED_BELOW);
    add(ComponentVerdict::Attenuated, attenuated.map(|passes| describe_attenuation(c, passes)));
    let weak = || format!("{:.1} dB above the noise floor, clear from {CLEAR_DB} dB", c.snr_db);
    add(ComponentVerdict::Weak, (c.snr_db < CLEAR_DB).then(weak));
    found
}

/// What makes a frequency ambiguous.
fn describe_ambiguities(c: &Component, evidence: &Evidence) -> [Option<String>; 15] {
    let shift_hz = c.trend_shift_hz.unwrap_or_default();
    let near = evidence.nearest.filter(|nearest| *nearest < LEAST_SEPARATION);
    let followed = evidence.followed_share.filter(|followed| *followed < FULLY_FOLLOWED);
    let stray = evidence.median_stray.filter(|by| *by > MOST_STRAY);
    let drift = evidence.drift.filter(|drift| *drift < LEAST_CLEAR_DRIFT);
    let single = c.damping_ratio.filter(|ratio| *ratio > SINGLE_CYCLE_DAMPING);
    let (left, unknown) = (100.0 * evidence.residual_ratio, 100.0 * c.amplitude_sd_m / c.amplitude_m);
    let unsure = c.amplitude_m < LEAST_DEVIATIONS * c.amplitude_sd_m;
    let fixed = |holds: bool, words: &str| holds.then(|| words.to_owned());
    [
        fixed(!evidence.keeps_peak, "no oscillation that keeps its frequency and decays steadily explains it"),
        fixed(
            evidence.changes,
            "its amplitude or phase changes over the window, which is too long for a decay or a drift to be \
             tried; choose a shorter one",
        ),
        fixed(
            evidence.trend_exhausted,
            "no trend describes what it rides on; choose a window behind the flip",
        ),
        (evidence.trend_shift > MOST_TREND_SHIFT)
            .then(|| format!("a trend of two columns more moves it by {shift_hz:.2e} Hz")),
        near.map(|n| format!("another lies {n:.2} resolutions from it, closer than the window tells apart")),
        evidence.fragment_distance.map(|by| {
            format!(
                "another lies {by:.1} resolutions from it, and they are not both steady: pieces of one look \
                 the same"
            )
        }),
        followed.map(|s| format!("followed in {:.0} % of the window only: its range may be wider", 100.0 * s)),
        single.map(|r| format!("it is over within a cycle (damping ratio {r:.2}): a step looks the same")),
        fixed(
            evidence.slow,
            "it is slow, and the trend had to grow: it may be a piece of what that describes",
        ),
        fixed(
            evidence.crowded,
            "one of several that begin or are over within the record: noise of a narrow band looks the same",
        ),
        stray.map(|by| {
            format!(
                "its frequency strays from its own rate by {by:.2} resolutions: noise of a narrow band does so"
            )
        }),
        drift.map(|by| format!("it drifts by {by:.1} resolutions: two that beat may look the same")),
        fixed(
            evidence.unsteady,
            "a frequency that drifts or an amplitude that falls in a line explains more",
        ),
        (evidence.residual_ratio > MOST_RESIDUAL).then(|| {
            format!(
                "{left:.0} % of its amplitude is left around it: it drifts, or two lie closer than the window \
                 tells apart"
            )
        }),
        unsure.then(|| format!("its amplitude is known to {unknown:.0} % only")),
    ]
}

/// Effect of the exposure, in words; near a zero of its response the amplitude before it is unknown.
fn describe_attenuation(c: &Component, passes: f64) -> String {
    /// Least gain by which an amplitude may be divided: it is known to a tenth at best.
    const LEAST: f64 = 0.02;
    let before = || format!(", {:.3} um before it", c.amplitude_m * 1e6 / passes);
    let before = if passes < LEAST { String::new() } else { before() };
    format!("the exposure has passed {passes:.3} of the amplitude{before}")
}

/// The frequencies that could fold onto a component, in words.
fn describe_aliases(c: &Component, at: &RecordContext) -> String {
    /// More are left out of the words; the file has them all.
    const MOST: usize = 4;
    let one = |fold: &AliasSource| {
        let passes = fold.exposure_passes;
        let passes =
            passes.map(|p| format!(" (of which the exposure would pass {p:.3})")).unwrap_or_default();
        format!("{:.2} Hz{passes}", fold.frequency_hz)
    };
    let listed: Vec<String> = c.folded_from.iter().take(MOST).map(one).collect();
    let more = if c.folded_from.len() > MOST { " and more" } else { "" };
    format!("at {} frames/s it may as well be {}{more}", at.frame_rate_hz, listed.join(", "))
}
