//! The windows that a job reads, and the frequencies that it seeks in them.

use crate::feature::{FeatureBand, FeatureUnit};
use crate::fit::job::{FitTarget, Job};
use crate::fit::result::FitResult;
use crate::recording::channel::{Channel, Window};
use crate::spectrum::Target;

/// A window of a channel that aims share.
#[derive(Debug, Clone)]
pub struct FitWindow<'a> {
    /// The channel.
    pub channel: Channel,
    /// The window.
    pub window: Window,
    /// The first band in it, where there is one: it says what is removed.
    pub band: Option<&'a FeatureBand>,
    /// What is read in it, in the order of the job.
    pub targets: Vec<&'a FitTarget>,
}

/// A frequency that the fit seeks, and the model's.
#[derive(Debug, Clone, PartialEq)]
pub struct FrequencyComparison {
    /// The frequency of the recording, or the published one.
    pub target: Target,
    /// That of the model at the estimates, Hz; `None` where it has none.
    pub model_hz: Option<f64>,
    /// Whether that passes, by the tolerance of the job.
    pub met: bool,
}

/// The band of a reading that is one of a spectrum.
pub(crate) fn spectral_band(aim: &FitTarget) -> Option<&FeatureBand> {
    aim.feature.reading.band()
}

fn channel_window(aim: &FitTarget) -> Option<(Channel, Window)> {
    let channel = spectral_band(aim).map_or(Channel::Deflection, |band| band.channel);
    aim.feature.reading.window().map(|window| (channel, *window))
}

/// The windows of a condition, in the order of the job, each with the aims that it serves.
#[must_use]
pub fn group_fit_windows(job: &Job, condition: usize) -> Vec<FitWindow<'_>> {
    let mut found: Vec<FitWindow> = Vec::new();
    for aim in job.targets.iter().filter(|aim| aim.feature.condition == condition) {
        let Some((channel, window)) = channel_window(aim) else { continue };
        let own = spectral_band(aim);
        // what is removed tells two spectra of one window apart
        let same = |l: &&mut FitWindow| {
            (l.channel, l.window) == (channel, window)
                && l.band.zip(own).is_none_or(|(a, b)| a.detrend == b.detrend)
        };
        match found.iter_mut().find(same) {
            Some(shared) => {
                shared.band = shared.band.or(own);
                shared.targets.push(aim);
            }
            None => found.push(FitWindow { channel, window, band: own, targets: vec![aim] }),
        }
    }
    found
}

impl FitWindow<'_> {
    /// Names of what is read in it.
    #[must_use]
    pub fn feature_names(&self) -> Vec<String> {
        self.targets.iter().map(|aim| aim.feature.name.clone()).collect()
    }

    /// The frequencies that the fit seeks in it.
    #[must_use]
    pub fn frequency_comparisons(&self, result: &FitResult) -> Vec<FrequencyComparison> {
        self.targets.iter().filter_map(|aim| compare_frequency(aim, result)).collect()
    }
}

/// Target and model of an aim that is a frequency.
pub(crate) fn compare_frequency(aim: &FitTarget, result: &FitResult) -> Option<FrequencyComparison> {
    let name = &aim.feature.name;
    let of = |frequency_hz: f64, sd_hz: f64, model_hz, met| FrequencyComparison {
        target: Target {
            name: name.clone(),
            frequency_hz,
            frequency_sd_hz: Some(sd_hz).filter(|sd| *sd > 0.0),
        },
        model_hz,
        met,
    };
    if aim.feature.reading.unit() != FeatureUnit::HERTZ {
        return None;
    }
    let component = result
        .components
        .iter()
        .find(|c| c.name == *name)
        .map(|c| of(c.target_hz, c.target_sd_hz, c.model_hz, c.pass));
    let feature = || {
        result
            .features
            .iter()
            .chain(&result.held_out)
            .find(|f| f.name == *name)
            .map(|f| of(f.target, f.target_sd, f.model, f.pass))
    };
    component.or_else(feature)
}
