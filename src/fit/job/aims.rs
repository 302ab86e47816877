//! Components and features of a job: what is read, and where its target comes from.

use super::aim::{Aim, Source, When};
use super::as_written;
use super::conditions::Condition;
use super::entry::{Entry, Place};
use super::refusal::{Refusal, above_zero, non_empty, refuse, repeated};
use crate::feature::{self, FREQUENCY_SD_FLOOR, Feature, Keys, Kind, Measure, Reading};

/// Standard deviation of the logarithm of a level of a log-spectrum unless the job says otherwise: a
/// periodogram of a few resolutions scatters as much.
const LEVEL_SD_RELATIVE: f64 = 0.3;

/// Relative error of a component's frequency that passes, unless the job says otherwise: the aim of this
/// program, 2 %.
pub(super) const TOLERANCE_RELATIVE: f64 = 0.02;

/// What the entries have to agree with.
pub(super) struct Context<'a> {
    pub conditions: &'a [Condition],
    /// Half the rate of the job's own camera, Hz.
    pub nyquist_hz: Option<f64>,
}

/// Components first, then features, in the order of the file.
pub(super) fn aims(written: &as_written::Job, context: &Context) -> Result<Vec<Aim>, Refusal> {
    let mut aims = written.component.iter().map(|c| component(c, context)).collect::<Result<Vec<_>, _>>()?;
    for entry in &written.feature {
        aims.extend(feature(entry, context)?);
    }
    let traced = !written.trace.is_empty();
    if aims.is_empty() && !traced {
        return refuse(
            "component",
            "found none, and no [[feature]] or [[trace]]; expected at least one thing to fit: add a [[trace]]",
        );
    }
    if aims.iter().all(|aim| aim.held_out) && !traced {
        return refuse(
            "component",
            "every [[component]] and [[feature]] belongs to something that is held out; expected at least one thing to fit",
        );
    }
    match repeated(aims.iter().map(|aim| aim.feature.name.as_str())) {
        Some(name) => refuse(
            format!("component or feature `{name}`"),
            "the name is used twice; give each its own `name`",
        ),
        None => Ok(aims),
    }
}

fn component(written: &as_written::Component, context: &Context) -> Result<Aim, Refusal> {
    let entry = Entry { what: format!("component `{}`", written.name) };
    let name = non_empty("component, `name`", &written.name, "a name such as \"low\"")?;
    let place = entry.place(written.recording.as_ref(), context.conditions, context.nyquist_hz)?;
    let band = reading_entry(&entry, &written.keys(), &place).band()?;
    let sd = written.target_sd_hz.map(|sd| above_zero(entry.key("target_sd_hz"), sd)).transpose()?;
    let source = match (written.target_hz, sd) {
        (Some(target), Some(sd)) => {
            entry.given(above_zero(entry.key("target_hz"), target)?, sd, "target_sd_hz", Measure::Log)?
        }
        (Some(_), None) => {
            return refuse(
                entry.key("target_sd_hz"),
                "missing; a given `target_hz` needs its standard deviation",
            );
        }
        (None, _) if !place.measured => {
            return refuse(
                entry.key("target_hz"),
                "missing; without a [[recording]] expected `target_hz` and `target_sd_hz`",
            );
        }
        (None, sd) => Source::Measured { least_sd: sd.unwrap_or(0.0), least_sd_relative: FREQUENCY_SD_FLOOR },
    };
    let tolerance = above_zero(
        entry.key("tolerance_relative"),
        written.tolerance_relative.unwrap_or(TOLERANCE_RELATIVE),
    )?;
    let feature = Feature { name, reading: Reading::Frequency(band), condition: place.index };
    Ok(Aim {
        feature,
        source,
        tolerance_relative: Some(tolerance),
        held_out: place.held_out,
        stage: When::Always,
    })
}

fn feature(written: &as_written::Feature, context: &Context) -> Result<Vec<Aim>, Refusal> {
    let kind = kind(written)?;
    let name = written.name.clone().unwrap_or_else(|| kind.word.to_owned());
    non_empty("feature, `name`", &name, "a name, or no such key")?;
    let entry = Entry { what: format!("feature `{name}` ({})", kind.word) };
    let place = entry.place(written.recording.as_ref(), context.conditions, context.nyquist_hz)?;
    let readings = kind.readings(&name, &reading_entry(&entry, &written.keys(), &place))?;
    if kind.is_several() {
        check_several(&entry, written, &place)?;
    }
    let aim = |(name, reading): (String, Reading)| {
        let source = source(&entry, written, &reading, &place)?;
        let stage = if let Reading::BandLevel { .. } = reading { When::Last } else { When::Always };
        let feature = Feature { name, reading, condition: place.index };
        Ok(Aim { feature, source, tolerance_relative: None, held_out: place.held_out, stage })
    };
    readings.into_iter().map(aim).collect()
}

/// The kind of a feature that a recording shows; a frequency is a component of its own.
fn kind(written: &as_written::Feature) -> Result<&'static Kind, Refusal> {
    let problem = match Kind::find(&written.kind) {
        Ok(kind) if kind.is_of_run() => format!(
            "found \"{}\", which only a simulated run shows; map it in a study, or remove it",
            kind.word
        ),
        Ok(Kind { word: "frequency", .. }) => {
            "found \"frequency\", which is a [[component]] with a `tolerance_relative`; write it as one"
                .to_owned()
        }
        Ok(kind) => return Ok(kind),
        Err(problem) => problem,
    };
    let key = written.name.as_ref().map_or_else(String::new, |name| format!(" `{name}`"));
    refuse(format!("feature{key}, `kind`"), problem)
}

/// Several features have targets of their own, which are measured.
fn check_several(entry: &Entry, written: &as_written::Feature, place: &Place) -> Result<(), Refusal> {
    if !place.measured {
        return refuse(
            entry.key("kind"),
            "found without a [[recording]], expected one on which its targets are measured; give each as a feature of its own",
        );
    }
    if written.target.is_some() || written.target_sd.is_some() {
        return refuse(
            entry.key("target"),
            "one target has no meaning for several features, which are measured on the recording; remove it",
        );
    }
    Ok(())
}

/// The part of an entry that says what is read.
fn reading_entry<'a>(entry: &'a Entry, keys: &'a Keys, place: &Place) -> feature::Entry<'a> {
    feature::Entry { name: &entry.what, noun: "feature", keys, nyquist_hz: place.nyquist_hz, noisy: true }
}

fn source(
    entry: &Entry,
    written: &as_written::Feature,
    reading: &Reading,
    place: &Place,
) -> Result<Source, Refusal> {
    let measure = reading.measure();
    match (written.target, written.target_sd, written.sd_relative) {
        (Some(target), Some(sd), None) => entry.given(target, sd, "target_sd", measure),
        (None, None, _) if !place.measured => {
            refuse(entry.key("target"), "missing; without a [[recording]] expected `target` and `target_sd`")
        }
        (None, None, relative) => {
            let relative = relative.map(|relative| entry.relative_sd(relative)).transpose()?;
            Ok(measured(measure, relative.unwrap_or_else(|| least_sd_relative(reading))))
        }
        _ => refuse(
            entry.key("sd_relative"),
            "expected either `sd_relative` or nothing (the target is measured on the recording), or `target` and `target_sd` together",
        ),
    }
}

/// A share of the target, or of the scale of a value that may be zero.
fn measured(measure: Measure, relative: f64) -> Source {
    match measure {
        Measure::Log => Source::Measured { least_sd: 0.0, least_sd_relative: relative },
        Measure::Linear { scale } => Source::Measured { least_sd: relative * scale, least_sd_relative: 0.0 },
    }
}

/// What a reading is known to at best, where the job does not say: the rest is the recording's own noise.
fn least_sd_relative(reading: &Reading) -> f64 {
    match reading {
        Reading::Frequency(_) | Reading::CycleFrequency { .. } => FREQUENCY_SD_FLOOR,
        Reading::BandLevel { .. } => LEVEL_SD_RELATIVE,
        _ => 0.0,
    }
}
