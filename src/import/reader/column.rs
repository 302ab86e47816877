//! Determines the meaning of a column (such as clock, coordinate of a point or confidence) and its unit from
//! its name in the header.

use crate::import::options::CoordinateScale;
use crate::text::parse_positive;

/// Names of columns of frame numbers, in lower case and without separators; the last three are the Japanese
/// words furemu (frame), furemu bango (frame number) and koma (picture of a film).
const FRAMES: &str = "frame frames frameno framenr framenumber framenum frameidx frameindex frameid frame# bild \
    bildnr bildnummer \u{30d5}\u{30ec}\u{30fc}\u{30e0} \u{30d5}\u{30ec}\u{30fc}\u{30e0}\u{756a}\u{53f7} \u{30b3}\u{30de}";
/// Names of columns of times, in lower case and without separators, with the unit of those that contain none.
const TIMES: [(&str, TimeUnit); 3] = [
    // (the first name in another script is the Japanese word jikan, time)
    (
        "t time zeit temps tempo tiempo \u{6642}\u{9593} seconds second sec timesec milliseconds millisecond msec ms \
         timems timemsec",
        TimeUnit::AssumedSeconds,
    ),
    // (a timestamp may be in seconds or milliseconds, and may count from 1970)
    ("timestamp", TimeUnit::Unknown),
    ("tick ticks", TimeUnit::Unreadable),
];
/// Names of the units of time, in lower case, with their lengths, s.
const TIME_UNITS: [(&str, f64); 10] = [
    ("s sec secs second seconds", 1.0),
    ("ms msec millis millisec millisecond milliseconds", 1e-3),
    ("h hr hrs hour hours", 3600.0),
    ("d day days", 86_400.0),
    ("min mins minute minutes", 60.0),
    ("us usec \u{b5}s \u{3bc}s micros microsec microsecond microseconds", 1e-6),
    ("ns nsec nanos nanosec nanosecond nanoseconds", 1e-9),
    ("cs", 1e-2),
    ("ds", 0.1),
    ("ks", 1000.0),
];
/// Units that are also words or names of points, in lower case. A column name that ends in one of the times
/// names a unit only if a name of times comes before it; lengths need brackets or a slash.
const TIMES_THAT_ARE_WORDS: &str = "min h hr d cs ds ks day";
const LENGTHS_THAT_ARE_WORDS: &str = "in ft foot feet";
/// Names of columns that name the object to which a row belongs, in lower case and without separators.
const KEYS: &str = "id track trackid trackno tracknr trackindex trajectory trajectoryid objectid objectno objectnr object \
    particle marker point pointid label name spot target ball cell";
const CONFIDENCES: &str = "confidence likelihood score conf";
/// Parts of column names that mark speeds, forces and other quantities that are not positions.
const NOT_POSITIONS: &str =
    "v vel velocity speed a acc accel acceleration f force d disp displacement delta sigma std err error";
/// Characters between the parts of a column name.
const SEPARATORS: [char; 5] = ['_', '.', '-', ' ', ':'];

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum ColumnMeaning {
    Frame,
    Time(TimeUnit),
    Key,
    /// A coordinate of a point; axis 0 is x, axis 1 is y. The name of the point is empty if the column is
    /// called only `x` or `y`.
    Coordinate {
        point: String,
        axis: usize,
        unit: Option<CoordinateUnit>,
    },
    Confidence {
        point: String,
    },
    Other,
}

impl ColumnMeaning {
    /// The meaning of a column name. Programs that write several data sets put the name of the data set
    /// before the column name (`VideoAnalysis: X Wrist (m)`); the part before the colon is then left out.
    pub(crate) fn parse(name: &str) -> Self {
        match (Self::parse_whole(name), name.split_once(": ")) {
            (Self::Other, Some((_, column))) => Self::parse_whole(column),
            (meaning, _) => meaning,
        }
    }

    /// The kind of clock in a column, frame numbers or times, from the column's name, the last part of the
    /// name, or the unit; `None` if the column is no clock.
    pub(crate) fn parse_clock(name: &str) -> Option<Self> {
        let is_clock = |meaning: &Self| matches!(meaning, Self::Frame | Self::Time(_));
        let unit = split_unit(name).1;
        let last = split_last_part(split_unit(name).0).map(|(_, last)| parse_clock(last, unit));
        match ColumnUnit::in_name(name) {
            Some(ColumnUnit::Time(unit)) => Some(Self::Time(unit)),
            _ => Some(Self::parse(name)).filter(is_clock).or(last.flatten()).filter(is_clock),
        }
    }

    fn parse_whole(name: &str) -> Self {
        let (base, unit) = split_unit(name);
        if let Some(clock) = parse_clock(base, unit) {
            return clock;
        }
        let plain = squeeze_name(base);
        if unit.is_none() && is_listed(KEYS, &plain) {
            return Self::Key;
        }
        if unit.is_none() && is_listed(CONFIDENCES, &plain) {
            return Self::Confidence { point: String::new() };
        }
        if let Some((point, last)) = split_last_part(base)
            && is_listed(CONFIDENCES, &last.to_lowercase())
        {
            return Self::Confidence { point: point.to_owned() };
        }
        match (parse_coordinate(base), unit.map(CoordinateUnit::parse)) {
            (None, _) | (_, Some(None)) => Self::Other,
            (Some((point, axis)), unit) => Self::Coordinate { point, axis, unit: unit.flatten() },
        }
    }

    /// Takes the unit from `text`, the cell below the column name, if the name itself has no unit. Returns
    /// whether a unit was taken.
    pub(crate) fn take_unit(&mut self, text: &str) -> bool {
        match self {
            Self::Coordinate { unit: unit @ None, .. } => {
                *unit = CoordinateUnit::parse(text);
                unit.is_some()
            }
            Self::Time(unit @ TimeUnit::AssumedSeconds) if !text.is_empty() => {
                *unit = TimeUnit::parse(text).unwrap_or(TimeUnit::Unknown);
                true
            }
            _ => false,
        }
    }
}

/// Splits a column name such as `x (mm)`, `x [mm]`, `x/mm` or `tip_x_px` into name and unit; the unit is
/// `None` if there is none.
fn split_unit(name: &str) -> (&str, Option<&str>) {
    let name = name.trim();
    for (open, close) in [('(', ')'), ('[', ']')] {
        if let Some((base, unit)) = name.strip_suffix(close).and_then(|rest| rest.rsplit_once(open)) {
            return (base.trim_end_matches([' ', '_']), Some(unit.trim()));
        }
    }
    // (only a name of times or of a coordinate may stand before the slash: `m/s` and `rate 1/s` are no times)
    let is_unit = |unit: &str| unit.split('/').all(|part| is_simple_unit(part) || starts_with_digit(part));
    let is_named = |(base, unit): &(&str, &str)| {
        is_unit(unit) && (is_name_of_times(base) || parse_coordinate(base.trim_end()).is_some())
    };
    if let Some((base, unit)) = name.split_once('/').filter(is_named) {
        return (base.trim_end(), Some(unit.trim()));
    }
    match name.rsplit_once(['_', ' ']) {
        Some((base, unit))
            if !base.is_empty()
                && is_simple_unit(unit)
                && !is_listed(LENGTHS_THAT_ARE_WORDS, &unit.to_lowercase())
                && (!is_listed(TIMES_THAT_ARE_WORDS, &unit.to_lowercase()) || is_name_of_times(base)) =>
        {
            (base, Some(unit))
        }
        _ => (name, None),
    }
}

/// Whether a text is a unit of length or of time, without a factor.
fn is_simple_unit(text: &str) -> bool {
    !starts_with_digit(text) && (CoordinateUnit::parse(text).is_some() || TimeUnit::parse(text).is_some())
}

fn starts_with_digit(text: &str) -> bool {
    text.trim_start().starts_with(|c: char| c.is_ascii_digit() || c == '.')
}

fn is_name_of_times(base: &str) -> bool {
    TIMES.iter().any(|(names, _)| is_listed(names, &squeeze_name(base)))
}

/// Whether a name of times has a factor behind it, such as `x1000` or `1e3`. (`t_1` is the name of a point.)
fn has_time_factor(base: &str) -> bool {
    let mut parts = base.split(SEPARATORS);
    let is_factor = |part: &str| {
        let number = part.trim_start_matches(['x', 'X', '*', '\u{d7}']);
        starts_with_digit(number)
            && (number.len() < part.len() || number.parse::<f64>().is_ok_and(|n| n >= 100.0))
    };
    parts.next().is_some_and(|first| first.len() > 1 && is_name_of_times(first)) && parts.any(is_factor)
}

fn parse_clock(base: &str, unit: Option<&str>) -> Option<ColumnMeaning> {
    let plain = squeeze_name(base);
    if is_listed(FRAMES, &plain) {
        return unit.is_none().then_some(ColumnMeaning::Frame);
    }
    if has_time_factor(base) {
        return Some(ColumnMeaning::Time(TimeUnit::Unreadable));
    }
    let (_, own) = TIMES.iter().find(|(names, _)| is_listed(names, &plain))?;
    Some(match (unit, own) {
        (Some(unit), _) if squeeze_name(unit).starts_with("frame") => ColumnMeaning::Frame,
        (Some(unit), _) => ColumnMeaning::Time(TimeUnit::parse(unit).unwrap_or(TimeUnit::Unreadable)),
        (None, own) => {
            let unit = plain.strip_prefix("time").unwrap_or(&plain);
            ColumnMeaning::Time(TimeUnit::parse(unit).unwrap_or(*own))
        }
    })
}

/// Name of the point, and axis (0 is x, 1 is y), from a column name such as `tip_x`, `tip.x`, `x_tip`, `X
/// tip` or `x`.
fn parse_coordinate(base: &str) -> Option<(String, usize)> {
    let axis = |part: &str| ["x", "y"].iter().position(|axis| part.eq_ignore_ascii_case(axis));
    if let Some(axis) = axis(base) {
        return Some((String::new(), axis));
    }
    let behind = split_last_part(base).and_then(|(point, last)| Some((point, axis(last)?)));
    let before = || base.split_once(SEPARATORS).and_then(|(first, point)| Some((point.trim(), axis(first)?)));
    let (point, axis) = behind.or_else(before).or_else(|| parse_joined_coordinate(base))?;
    let position = !point.is_empty()
        && !point.split(SEPARATORS).any(|part| is_listed(NOT_POSITIONS, &part.to_lowercase()));
    position.then(|| (point.to_owned(), axis))
}

/// Name of the point, and axis (0 is x, 1 is y), from a column name without separators: `TipX`, a word in
/// another script followed by `X`, or `x1`.
fn parse_joined_coordinate(base: &str) -> Option<(&str, usize)> {
    let is_number = |rest: &&str| !rest.is_empty() && rest.chars().all(|c| c.is_ascii_digit());
    if let Some(number) = base.strip_prefix(['x', 'X', 'y', 'Y']).filter(is_number) {
        return Some((number, usize::from(base.starts_with(['y', 'Y']))));
    }
    let axis = ['X', 'Y'].iter().position(|axis| base.ends_with(*axis))?;
    let point = &base[..base.len() - 1];
    // (in a word of capitals such as `MAX`, the last letter is not an axis)
    let ends_word = point.ends_with(|c: char| c.is_lowercase() || c.is_ascii_digit() || !c.is_ascii());
    ends_word.then_some((point, axis))
}

/// Splits a column name at its last separator.
fn split_last_part(name: &str) -> Option<(&str, &str)> {
    name.rsplit_once(SEPARATORS).map(|(point, last)| (point.trim_end_matches(SEPARATORS), last))
}

/// Whether `name` is one of the names in a list with blanks between them.
fn is_listed(list: &str, name: &str) -> bool {
    list.split(' ').any(|listed| listed == name)
}

/// The name in lower case, without separators.
pub(crate) fn squeeze_name(name: &str) -> String {
    name.chars().filter(|c| !SEPARATORS.contains(c)).flat_map(char::to_lowercase).collect()
}

// Units.

/// Unit of a file's times.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) enum TimeUnit {
    /// Length of the unit, s.
    Seconds(f64),
    /// Seconds, assumed because nearly every table contains seconds.
    #[default]
    AssumedSeconds,
    /// Unknown: the format allows several units, and the file does not name its unit.
    Unknown,
    /// The file names a unit that is not known.
    Unreadable,
}

impl TimeUnit {
    /// Length of the unit, s; 1 if it is not stated.
    pub(crate) fn seconds_or_one(self) -> f64 {
        if let Self::Seconds(seconds) = self { seconds } else { 1.0 }
    }

    /// Reads `s`, `sec`, `ms`, `0.1 ms`, ...; `None` for any other name.
    pub(crate) fn parse(name: &str) -> Option<Self> {
        let name = trim_brackets(name).to_lowercase();
        let (factor, symbol) = split_factor(&name)?;
        let (_, seconds) = TIME_UNITS.iter().find(|(names, _)| is_listed(names, symbol))?;
        Some(Self::Seconds(factor * seconds))
    }
}

/// Unit of a file's coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum CoordinateUnit {
    /// A pixel of unknown size.
    Pixel,
    /// A unit of length; the value is the length of the unit, m.
    Metres(f64),
}

impl CoordinateUnit {
    /// Reads `px`, `pixel`, `mm`, `0.1 mm`, `micron`, ...; `None` for any other name.
    pub(crate) fn parse(name: &str) -> Option<Self> {
        let name = trim_brackets(name).to_lowercase();
        let (factor, symbol) = split_factor(&name)?;
        let metres = match symbol {
            "px" | "pixel" | "pixels" => return (factor == 1.0).then_some(Self::Pixel),
            "micron" | "microns" | "micrometer" | "micrometre" => 1e-6,
            "nm" => 1e-9,
            "dm" => 0.1,
            "inch" | "in" => 0.0254,
            "ft" | "foot" | "feet" => 0.3048,
            // (a length per pixel is no unit of a column)
            symbol if symbol.contains('/') => return None,
            symbol => CoordinateScale::parse(symbol).ok()?.metres(),
        };
        Some(Self::Metres(factor * metres))
    }

    pub(crate) fn describe(self) -> String {
        match self {
            Self::Pixel => "pixels".to_owned(),
            Self::Metres(metres) => format!("units of {metres} m"),
        }
    }
}

/// Unit of a column, by the quantity that it measures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ColumnUnit {
    /// A pixel or a unit of length: the column may contain a coordinate.
    Coordinate(CoordinateUnit),
    /// A time.
    Time(TimeUnit),
    /// Another quantity, such as a speed, an angle or a force.
    Other,
}

/// Symbols of units that measure neither a length nor a time, in lower case. Units with a slash or a power,
/// such as `mm/s`, need no entry.
const OTHER_UNITS: &str = "deg degree degrees \u{b0} rad radians hz khz n mn kn v mv pa kpa mpa g kg % c";

impl ColumnUnit {
    /// Reads a unit; `None` for a text that is no unit.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let symbol = trim_brackets(text).to_lowercase();
        let derived = symbol.contains(['/', '^', '\u{b2}', '\u{b3}']) || is_number_with_word(&symbol);
        if let Some(unit) = CoordinateUnit::parse(text) {
            return Some(Self::Coordinate(unit));
        }
        if let Some(unit) = TimeUnit::parse(text) {
            return Some(Self::Time(unit));
        }
        (derived || is_listed(OTHER_UNITS, &symbol)).then_some(Self::Other)
    }

    /// The unit in the name of a column that contains times: `Clock_min`, `minutes`.
    pub(crate) fn of_times(name: &str) -> Option<Self> {
        /// Units that end other names too, such as `time_of_day`.
        const ENDS_OF_NAMES: &str = "d day";
        let last = split_last_part(name).map_or(name, |(_, last)| last);
        match ColumnMeaning::parse(name) {
            ColumnMeaning::Time(unit @ (TimeUnit::Seconds(_) | TimeUnit::Unreadable)) => {
                Some(Self::Time(unit))
            }
            _ => Self::in_name(name).or_else(|| {
                TimeUnit::parse(last)
                    .filter(|_| !is_listed(ENDS_OF_NAMES, &last.to_lowercase()))
                    .map(Self::Time)
            }),
        }
    }

    /// The unit in the name of a column.
    pub(crate) fn in_name(name: &str) -> Option<Self> {
        split_unit(name).1.and_then(Self::parse)
    }
}

/// Splits a unit such as `0.1 mm` into factor and symbol; the factor is 1 if there is none. `None` for a
/// number that is no factor.
fn split_factor(unit: &str) -> Option<(f64, &str)> {
    if !starts_with_digit(unit) {
        return Some((1.0, unit));
    }
    let (number, symbol) = unit.split_once(' ')?;
    let factor = parse_positive(number)?;
    Some((factor, symbol.trim()))
}

/// Whether a text is a number with a word behind it, such as `0.1 cubits`.
fn is_number_with_word(text: &str) -> bool {
    starts_with_digit(text) && text.ends_with(char::is_alphabetic)
}

/// A unit without the brackets around it.
fn trim_brackets(unit: &str) -> &str {
    unit.trim().trim_matches(['(', ')', '[', ']'])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(point: &str, axis: usize, unit: Option<CoordinateUnit>) -> ColumnMeaning {
        ColumnMeaning::Coordinate { point: point.to_owned(), axis, unit }
    }

    #[test]
    fn clocks_and_their_units() {
        for name in [
            "Bild",
            "Bild-Nr",
            "\u{30d5}\u{30ec}\u{30fc}\u{30e0}",
            "frame",
            "Frame",
            "frame_no",
            "Frame No.",
            "FrameIdx",
            "frame #",
            "time (frames)",
        ] {
            assert_eq!(ColumnMeaning::parse(name), ColumnMeaning::Frame, "{name}");
        }
        let times = [
            ("t", TimeUnit::AssumedSeconds),
            ("Time", TimeUnit::AssumedSeconds),
            ("timestamp", TimeUnit::Unknown),
            ("time (fortnights)", TimeUnit::Unreadable),
            ("time (1/100 s)", TimeUnit::Unreadable),
            ("time x1000 (s)", TimeUnit::Unreadable),
            ("time_s_x1000", TimeUnit::Unreadable),
            ("sec/100", TimeUnit::Unreadable),
            ("ticks", TimeUnit::Unreadable),
            ("time (h)", TimeUnit::Seconds(3600.0)),
            ("time_h", TimeUnit::Seconds(3600.0)),
            ("time_min", TimeUnit::Seconds(60.0)),
            ("t/min", TimeUnit::Seconds(60.0)),
            ("time_cs", TimeUnit::Seconds(1e-2)),
            ("time [0.1 ms]", TimeUnit::Seconds(1e-4)),
        ];
        let seconds = [
            "time_s",
            "time (s)",
            "t[s]",
            "Time [sec]",
            "seconds",
            "Zeit [s]",
            "Temps (s)",
            "\u{6642}\u{9593}(s)",
        ]
        .map(|name| (name, TimeUnit::Seconds(1.0)));
        let milliseconds =
            ["time_ms", "Time [ms]", "t (ms)", "Time_ms", "timestamp_ms", "t/ms", "Zeit/ms", "time_millis"]
                .map(|name| (name, TimeUnit::Seconds(1e-3)));
        for (name, unit) in times.into_iter().chain(seconds).chain(milliseconds) {
            assert_eq!(ColumnMeaning::parse(name), ColumnMeaning::Time(unit), "{name}");
        }
    }

    #[test]
    fn coordinates_in_every_spelling() {
        for name in ["tip_x", "tip.x", "tip-x", "tip X", "x_tip", "X_tip", "x tip", "x.tip"] {
            assert_eq!(ColumnMeaning::parse(name), at("tip", 0, None), "{name}");
        }
        for name in ["tip_y_px", "tip_y (px)", "tip.y [pixel]", "tip y [px]"] {
            assert_eq!(ColumnMeaning::parse(name), at("tip", 1, Some(CoordinateUnit::Pixel)), "{name}");
        }
        assert_eq!(ColumnMeaning::parse("tip_x_m"), at("tip", 0, Some(CoordinateUnit::Metres(1.0))));
        assert_eq!(ColumnMeaning::parse("X (mm)"), at("", 0, Some(CoordinateUnit::Metres(1e-3))));
        assert_eq!(ColumnMeaning::parse("tip_x/mm"), at("tip", 0, Some(CoordinateUnit::Metres(1e-3))));
        assert_eq!(ColumnMeaning::parse("x (0.1 mm)"), at("", 0, Some(CoordinateUnit::Metres(1e-4))));
        assert_eq!(ColumnMeaning::parse("x (dm)"), at("", 0, Some(CoordinateUnit::Metres(0.1))));
        for name in ["vx mm/s", "v_mm/s", "rad/s", "frames/s", "m/s", "rate 1/s", "foot", "time_of_day"] {
            assert_eq!(ColumnMeaning::parse_clock(name), None, "{name}");
        }
        for name in ["x_h", "x_min", "X_H", "x_Min", "x_foot"] {
            let point = name.split_once('_').unwrap().1;
            assert_eq!(ColumnMeaning::parse(name), at(point, 0, None), "{name}");
        }
        assert_eq!(ColumnMeaning::parse("m_x"), at("m", 0, None));
        assert_eq!(ColumnMeaning::parse("x_min"), at("min", 0, None));
        assert_eq!(ColumnMeaning::parse("left_blade_tip_y"), at("left_blade_tip", 1, None));
        assert_eq!(
            ColumnMeaning::parse("tip_likelihood"),
            ColumnMeaning::Confidence { point: "tip".to_owned() }
        );
        for name in ["TipX", "Tip_X", "Tip X"] {
            assert_eq!(ColumnMeaning::parse(name), at("Tip", 0, None), "{name}");
        }
        assert_eq!(
            ColumnMeaning::parse("\u{5148}\u{7aef}Y(mm)"),
            at("\u{5148}\u{7aef}", 1, Some(CoordinateUnit::Metres(1e-3)))
        );
        assert_eq!(
            [ColumnMeaning::parse("x1"), ColumnMeaning::parse("Y12")],
            [at("1", 0, None), at("12", 1, None)]
        );
        for name in ["vX", "dY", "MAX", "MaxX2", "x1a", "x1.5", "Index", "lux"] {
            assert_eq!(ColumnMeaning::parse(name), ColumnMeaning::Other, "{name}");
        }
        for name in [
            "vx",
            "px",
            "v_x",
            "x_velocity",
            "tip_v_x",
            "tip_vx",
            "x (furlong)",
            "area",
            "",
            "_x",
            "x_",
            "_",
            "x (s)",
            "frame_ms",
            "(mm)",
        ] {
            assert_eq!(ColumnMeaning::parse(name), ColumnMeaning::Other, "{name}");
        }
    }
}
