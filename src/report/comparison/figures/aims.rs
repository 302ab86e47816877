//! Which windows a job looks at, and what it holds its frequencies against.

use crate::feature::{Band, Reading, Unit};
use crate::fit::job::{Aim, Job};
use crate::fit::result::FitResult;
use crate::recording::channel::{Channel, Window};
use crate::report::figure::spectrum::Target;

/// A window of a channel that aims share.
pub(super) struct Looked<'a> {
    pub channel: Channel,
    pub window: Window,
    /// The first band in it, where there is one: it says what is removed.
    pub band: Option<&'a Band>,
    pub aims: Vec<&'a Aim>,
}

/// A target of a frequency beside what the model shows.
pub(super) struct Met {
    pub target: Target,
    pub model_hz: Option<f64>,
}

/// The band of a reading that is one of a spectrum.
pub(super) fn band(aim: &Aim) -> Option<&Band> {
    aim.feature.reading.band()
}

fn window(aim: &Aim) -> Option<(Channel, Window)> {
    match &aim.feature.reading {
        Reading::MeanDeflection(window) | Reading::DeflectionAtSpeed { window, .. } => {
            Some((Channel::Deflection, *window))
        }
        _ => band(aim).map(|band| (band.channel, band.window)),
    }
}

/// The windows of a condition, in the order of the job, each with the aims that it serves.
pub(super) fn looked(job: &Job, condition: usize) -> Vec<Looked<'_>> {
    let mut found: Vec<Looked> = Vec::new();
    for aim in job.aims.iter().filter(|aim| aim.feature.condition == condition) {
        let Some((channel, window)) = window(aim) else { continue };
        let own = band(aim);
        // what is removed tells two spectra of one window apart
        let same = |l: &&mut Looked| {
            (l.channel, l.window) == (channel, window)
                && l.band.zip(own).is_none_or(|(a, b)| a.detrend == b.detrend)
        };
        match found.iter_mut().find(same) {
            Some(looked) => {
                looked.band = looked.band.or(own);
                looked.aims.push(aim);
            }
            None => found.push(Looked { channel, window, band: own, aims: vec![aim] }),
        }
    }
    found
}

impl Looked<'_> {
    /// Names of its aims that one may list: the components, or all.
    pub fn names(&self) -> Vec<String> {
        self.aims.iter().map(|aim| aim.feature.name.clone()).collect()
    }

    /// The frequencies that are sought in it, as the fit met them.
    pub fn frequencies(&self, result: &FitResult) -> Vec<Met> {
        self.aims.iter().filter_map(|aim| met(aim, result)).collect()
    }
}

/// Target and model of an aim that is a frequency.
pub(super) fn met(aim: &Aim, result: &FitResult) -> Option<Met> {
    let name = &aim.feature.name;
    let of = |frequency_hz: f64, sd_hz: f64, model_hz| Met {
        target: Target {
            name: name.clone(),
            frequency_hz,
            frequency_sd_hz: Some(sd_hz).filter(|sd| *sd > 0.0),
        },
        model_hz,
    };
    if aim.feature.reading.unit() != Unit::HERTZ {
        return None;
    }
    let component = result
        .components
        .iter()
        .find(|c| c.name == *name)
        .map(|c| of(c.target_hz, c.target_sd_hz, c.model_hz));
    let feature = || {
        result
            .features
            .iter()
            .chain(&result.held_out)
            .find(|f| f.name == *name)
            .map(|f| of(f.target, f.target_sd, f.model))
    };
    component.or_else(feature)
}
