//! Numbers of a scene under the names of the parameter table.

use super::as_written::{DriveFile, SceneNumbers};
use super::error::{SceneError, key_error};
use crate::model::parameters::{self, ModelParameter, PARAMETERS};
use crate::toml_file;
use std::collections::BTreeMap;
use toml::Spanned;

/// Collects the numbers of a file under the names of the parameter table.
pub(super) struct SceneReader<'a> {
    pub file: &'a str,
    pub text: &'a str,
    pub values: BTreeMap<&'static str, f64>,
}

impl SceneReader<'_> {
    /// File and line of a value.
    fn place_of<T>(&self, value: &Spanned<T>) -> String {
        let (line, _) = toml_file::line_and_column(self.text, value.span().start);
        format!("{}:{line}", self.file)
    }

    pub(crate) fn read_table(&mut self, table: &str, numbers: SceneNumbers) -> Result<(), SceneError> {
        let mut numbers = numbers.into_iter();
        numbers.try_for_each(|(key, value)| self.read_number(&format!("{table}.{key}"), Some(value)))
    }

    /// Reads the motion of the head. For a recorded head, returns the place of the key in the file and the
    /// path of the recording. For a cosine, reads its numbers and returns `None`.
    pub(crate) fn read_drive(&mut self, written: &DriveFile) -> Result<Option<(String, String)>, SceneError> {
        let numbers = [("amplitude_m", &written.amplitude_m), ("frequency_hz", &written.frequency_hz)];
        let Some(recording) = &written.recording else {
            let read =
                |(key, value): (_, &Option<_>)| self.read_number(&format!("drive.{key}"), value.clone());
            return numbers.into_iter().try_for_each(read).map(|()| None);
        };
        let place = self.place_of(recording);
        let mut all = numbers.into_iter().chain([("delay_s", &written.delay_s)]);
        if let Some((key, _)) = all.find(|(_, value)| value.is_some()) {
            let (found, advice) = (format!("also `drive.{key}`"), "remove one: both say how the head moves");
            let expected = "a recording, or amplitude_m and frequency_hz";
            return Err(key_error(&place, "drive.recording", found, expected, advice));
        }
        Ok(Some((place, recording.get_ref().clone())))
    }

    /// Time at which the cosine motion of the head starts, s; 0 if left out.
    pub(crate) fn read_delay_s(&self, written: &DriveFile) -> Result<f64, SceneError> {
        let Some(delay) = &written.delay_s else { return Ok(0.0) };
        let found = *delay.get_ref();
        if found.is_finite() {
            return Ok(found);
        }
        let expected = "the time in seconds at which the head starts from one end of its stroke";
        Err(key_error(&self.place_of(delay), "drive.delay_s", found, expected, "correct the value"))
    }

    pub(crate) fn read_number(&mut self, name: &str, value: Option<Spanned<f64>>) -> Result<(), SceneError> {
        let Some(value) = value else { return Ok(()) };
        let place = self.place_of(&value);
        let parameter = find_known_parameter(&place, name)?;
        check_range(&place, parameter, *value.get_ref())?;
        let mut same = PARAMETERS.iter().filter(|p| p.quantity == parameter.quantity);
        if let Some(twin) = same.find(|p| self.values.contains_key(p.name)) {
            let (found, advice) = (format!("also `{}`", twin.name), "remove one: both set the same quantity");
            return Err(key_error(&place, name, found, "one of the two", advice));
        }
        self.values.insert(parameter.name, *value.get_ref());
        Ok(())
    }
}

pub(super) fn find_known_parameter(place: &str, name: &str) -> Result<&'static ModelParameter, SceneError> {
    parameters::find_parameter(name).ok_or_else(|| {
        let table = name.split_once('.').map_or("", |(table, _)| table);
        let mut known = parameters::parameter_names();
        if known.iter().any(|n| n.split('.').next() == Some(table)) {
            known.retain(|n| n.split('.').next() == Some(table));
        }
        let advice = toml_file::suggest_key(name, &known);
        key_error(place, name, "an unknown key", "a key of the scene format", &advice)
    })
}

pub(super) fn check_range(place: &str, parameter: &ModelParameter, value: f64) -> Result<(), SceneError> {
    if parameter.range.admits(value) {
        return Ok(());
    }
    let expected = format!("{} ({}, {})", parameter.range.describe(), parameter.meaning, parameter.unit);
    Err(key_error(place, parameter.name, value, &expected, "correct the value"))
}

/// Refuses a scene that lacks a quantity without a default. The quantities of an absent shoulder or of a
/// recorded drive are not required.
pub(super) fn check_complete(
    file: &str,
    values: &BTreeMap<&'static str, f64>,
    has_shoulder: bool,
    recorded: bool,
) -> Result<(), SceneError> {
    let absent = |p: &ModelParameter| {
        (!has_shoulder && p.name.starts_with("shoulder.")) || (recorded && p.name.starts_with("drive."))
    };
    let needed = |p: &&ModelParameter| p.default.is_none() && !absent(p);
    for parameter in PARAMETERS.iter().filter(needed) {
        let ways: Vec<&str> =
            PARAMETERS.iter().filter(|p| p.quantity == parameter.quantity).map(|p| p.name).collect();
        if !ways.iter().any(|name| values.contains_key(name)) {
            let advice = format!("add it: {}, {}", parameter.meaning, parameter.unit);
            return Err(key_error(file, parameter.name, "nothing", &ways.join(" or "), &advice));
        }
    }
    Ok(())
}
