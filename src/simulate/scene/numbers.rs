//! Numbers of a scene under the names of the parameter table.

use super::as_written::{DriveFile, FrictionValues, SceneNumbers};
use super::error::{SceneError, key_error};
use crate::model::friction::{FrictionShape, FrictionTable, LAW_KEYS};
use crate::model::parameters::{self, ModelParameter, PARAMETERS, ParameterQuantity};
use crate::toml_file;
use std::collections::BTreeMap;
use toml::{Spanned, Value};

/// The number in a value of a file, written with or without a decimal point.
fn as_number(value: &Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64))
}

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

    /// Reads the friction: its numbers, and the law that they belong to.
    pub(crate) fn read_friction(&mut self, written: FrictionValues) -> Result<FrictionShape, SceneError> {
        let law = match written.get("law").and_then(|law| law.get_ref().as_str()) {
            Some("stribeck") => FrictionShape::Stribeck,
            Some("rational") => FrictionShape::Rational,
            Some("table") => FrictionShape::Table(self.read_friction_table(&written)?),
            _ => FrictionShape::Exponential,
        };
        for (key, value) in written.iter().filter(|(key, _)| *key != "law") {
            let (place, name) = (self.place_of(value), format!("friction.{key}"));
            if let Some(number) = as_number(value.get_ref()) {
                self.read_number(&name, Some(Spanned::new(value.span(), number)))?;
                check_law_key(&place, &name, &law)?;
            } else if !matches!(law, FrictionShape::Table(_)) {
                let found = format!("the law \"{}\"", law.name());
                let advice = "leave it out, or choose law = \"table\"";
                return Err(key_error(&place, &name, found, "the law \"table\"", advice));
            }
        }
        Ok(law)
    }

    fn read_friction_table(&self, written: &FrictionValues) -> Result<FrictionTable, SceneError> {
        let keys = ["speeds_m_per_s", "coefficients"];
        let refuse = |key: usize, found: String, expected: &str, advice: &str| {
            let place =
                written.get(keys[key]).map_or_else(|| self.file.to_owned(), |list| self.place_of(list));
            Err(key_error(&place, &format!("friction.{}", keys[key]), found, expected, advice))
        };
        if let Some(key) = keys.iter().position(|key| !written.contains_key(*key)) {
            let expected = "a list of numbers";
            return refuse(
                key,
                "nothing".to_owned(),
                expected,
                "add the speeds and coefficients of the points",
            );
        }
        let list = |key: &str| -> Vec<f64> {
            let values = written.get(key).and_then(|list| list.get_ref().as_array());
            values.into_iter().flatten().filter_map(as_number).collect()
        };
        let [speeds, coefficients] = keys.map(list);
        let (count, most) = (speeds.len(), FrictionTable::MOST_POINTS);
        let points: Vec<(f64, f64)> = speeds.iter().copied().zip(coefficients.iter().copied()).collect();
        match (FrictionTable::from_points(&points), speeds.windows(2).find(|pair| pair[0] >= pair[1])) {
            (_, Some(pair)) => {
                let found = format!("{} after {}", pair[1], pair[0]);
                refuse(0, found, "speeds that increase", "sort the points by speed")
            }
            (Some(table), _) if coefficients.len() == count => Ok(table),
            _ if coefficients.len() != count => {
                let (found, expected) =
                    (coefficients.len().to_string(), format!("{count}, one for each speed"));
                refuse(1, found, &expected, "give both lists the same length")
            }
            _ => refuse(0, count.to_string(), &format!("2 to {most} speeds"), "change the number of points"),
        }
    }

    /// Reads the motion of the head. For a recorded head, returns the place of the key in the file and the
    /// path of the recording. For a cosine or a constant speed, reads the numbers and returns `None`.
    pub(crate) fn read_drive(&mut self, written: &DriveFile) -> Result<Option<(String, String)>, SceneError> {
        let numbers = [
            ("amplitude_m", &written.amplitude_m),
            ("frequency_hz", &written.frequency_hz),
            ("delay_s", &written.delay_s),
            ("speed_m_per_s", &written.speed_m_per_s),
        ];
        let recording = written.recording.as_ref().map(|path| ("recording", self.place_of(path)));
        let speed = written.speed_m_per_s.as_ref().map(|speed| ("speed_m_per_s", self.place_of(speed)));
        if let Some((key, place)) = recording.clone().or(speed) {
            let mut others = numbers.into_iter().filter(|(other, value)| *other != key && value.is_some());
            if let Some((other, _)) = others.next() {
                let (found, advice) =
                    (format!("also `drive.{other}`"), "remove one: both say how the head moves");
                let expected = "a recording, a constant speed, or amplitude_m and frequency_hz";
                return Err(key_error(&place, &format!("drive.{key}"), found, expected, advice));
            }
        }
        if let (Some((_, place)), Some(path)) = (recording, &written.recording) {
            return Ok(Some((place, path.get_ref().clone())));
        }
        let read = |(key, value): (_, &Option<_>)| self.read_number(&format!("drive.{key}"), value.clone());
        numbers.into_iter().filter(|(key, _)| *key != "delay_s").try_for_each(read).map(|()| None)
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

/// Refuses a parameter of another friction law.
pub(super) fn check_law_key(place: &str, name: &str, law: &FrictionShape) -> Result<(), SceneError> {
    if law.has_parameter(name) {
        return Ok(());
    }
    let law = law.name();
    let own = LAW_KEYS.iter().find(|(other, _)| *other == law).map_or(&[][..], |(_, keys)| keys);
    let keys = if own.is_empty() { "speeds_m_per_s and coefficients".to_owned() } else { own.join(", ") };
    let others =
        LAW_KEYS.iter().filter(|(_, keys)| keys.contains(&name)).map(|(law, _)| format!("\"{law}\""));
    let advice = format!("leave it out, or choose law = {}", others.collect::<Vec<_>>().join(" or "));
    let expected = format!("parameters of this law: {keys}");
    Err(key_error(place, name, format!("the law \"{law}\""), &expected, &advice))
}

/// Whether a table belongs to a blade while the scene has a slider, or the reverse.
pub(super) fn of_other_mechanism(table: &str, is_slider: bool) -> bool {
    match table {
        "slider" => !is_slider,
        "blade" | "shoulder" | "contact" => is_slider,
        _ => false,
    }
}

/// Refuses a scene that lacks a quantity without a default. Quantities of a shoulder, mechanism or motion of
/// the head that the scene does not have are not required.
pub(super) fn check_complete(
    file: &str,
    values: &BTreeMap<&'static str, f64>,
    [is_slider, has_shoulder, recorded]: [bool; 3],
    law: &FrictionShape,
) -> Result<(), SceneError> {
    let constant_speed = values.contains_key("drive.speed_m_per_s");
    let absent = |p: &ModelParameter| {
        let table = p.name.split('.').next().unwrap_or_default();
        let is_speed = p.quantity == ParameterQuantity::DriveSpeed;
        (!has_shoulder && table == "shoulder")
            || (table == "drive" && (recorded || constant_speed || is_speed))
            || of_other_mechanism(table, is_slider)
            || !law.has_parameter(p.name)
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
