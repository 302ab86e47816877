//! What the user says about an export, because the export itself does not.

use crate::import::error::ImportError;
use crate::recording::files::YAxis;

/// What the user says about an export. `None` is refused where no default is safe.
#[derive(Debug, Clone, Default)]
pub struct ImportOptions {
    /// Name of the recording, for messages and figures.
    pub name: String,
    /// Name of the format; `None` or `auto` finds it from the content.
    pub format: Option<String>,
    /// Text encoding; `None` finds it from the content.
    pub encoding: Option<String>,
    /// Rate at which the camera recorded, 1/s.
    pub frame_rate_hz: Option<f64>,
    /// Length that a unit of the file's coordinates stands for.
    pub scale: Option<CoordinateScale>,
    /// Direction of y in the file.
    pub y_axis: Option<YAxis>,
    /// Exposure of a frame, s.
    pub exposure_s: Option<f64>,
    /// What the time column means; `None` takes it for what the format says, seconds of the recording in
    /// nearly all.
    pub time: Option<TimeColumn>,
    /// Frames from one row to the next where only every n-th frame was tracked; `None` is 1.
    pub frame_step: Option<usize>,
    /// Track that is the lip tip.
    pub tip: Option<String>,
    /// Track that is the head.
    pub head: Option<String>,
    /// Columns of a plain table.
    pub columns: Option<ColumnMap>,
    /// Confidence below which a position counts as missing.
    pub min_likelihood: Option<f64>,
    /// Whether the tilt of the camera is taken out of both tracks.
    pub level: bool,
    /// `[conditions]` of the recording.
    pub conditions: toml::Table,
    /// Name and text of the specification of a twin, where the export is synthetic.
    pub twin: Option<(String, String)>,
}

/// Most frames from row to row: nobody tracks every thousandth frame to see vibration.
const LARGEST_STEP: usize = 1000;

/// What a time column means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeColumn {
    /// Seconds of the recording itself: the rate may be taken from them.
    Real,
    /// Milliseconds of the recording itself.
    Milliseconds,
    /// Numbers of frames.
    Frames,
    /// Times of playback: they only count frames.
    Playback,
}

/// Length of one unit of the file's coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CoordinateScale {
    /// Coordinates are pixels, each showing this length, m.
    MetresPerPixel(f64),
    /// Coordinates are lengths in a unit of this many metres.
    Unit(f64),
}

/// Length units by their sign; `u`, the micro sign and the Greek mu all mean micro.
const LENGTH_UNITS: [(&str, f64); 6] =
    [("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6), ("\u{b5}m", 1e-6), ("\u{3bc}m", 1e-6)];

impl CoordinateScale {
    /// Reads `21.5um/px` or a length unit such as `mm`.
    ///
    /// # Errors
    /// [`ImportError::Option`] for anything else.
    pub fn parse(text: &str) -> Result<Self, ImportError> {
        let refuse = || {
            ImportError::option(
                "--scale",
                text,
                "a length a pixel such as 21.5um/px, or the unit of the file's coordinates: m, cm, mm or um",
            )
        };
        let unit = |name: &str| LENGTH_UNITS.iter().find(|unit| unit.0 == name).map(|unit| unit.1);
        let Some(length) = text.trim().strip_suffix("/px") else {
            return unit(text.trim()).map(Self::Unit).ok_or_else(refuse);
        };
        let digits = length
            .find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | 'e' | 'E' | '-' | '+')))
            .ok_or_else(refuse)?;
        let number = length
            .get(..digits)
            .and_then(|n| n.parse::<f64>().ok())
            .filter(|n| n.is_finite() && *n > 0.0)
            .ok_or_else(refuse)?;
        let unit = length.get(digits..).and_then(|name| unit(name.trim())).ok_or_else(refuse)?;
        // the product of a decimal number and 1e-6 is off by a rounding; the quotient by 1e6 is not
        Ok(Self::MetresPerPixel(number / (1.0 / unit).round()))
    }

    /// Metres of one unit of the file.
    pub(crate) fn metres(self) -> f64 {
        match self {
            Self::MetresPerPixel(metres) | Self::Unit(metres) => metres,
        }
    }
}

/// A column by its 1-based number or the name in the header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ColumnName {
    /// 1-based number.
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

/// Columns of a plain table: key and column, in the order given.
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
/// `frame=row`: the table has no column of frames or times, every row is a frame.
pub(crate) const ROW_COLUMN: &str = "row";

impl ColumnMap {
    /// Reads `time=1,tip-x=2,tip-y=3,head-x=4,head-y=5`; a column is a 1-based number or a name of the
    /// header.
    ///
    /// # Errors
    /// [`ImportError::Option`] naming the part at fault.
    pub fn parse(text: &str) -> Result<Self, ImportError> {
        let refuse = |found: &str, expected: String| ImportError::option("--columns", found, expected);
        let mut columns: Vec<(&'static str, ColumnName)> = vec![];
        for part in text.split(',').map(str::trim).filter(|part| !part.is_empty()) {
            let pair = part.split_once('=').filter(|(_, column)| !column.trim().is_empty());
            let (key, column) = pair
                .ok_or_else(|| refuse(part, "KEY=COLUMN pairs such as time=1,tip-x=2,head-x=4".to_owned()))?;
            let known = COLUMN_KEYS.into_iter().find(|known| *known == key.trim());
            let key = known.ok_or_else(|| {
                refuse(
                    key,
                    format!("a known key; {}", crate::toml_file::suggest_key(key.trim(), &COLUMN_KEYS)),
                )
            })?;
            if columns.iter().any(|(seen, _)| *seen == key) {
                return Err(refuse(part, format!("the key `{key}` only once")));
            }
            let column = match column.trim().parse::<usize>() {
                Ok(0) => return Err(refuse(part, "column numbers from 1".to_owned())),
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
                 if every row is a frame"
                    .to_owned(),
            ));
        }
        if columns.get("time").is_some() && columns.get("time-ms").is_some() {
            return Err(refuse(text, "one of time= (seconds) and time-ms=".to_owned()));
        }
        let (named, listed) = (columns.get("tip-x").or(columns.get("head-x")), columns.get("x"));
        if named.is_none() && listed.is_none() {
            return Err(refuse(
                text,
                "the column of at least one point along the sweep: tip-x= or head-x= (or x= and track= where \
                 the rows name their point)".to_owned(),
            ));
        }
        if named.is_some() && listed.is_some() {
            return Err(refuse(text, "either tip-x= and head-x=, or x= with track=".to_owned()));
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
    /// [`ImportError::Option`] when there is no key, or it came before.
    pub fn add_condition(&mut self, text: &str) -> Result<(), ImportError> {
        let refuse = |expected: &str| ImportError::option("--condition", text, expected);
        let (key, value) = text
            .split_once('=')
            .filter(|pair| !pair.0.trim().is_empty())
            .ok_or_else(|| refuse("KEY=VALUE such as glass=wet"))?;
        let value = value.trim();
        let number = || value.parse::<f64>().ok().filter(|v| v.is_finite()).map(toml::Value::Float);
        let typed = value
            .parse::<i64>()
            .ok()
            .map(toml::Value::Integer)
            .or_else(number)
            .or_else(|| value.parse::<bool>().ok().map(toml::Value::Boolean));
        let typed = typed.unwrap_or_else(|| toml::Value::String(value.to_owned()));
        match self.conditions.insert(key.trim().to_owned(), typed) {
            Some(_) => Err(refuse("every key only once")),
            None => Ok(()),
        }
    }

    /// Reads `tip=NAME` or `head=NAME`.
    ///
    /// # Errors
    /// [`ImportError::Option`] for another point, or one given before.
    pub(crate) fn add_point(&mut self, text: &str) -> Result<(), ImportError> {
        let refuse = |expected: &str| ImportError::option("--point", text, expected);
        let (point, track) = text
            .split_once('=')
            .filter(|pair| !pair.1.trim().is_empty())
            .ok_or_else(|| refuse("tip=NAME or head=NAME"))?;
        let slot = match point.trim() {
            "tip" => &mut self.tip,
            "head" => &mut self.head,
            _ => {
                return Err(refuse(
                    "tip=NAME or head=NAME: the points of a recording are the lip tip and the head",
                ));
            }
        };
        match slot.replace(track.trim().to_owned()) {
            Some(_) => Err(refuse("every point only once")),
            None => Ok(()),
        }
    }
}

/// Rates of any camera, frames/s: from time lapse to well beyond the fastest.
const RATES_HZ: std::ops::RangeInclusive<f64> = 1e-3..=1e9;

/// Refuses numbers that no camera has.
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
        return Err(ImportError::option(
            "--frame-step",
            found,
            format!("1 to {LARGEST_STEP} frames from row to row"),
        ));
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
