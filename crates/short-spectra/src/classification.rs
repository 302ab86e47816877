//! The criteria for and against the frequency of a component, one for each reason.

use super::SampledRecord;
use super::component::{AliasSource, Component, ComponentReason, ComponentVerdict};
use super::relations::{describe_relations, find_relations};
use super::settings::{CLEAR_DB, MIN_CYCLES, SpectrumSettings};
use crate::sampling::{aliased_frequencies_hz, exposure_gain};

/// Exposure gain below which a component counts as attenuated: a loss of 10 % exceeds the uncertainty of the
/// scale (m per pixel) of a recording.
const ATTENUATED_BELOW: f64 = 0.9;
/// Smallest range of a drift, in resolutions, that two steady lines cannot imitate: pairs up to 1.7
/// resolutions apart looked like one component that drifts by up to five resolutions.
pub(super) const LEAST_CLEAR_DRIFT: f64 = 5.0;
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
    /// Whether the component changes over a record that is too long for a fit.
    pub changes: bool,
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

/// Reasons why a frequency is ambiguous, in addition to `evidence.doubts`.
fn describe_ambiguities(c: &Component, evidence: &Evidence) -> [Option<String>; 2] {
    let unknown = 100.0 * c.amplitude_sd_m / c.amplitude_m;
    let unsure = c.amplitude_m < LEAST_DEVIATIONS * c.amplitude_sd_m;
    let changes = "its amplitude or phase changes over the window, which is too long for a fit of decay or \
                   drift; choose a shorter window";
    [
        evidence.changes.then(|| changes.to_owned()),
        unsure.then(|| format!("the standard deviation of its amplitude is {unknown:.0} %")),
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
