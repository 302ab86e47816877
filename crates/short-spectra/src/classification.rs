//! The criteria for and against the frequency of a component, one for each reason.

use super::SampledRecord;
use super::component::{AliasSource, Component, ComponentReason, ComponentVerdict};
use super::frequency_drift::FULLY_FOLLOWED;
use super::relations::{describe_relations, find_relations};
use super::settings::{CLEAR_DB, MIN_CYCLES, SpectrumSettings};
use crate::sampling::{aliased_frequencies_hz, exposure_gain};

/// Exposure gain below which a component counts as attenuated: a loss of 10 % exceeds the uncertainty of the
/// scale (m per pixel) of a recording.
const ATTENUATED_BELOW: f64 = 0.9;
/// Largest allowed shift of a frequency by a richer trend, in standard deviations.
const MOST_TREND_SHIFT: f64 = 3.0;
/// Largest allowed ratio of the residual around a component to the amplitude of the component. If the ratio
/// is larger, a second line or a drift is as good an explanation.
const MOST_RESIDUAL: f64 = 0.25;
/// Distance in frequency, in resolutions, below which two oscillations may be a single one. At half a
/// resolution and 50 dB, a single oscillation fits a pair of equal amplitudes as well as two oscillations do.
const LEAST_SEPARATION: f64 = 0.5;
/// Smallest range of a drift, in resolutions, that two steady lines cannot imitate: pairs up to 1.7
/// resolutions apart looked like one component that drifts by up to five resolutions.
pub(super) const LEAST_CLEAR_DRIFT: f64 = 5.0;
/// Damping ratio above which an oscillation is over within a cycle: at this ratio its amplitude falls to a
/// quarter in one cycle.
pub(super) const SINGLE_CYCLE_DAMPING: f64 = 0.22;
/// Largest allowed median distance, in resolutions of the segments, of a drifting frequency from the value
/// extrapolated with its rate. For noise in bands of 5 to 40 resolutions this distance is 0.35 or more, for a
/// measured oscillation up to 0.26.
pub(super) const MOST_STRAY: f64 = 0.3;
/// Ratio of an amplitude to its standard deviation from which the amplitude is significant.
const LEAST_DEVIATIONS: f64 = 3.0;
/// Properties of the camera and the motion that limit which frequencies can be trusted.
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
#[derive(Debug, Clone, Default)]
pub(super) struct Evidence {
    /// Further reasons for which the frequency is ambiguous.
    pub doubts: Vec<String>,
    /// Whether the trend could not grow further and the component is slow enough to be a part of a step.
    pub trend_exhausted: bool,
    /// Shift of the frequency with a richer trend, in standard deviations of the frequency.
    pub trend_shift: f64,
    /// Ratio of the largest residual peak within the lobe around the component to its amplitude; only peaks
    /// that stand out from the noise count.
    pub residual_ratio: f64,
    /// Whether an oscillation with a constant frequency drift or a linearly falling amplitude explains more
    /// than this component does.
    pub unsteady: bool,
    /// Distance in frequency from the nearest other oscillation, in resolutions.
    pub nearest: Option<f64>,
    /// Distance in frequency from another oscillation, in resolutions, if one of the two may be a part of the
    /// other.
    pub fragment_distance: Option<f64>,
    /// Fraction of the segments in which the ridge of a drifting component has points.
    pub followed_share: Option<f64>,
    /// Whether the component is as slow as the waves of a trend to which columns had to be added.
    pub slow: bool,
    /// Whether the component and two others near it begin late or end soon.
    pub crowded: bool,
    /// Median distance, in resolutions of the segments, of a drifting frequency from the value extrapolated
    /// with its rate.
    pub median_stray: Option<f64>,
    /// Range of the drift, in resolutions.
    pub drift: Option<f64>,
    /// Whether the component changes over a record that is too long for a fit.
    pub changes: bool,
    /// Whether the frequency of the component stayed within the peak at which the component was found.
    pub keeps_peak: bool,
}

/// Sets the verdict and the reasons of each component from its evidence. The components are sorted by falling
/// amplitude.
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

/// Every reason against a component, the most serious first.
fn collect_reasons(c: &Component, evidence: &Evidence, at: &RecordContext) -> Vec<ComponentReason> {
    let mut found = Vec::new();
    let mut add =
        |verdict, words: Option<String>| found.extend(words.map(|words| ComponentReason { verdict, words }));
    let cycles = c.frequency_hz / at.resolution_hz;
    let few = || format!("{cycles:.1} cycles in the window, of {MIN_CYCLES} at least");
    add(ComponentVerdict::NotResolvable, (cycles < MIN_CYCLES).then(few));
    add(ComponentVerdict::AliasSuspected, (!c.folded_from.is_empty()).then(|| describe_aliases(c, at)));
    evidence.doubts.iter().for_each(|words| add(ComponentVerdict::Ambiguous, Some(words.clone())));
    describe_ambiguities(c, evidence).into_iter().for_each(|words| add(ComponentVerdict::Ambiguous, words));
    describe_relations(c).into_iter().for_each(|(verdict, words)| add(verdict, words));
    let attenuated = c.exposure_passes.filter(|passes| *passes < ATTENUATED_BELOW);
    add(ComponentVerdict::Attenuated, attenuated.map(|passes| describe_attenuation(c, passes)));
    let weak = || format!("{:.1} dB above the noise floor, clear from {CLEAR_DB} dB", c.snr_db);
    add(ComponentVerdict::Weak, (c.snr_db < CLEAR_DB).then(weak));
    found
}

/// Reasons for which a frequency is ambiguous.
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

/// Effect of the exposure as text; near a zero of its response the amplitude before exposure is unknown.
fn describe_attenuation(c: &Component, passes: f64) -> String {
    /// Smallest gain by which an amplitude may be divided. A smaller gain is so close to a zero of the
    /// response that a small error of the exposure would change the result by a large fraction.
    const LEAST: f64 = 0.02;
    let before = || format!(", {:.3} um before it", c.amplitude_m * 1e6 / passes);
    let before = if passes < LEAST { String::new() } else { before() };
    format!("the exposure has passed {passes:.3} of the amplitude{before}")
}

/// The frequencies that could fold onto a component, as text.
fn describe_aliases(c: &Component, at: &RecordContext) -> String {
    /// Number of frequencies in the text; the file lists all of them.
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
