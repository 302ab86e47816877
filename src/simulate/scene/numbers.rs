//! The numbers of a scene under the names of the parameter table.

use super::as_written::{DriveFile, SceneNumbers};
use super::{SceneError, key_error};
use crate::model::parameters;
use crate::model::parameters::{ModelParameter, PARAMETERS};
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
    pub(crate) fn read_table(&mut self, table: &str, numbers: SceneNumbers) -> Result<(), SceneError> {
        numbers
            .into_iter()
            .try_for_each(|(key, value)| self.read_number(&format!("{table}.{key}"), Some(value)))
    }

    /// Place and path of the recording that drives the head, where there is one instead of numbers.
    pub(crate) fn read_drive(&mut self, written: &DriveFile) -> Result<Option<(String, String)>, SceneError> {
        let numbers = [("amplitude_m", &written.amplitude_m), ("frequency_hz", &written.frequency_hz)];
        let all = numbers.into_iter().chain([("delay_s", &written.delay_s)]);
        let Some(recording) = &written.recording else {
            numbers
                .into_iter()
                .try_for_each(|(key, value)| self.read_number(&format!("drive.{key}"), value.clone()))?;
            return Ok(None);
        };
        let (line, _) = toml_file::line_and_column(self.text, recording.span().start);
        let place = format!("{}:{line}", self.file);
        if let Some((key, _)) = all.into_iter().find(|(_, value)| value.is_some()) {
            let expected = "a recording, or amplitude_m and frequency_hz";
            return Err(key_error(
                &place,
                "drive.recording",
                &format!("also `drive.{key}`"),
                expected,
                "remove one: both say how the head moves",
            ));
        }
        Ok(Some((place, recording.get_ref().clone())))
    }

    /// When the cosine starts, s.
    pub(crate) fn read_delay_s(&self, written: &DriveFile) -> Result<f64, SceneError> {
        let Some(delay) = &written.delay_s else { return Ok(0.0) };
        let found = *delay.get_ref();
        if found.is_finite() {
            return Ok(found);
        }
        let (line, _) = toml_file::line_and_column(self.text, delay.span().start);
        let place = format!("{}:{line}", self.file);
        let expected = "the time in seconds at which the head starts from one end of its stroke";
        Err(key_error(&place, "drive.delay_s", &found.to_string(), expected, "correct the value"))
    }

    pub(crate) fn read_number(&mut self, name: &str, value: Option<Spanned<f64>>) -> Result<(), SceneError> {
        let Some(value) = value else { return Ok(()) };
        let (line, _) = toml_file::line_and_column(self.text, value.span().start);
        let place = format!("{}:{line}", self.file);
        let parameter = find_known_parameter(&place, name)?;
        check_parameter_range(&place, parameter, *value.get_ref())?;
        if let Some(twin) =
            PARAMETERS.iter().find(|p| p.quantity == parameter.quantity && self.values.contains_key(p.name))
        {
            return Err(key_error(
                &place,
                name,
                &format!("also `{}`", twin.name),
                "one of the two",
                "remove one: both set the same quantity",
            ));
        }
        self.values.insert(parameter.name, *value.get_ref());
        Ok(())
    }
}

pub(super) fn find_known_parameter(place: &str, name: &str) -> Result<&'static ModelParameter, SceneError> {
    parameters::find_parameter(name).ok_or_else(|| {
        let table = name.split_once('.').map_or("", |(table, _)| table);
        let known: Vec<&str> = parameters::parameter_names()
            .into_iter()
            .filter(|n| table.is_empty() || n.split('.').next() == Some(table))
            .collect();
        let known = if known.is_empty() { parameters::parameter_names() } else { known };
        key_error(
            place,
            name,
            "an unknown key",
            "a key of the scene format",
            &toml_file::suggest_key(name, &known),
        )
    })
}

pub(super) fn check_parameter_range(
    place: &str,
    parameter: &ModelParameter,
    value: f64,
) -> Result<(), SceneError> {
    if parameter.range.admits(value) {
        return Ok(());
    }
    let expected = format!("{} ({}, {})", parameter.range.describe(), parameter.meaning, parameter.unit);
    Err(key_error(place, parameter.name, &value.to_string(), &expected, "correct the value"))
}

/// Every quantity is given once or has a default; the shoulder's only where there is a shoulder, the drive's
/// where it is not recorded.
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
            return Err(key_error(
                file,
                parameter.name,
                "nothing",
                &ways.join(" or "),
                &format!("add it: {}, {}", parameter.meaning, parameter.unit),
            ));
        }
    }
    Ok(())
}
