//! Options of an import. They give facts that the exported file itself does not contain.

use crate::import::error::ImportError;
use crate::import::reader::CoordinateUnit;
use crate::recording::files::YAxis;
use crate::text::{parse_finite, parse_positive};
use toml::Value;

/// Options of an import. Some facts, such as the frame rate, have no safe default. If neither an option nor
/// the file gives such a fact, the import is refused.
#[derive(Debug, Clone, Default)]
pub struct ImportOptions {
    /// Name of the recording, for messages and figures.
    pub name: String,
    /// Name of the format; `None` or `auto` detects it from the contents.
    pub format: Option<String>,
    /// Text encoding; `None` detects it from the contents.
    pub encoding: Option<String>,
    /// Rate at which the camera recorded, 1/s; not the rate of playback.
    pub frame_rate_hz: Option<f64>,
    /// Length of one unit of the coordinates in the file; `None` uses the unit that the file states.
    pub scale: Option<CoordinateScale>,
    /// Direction of y in the file: up or down.
    pub y_axis: Option<YAxis>,
    /// Exposure time of a frame, s.
    pub exposure_s: Option<f64>,
    /// Meaning of the time column; `None` uses the default of the format, usually real time in seconds.
    pub time: Option<TimeColumn>,
    /// Number of frames from one row to the next, if only every n-th frame was tracked; `None` means 1.
    pub frame_step: Option<usize>,
    /// Name of the track of the lip tip.
    pub tip: Option<String>,
    /// Name of the track of the head.
    pub head: Option<String>,
    /// Meaning of the columns of a plain table, as given with `--columns`.
    pub columns: Option<ColumnMap>,
    /// Confidence, from 0 to 1, below which a position counts as missing.
    pub min_likelihood: Option<f64>,
    /// Whether positions that nobody tracked count as missing, such as repeated or interpolated ones.
    pub drop_untracked: bool,
    /// Whether the positions of tip and head are rotated to correct the tilt of the camera.
    pub level: bool,
    /// Contents of the table `[conditions]` in the description of the recording.
    pub conditions: toml::Table,
    /// File name and text of the specification of the twin from which the export was made; `None` if a camera
    /// took the recording.
    pub twin: Option<(String, String)>,
}

/// Largest allowed frame step; with a larger step, no vibration could be resolved.
const LARGEST_STEP: usize = 1000;

/// Meaning of the numbers in a time column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeColumn {
    /// Seconds of real time; the frame rate may be determined from them.
    Real,
    /// Milliseconds of real time.
    Milliseconds,
    /// Frame numbers instead of times.
    Frames,
    /// Times of playback. They only count frames, and do not show the rate at which the camera recorded.
    Playback,
}

/// Length of one unit of the coordinates in a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CoordinateScale {
    /// The coordinates are pixels; the value is the length that one pixel shows, m.
    MetresPerPixel(f64),
    /// The coordinates are lengths; the value is the length of their unit, m, e.g. 1e-3 for millimetres.
    Unit(f64),
}

/// Largest allowed relative difference between the lengths of two units that count as equal.
const SAME_UNIT: f64 = 1e-9;

/// Units of length by their symbol, m; `u`, the micro sign and the Greek mu all mean micro.
const LENGTH_UNITS: [(&str, f64); 6] =
    [("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6), ("\u{b5}m", 1e-6), ("\u{3bc}m", 1e-6)];

impl CoordinateScale {
    /// Reads a length per pixel such as `21.5um/px`, or a unit of length such as `mm`.
    ///
    /// # Errors
    /// [`ImportError::Other`] for any other text.
    pub fn parse(text: &str) -> Result<Self, ImportError> {
        let expected =
            "a length a pixel such as 21.5um/px, or the unit of the file's coordinates: m, cm, mm or um";
        let refuse = || ImportError::option("--scale", text, expected);
        let unit = |name: &str| LENGTH_UNITS.iter().find(|unit| unit.0 == name).map(|unit| unit.1);
        let Some(length) = text.trim().strip_suffix("/px") else {
            return unit(text.trim()).map(Self::Unit).ok_or_else(refuse);
        };
        let is_digit = |c: char| c.is_ascii_digit() || matches!(c, '.' | 'e' | 'E' | '-' | '+');
        let (number, name) = length.split_at(length.find(|c| !is_digit(c)).ok_or_else(refuse)?);
        let number = parse_positive(number).ok_or_else(refuse)?;
        let unit = unit(name.trim()).ok_or_else(refuse)?;
        // 1e-6 is not exact in binary: multiplying by it rounds twice, dividing by 1e6 rounds only once
        Ok(Self::MetresPerPixel(number / (1.0 / unit).round()))
    }

    /// Whether this scale is right for coordinates in `unit`.
    pub(crate) fn agrees_with(self, unit: CoordinateUnit) -> bool {
        match (self, unit) {
            (Self::Unit(metres), CoordinateUnit::Metres(stated)) => {
                (metres / stated - 1.0).abs() <= SAME_UNIT
            }
            (Self::MetresPerPixel(_), CoordinateUnit::Pixel) => true,
            _ => false,
        }
    }

    /// The scale in words.
    pub(crate) fn describe(self) -> String {
        match self {
            Self::MetresPerPixel(metres) => format!("{metres} m/px"),
            Self::Unit(metres) => CoordinateUnit::Metres(metres).describe(),
        }
    }

    /// Length of one unit of the coordinates in the file, m.
    pub(crate) fn metres(self) -> f64 {
        match self {
            Self::MetresPerPixel(metres) | Self::Unit(metres) => metres,
        }
    }
}

/// A column of a table, given by its number or by its name in the header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ColumnName {
    /// Number of the column, counted from 1.
    Number(usize),
    /// Name of the column in the header row.
    Name(String),
}

impl std::fmt::Display for ColumnName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Name(name) => write!(f, "{name}"),
        }
    }
}

/// Meaning of the columns of a plain table: pairs of a key such as `tip-x` and a column, in the order in
/// which the user gave them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColumnMap(pub Vec<(&'static str, ColumnName)>);

pub(crate) const COLUMN_KEYS: [&str; 13] = [
    "frame",
    "time",
    "time-ms",
    "tip-x",
    "tip-y",
    "head-x",
    "head-y",
    "tip-confidence",
    "head-confidence",
    "track",
    "x",
    "y",
    "confidence",
];
/// Column name in `frame=row`, which means that the table has neither frame numbers nor times and that every
/// row is one frame.
pub(crate) const ROW_COLUMN: &str = "row";

impl ColumnMap {
    /// Reads text such as `time=1,tip-x=2,tip-y=3,head-x=4,head-y=5`. A column is given by its number,
    /// counted from 1, or by its name in the header.
    ///
    /// # Errors
    /// [`ImportError::Other`], which shows the faulty part of the text.
    pub fn parse(text: &str) -> Result<Self, ImportError> {
        let refuse = |found: &str, expected: &str| ImportError::option("--columns", found, expected);
        let mut columns: Vec<(&'static str, ColumnName)> = vec![];
        for part in text.split(',').map(str::trim).filter(|part| !part.is_empty()) {
            let pair = part.split_once('=').filter(|(_, column)| !column.trim().is_empty());
            let (key, column) =
                pair.ok_or_else(|| refuse(part, "KEY=COLUMN pairs such as time=1,tip-x=2,head-x=4"))?;
            let known = COLUMN_KEYS.into_iter().find(|known| *known == key.trim());
            let nearest = || crate::toml_file::suggest_key(key.trim(), &COLUMN_KEYS);
            let key = known.ok_or_else(|| refuse(key, &format!("a known key; {}", nearest())))?;
            if columns.iter().any(|(seen, _)| *seen == key) {
                return Err(refuse(part, &format!("the key `{key}` only once")));
            }
            let column = match column.trim().parse::<usize>() {
                Ok(0) => return Err(refuse(part, "column numbers from 1")),
                Ok(number) => ColumnName::Number(number),
                Err(_) => ColumnName::Name(column.trim().to_owned()),
            };
            columns.push((key, column));
        }
        let columns = Self(columns);
        if columns.get("frame").or(columns.get("time")).or(columns.get("time-ms")).is_none() {
            return Err(refuse(
                text,
                "the column that numbers or times the rows: frame=, time= (seconds) or time-ms=; frame=row \
                 if every row is a frame",
            ));
        }
        if columns.get("time").is_some() && columns.get("time-ms").is_some() {
            return Err(refuse(text, "one of time= (seconds) and time-ms="));
        }
        let (named, listed) = (columns.get("tip-x").or(columns.get("head-x")), columns.get("x"));
        if named.is_none() && listed.is_none() {
            return Err(refuse(
                text,
                "the column of at least one point along the sweep: tip-x= or head-x= (or x= and track= where \
                 the rows name their point)",
            ));
        }
        if named.is_some() && listed.is_some() {
            return Err(refuse(text, "either tip-x= and head-x=, or x= with track="));
        }
        Ok(columns)
    }

    /// The column that the user gave for `key`.
    pub(crate) fn get(&self, key: &str) -> Option<&ColumnName> {
        self.0.iter().find(|(known, _)| *known == key).map(|(_, column)| column)
    }
}

impl ImportOptions {
    /// Adds `KEY=VALUE` to the table `[conditions]`. A number, `true` or `false` is stored with its type, any
    /// other value as text.
    ///
    /// # Errors
    /// [`ImportError::Other`] if the key is missing or was given before.
    pub fn add_condition(&mut self, text: &str) -> Result<(), ImportError> {
        let refuse = |expected: &str| ImportError::option("--condition", text, expected);
        let pair = text.split_once('=').filter(|pair| !pair.0.trim().is_empty());
        let (key, value) = pair.ok_or_else(|| refuse("KEY=VALUE such as glass=wet"))?;
        let value = value.trim();
        let number = || parse_finite(value).map(Value::Float);
        let truth = || value.parse::<bool>().ok().map(Value::Boolean);
        let whole = value.parse::<i64>().ok().map(Value::Integer);
        let typed = whole.or_else(number).or_else(truth).unwrap_or_else(|| Value::String(value.to_owned()));
        match self.conditions.insert(key.trim().to_owned(), typed) {
            Some(_) => Err(refuse("every key only once")),
            None => Ok(()),
        }
    }

    /// Reads `tip=NAME` or `head=NAME`, where `NAME` is the name of a track.
    ///
    /// # Errors
    /// [`ImportError::Other`] for any other text, or if the point was given before.
    pub(crate) fn add_point(&mut self, text: &str) -> Result<(), ImportError> {
        let refuse = |expected: &str| ImportError::option("--point", text, expected);
        let pair = text.split_once('=').filter(|pair| !pair.1.trim().is_empty());
        let (point, track) = pair.ok_or_else(|| refuse("tip=NAME or head=NAME"))?;
        let slot = match point.trim() {
            "tip" => &mut self.tip,
            "head" => &mut self.head,
            _ => {
                let expected =
                    "tip=NAME or head=NAME: the points of a recording are the lip tip and the head";
                return Err(refuse(expected));
            }
        };
        match slot.replace(track.trim().to_owned()) {
            Some(_) => Err(refuse("every point only once")),
            None => Ok(()),
        }
    }
}

/// Range of accepted frame rates, 1/s: from time lapse to well above the fastest camera.
const RATES_HZ: std::ops::RangeInclusive<f64> = 1e-3..=1e9;

/// Refuses options whose numbers are outside the allowed range.
///
/// # Errors
/// [`ImportError::Other`], which names the option.
pub(crate) fn check_options(options: &ImportOptions) -> Result<(), ImportError> {
    let positive = [("--frame-rate-hz", options.frame_rate_hz), ("--exposure-s", options.exposure_s)];
    for (option, value) in positive {
        if let Some(found) = value.filter(|v| !(v.is_finite() && *v > 0.0)) {
            return Err(ImportError::option(option, found, "a finite number above 0"));
        }
    }
    if let Some(found) = options.frame_rate_hz.filter(|rate| !RATES_HZ.contains(rate)) {
        let expected = format!("{:e} to {:e} frames/s", RATES_HZ.start(), RATES_HZ.end());
        return Err(ImportError::option("--frame-rate-hz", format!("{found:e}"), expected));
    }
    if let (Some(rate), Some(exposure)) = (options.frame_rate_hz, options.exposure_s)
        && exposure * rate > 1.0 + 1e-9
    {
        let expected = format!("at most the time of a frame, {} s at {rate} frames/s", 1.0 / rate);
        return Err(ImportError::option("--exposure-s", exposure, expected));
    }
    if let Some(found) = options.min_likelihood.filter(|v| !(0.0..=1.0).contains(v)) {
        return Err(ImportError::option("--min-likelihood", found, "a number from 0 to 1"));
    }
    if let Some(found) = options.frame_step.filter(|step| !(1..=LARGEST_STEP).contains(step)) {
        let expected = format!("1 to {LARGEST_STEP} frames from row to row");
        return Err(ImportError::option("--frame-step", found, expected));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_lengths_a_pixel_or_units() {
        assert_eq!(CoordinateScale::parse("21.5um/px"), Ok(CoordinateScale::MetresPerPixel(2.15e-5)));
        assert_eq!(CoordinateScale::parse("0.02 mm/px"), Ok(CoordinateScale::MetresPerPixel(2e-5)));
        assert_eq!(CoordinateScale::parse("mm"), Ok(CoordinateScale::Unit(1e-3)));
        assert_eq!(CoordinateScale::parse("\u{b5}m"), Ok(CoordinateScale::Unit(1e-6)));
        for text in ["21.5", "inch", "-1um/px", "0mm/px", "1e999m/px", "/px", "5/px", ""] {
            assert!(CoordinateScale::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn columns_name_the_part_at_fault() {
        let says = |text: &str| ColumnMap::parse(text).unwrap_err().to_string();
        assert_eq!(
            says("time=1,tipx=2"),
            "--columns: found `tipx`, expected a known key; did you mean `tip-x`?"
        );
        assert!(says("tip-x=2").contains("frame=, time= (seconds) or time-ms="));
        assert!(says("time=1,tip-x=0").contains("from 1"));
        assert!(says("time=1,head-y=2").contains("tip-x= or head-x="));
        assert!(says("time=1,time=2,tip-x=3").contains("only once"));
        let columns = ColumnMap::parse("time=1, tip-x=X (cm)").unwrap();
        assert_eq!(columns.get("tip-x"), Some(&ColumnName::Name("X (cm)".to_owned())));
    }

    #[test]
    fn conditions_keep_their_types() {
        let mut options = ImportOptions::default();
        for text in ["glass=wet", "speed_m_per_s=0.5", "run=3"] {
            options.add_condition(text).unwrap();
        }
        assert_eq!(options.conditions.to_string(), "glass = \"wet\"\nrun = 3\nspeed_m_per_s = 0.5\n");
        assert!(options.add_condition("run=4").is_err());
    }
}
