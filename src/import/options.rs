//! Options of an import: facts that the export itself does not contain.

use crate::import::error::ImportError;
use crate::import::reader::CoordinateUnit;
use crate::recording::files::YAxis;
use toml::Value;

/// Options of an import. If neither an option nor the file gives a fact that has no safe default, the import
/// is refused.
#[derive(Debug, Clone, Default)]
pub struct ImportOptions {
    /// Name of the recording, for messages and figures.
    pub name: String,
    /// Name of the format; `None` or `auto` detects it from the contents.
    pub format: Option<String>,
    /// Text encoding; `None` detects it from the contents.
    pub encoding: Option<String>,
    /// Rate at which the camera recorded, 1/s.
    pub frame_rate_hz: Option<f64>,
    /// Length of one unit of the file's coordinates.
    pub scale: Option<CoordinateScale>,
    /// Direction of y in the file.
    pub y_axis: Option<YAxis>,
    /// Exposure time of a frame, s.
    pub exposure_s: Option<f64>,
    /// Meaning of the time column; `None` stands for the default of the format, usually seconds of the
    /// recording.
    pub time: Option<TimeColumn>,
    /// Number of frames from one row to the next, if only every n-th frame was tracked; `None` means 1.
    pub frame_step: Option<usize>,
    /// Name of the track of the lip tip.
    pub tip: Option<String>,
    /// Name of the track of the head.
    pub head: Option<String>,
    /// Columns of a plain table.
    pub columns: Option<ColumnMap>,
    /// Confidence below which a position counts as missing.
    pub min_likelihood: Option<f64>,
    /// Whether the tilt of the camera is corrected in both tracks.
    pub level: bool,
    /// Table `[conditions]` of the recording.
    pub conditions: toml::Table,
    /// Name and text of the specification of a twin, if the export is synthetic.
    pub twin: Option<(String, String)>,
}

/// Largest frame step; with a larger one, no vibration could be seen.
const LARGEST_STEP: usize = 1000;

/// Meaning of a time column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeColumn {
    /// Seconds of the recording itself, from which the frame rate may be determined.
    Real,
    /// Milliseconds of the recording itself.
    Milliseconds,
    /// Frame numbers.
    Frames,
    /// Times of playback, which only count frames.
    Playback,
}

/// Length of one unit of the file's coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CoordinateScale {
    /// Coordinates are pixels; the value is the length that a pixel shows, m.
    MetresPerPixel(f64),
    /// Coordinates are lengths; the value is their unit, m.
    Unit(f64),
}

/// Largest relative difference between units that count as equal.
const SAME_UNIT: f64 = 1e-9;

/// Units of length by their symbol, m; `u`, the micro sign and the Greek mu all mean micro.
const LENGTH_UNITS: [(&str, f64); 6] =
    [("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6), ("\u{b5}m", 1e-6), ("\u{3bc}m", 1e-6)];

impl CoordinateScale {
    /// Reads `21.5um/px`, or a unit of length such as `mm`.
    ///
    /// # Errors
    /// [`ImportError::Option`] for anything else.
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
        let number = number.parse::<f64>().ok().filter(|n| n.is_finite() && *n > 0.0).ok_or_else(refuse)?;
        let unit = unit(name.trim()).ok_or_else(refuse)?;
        // a double cannot hold 1e-6 exactly: multiplying by it rounds twice, dividing by 1e6 rounds once
        Ok(Self::MetresPerPixel(number / (1.0 / unit).round()))
    }

    /// Whether coordinates in `unit` have this scale.
    pub(crate) fn agrees_with(self, unit: CoordinateUnit) -> bool {
        match (self, unit) {
            (Self::Unit(metres), CoordinateUnit::Metres(stated)) => (metres / stated - 1.0).abs() <= SAME_UNIT,
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

/// A column, by its number or by its name in the header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ColumnName {
    /// Number of the column, counted from 1.
    Number(usize),
    /// Name in the header row.
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

/// Columns of a plain table: pairs of key and column, in the order given.
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
/// Value of `frame=row`: the table has neither frame numbers nor times, and every row is a frame.
pub(crate) const ROW_COLUMN: &str = "row";

impl ColumnMap {
    /// Reads `time=1,tip-x=2,tip-y=3,head-x=4,head-y=5`; a column is given by its number, counted from 1, or
    /// by its name in the header.
    ///
    /// # Errors
    /// [`ImportError::Option`] naming the part at fault.
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

    /// The column of `key`.
    pub(crate) fn get(&self, key: &str) -> Option<&ColumnName> {
        self.0.iter().find(|(known, _)| *known == key).map(|(_, column)| column)
    }
}

impl ImportOptions {
    /// Reads `KEY=VALUE` into `[conditions]`; numbers and true/false keep their type.
    ///
    /// # Errors
    /// [`ImportError::Option`] if the key is missing or was given before.
    pub fn add_condition(&mut self, text: &str) -> Result<(), ImportError> {
        let refuse = |expected: &str| ImportError::option("--condition", text, expected);
        let pair = text.split_once('=').filter(|pair| !pair.0.trim().is_empty());
        let (key, value) = pair.ok_or_else(|| refuse("KEY=VALUE such as glass=wet"))?;
        let value = value.trim();
        let number = || value.parse::<f64>().ok().filter(|v| v.is_finite()).map(Value::Float);
        let truth = || value.parse::<bool>().ok().map(Value::Boolean);
        let whole = value.parse::<i64>().ok().map(Value::Integer);
        let typed = whole.or_else(number).or_else(truth).unwrap_or_else(|| Value::String(value.to_owned()));
        match self.conditions.insert(key.trim().to_owned(), typed) {
            Some(_) => Err(refuse("every key only once")),
            None => Ok(()),
        }
    }

    /// Reads `tip=NAME` or `head=NAME`.
    ///
    /// # Errors
    /// [`ImportError::Option`] for any other text, and for a point that was given before.
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

/// Refuses options with numbers outside their range.
///
/// # Errors
/// [`ImportError::Option`] naming the option.
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
