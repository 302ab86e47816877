//! Reads the `.rd` files of Frame-DIAS (DKH): rows of coordinates below a line of counts. A companion `.set`
//! file contains the names of the points and the rate of the camera.

use crate::import::error::{ImportError, ImportResult};
use crate::import::format::FileFormat;
use crate::import::options::{ImportOptions, TimeColumn};
use crate::import::reader::rate::RATE_AGREEMENT;
use crate::import::reader::{
    CellNumber, Clock, DelimitedTable, Document, Fact, Facts, LostRule, PointCells, TableLayout, TimeUnit,
    TrackFile,
};
use crate::import::source::base_name;

/// Number of cells in the first line: number of frames, number of points, and time from frame to frame in
/// seconds.
const COUNTS: usize = 3;
/// Extension of the file with the table.
const EXTENSION: &str = ".rd";
/// Keys in the `.set` file: recording rate (this one), names of the points, and interval of the recorded
/// frames.
const RATE: &str = "CameraSpeed";
const NAMES: &str = "PointName";
const INTERVAL: &str = "RecInterval";
/// Longest time from frame to frame that is accepted, s. If the third number in the first line is larger, it
/// has another meaning, and the file is not one of Frame-DIAS.
const LONGEST_STEP_S: f64 = 10.0;

pub(crate) struct FrameDias;

impl FileFormat for FrameDias {
    fn name(&self) -> &'static str {
        "framedias"
    }

    /// Recognises a file by its first line. The file contains no column names, so the counts in that line
    /// have to match the rows below, or the extension has to be `.rd`.
    fn recognises(&self, document: &Document) -> Option<String> {
        let table = document.table.as_ref().ok()?;
        let counts = FrameDiasCounts::find(table)?;
        let cells = table.head.get(1)?.used_width();
        let fits = cells != COUNTS && cells.is_multiple_of(2) && counts.points == (cells / 2) as f64;
        let named = document.file.to_lowercase().ends_with(EXTENSION);
        let line = table.head.first()?.line;
        let FrameDiasCounts { frames, points, step_s } = counts;
        (fits || named)
            .then(|| format!("line {line} counts {frames} frames of {points} points, {step_s} s apart"))
    }

    fn read<'a>(&self, document: &'a Document<'a>, options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
        let table = document.table()?;
        let Some(counts) = FrameDiasCounts::find(table) else {
            let problem = format!(
                "found `{}`, expected the numbers of frames and points and the seconds from frame to frame, such \
                 as 3000,2,0.0005",
                table.first_texts().join(",")
            );
            return refuse_row(table, 0, &problem, "save the two-dimensional coordinates (.rd) again");
        };
        let points = count_points(table, counts)?;
        let settings = FrameDiasSettings::from_companion(document);
        let names = settings.names(table, points)?;
        let cells = 2 * points;
        let lost = LostRule { cell: None, is: |x, y| x == 0.0 && y == 0.0, words: "at exactly (0, 0)" };
        let point = |(index, name): (usize, String)| PointCells::new(name, 2 * index, Some(2 * index + 1));
        let points = names.into_iter().enumerate().map(point).collect();
        let layout = TableLayout { lost: vec![lost], ..TableLayout::new(1, cells, points) };
        let facts = Facts {
            frame_rate_hz: settings.frame_rate(table, counts, options)?,
            time: TimeUnit::Seconds(1.0),
            ..Facts::default()
        };
        let mut export = layout.read_tracks(document, table, facts)?;
        check_frame_count(table, counts, &export)?;
        if counts.step_s > 0.0 {
            for clock in &mut export.clocks {
                let time_s = |frame: Option<f64>| frame.map(|frame| frame * counts.step_s);
                clock.time = clock.frame.as_ref().map(|frames| frames.iter().map(time_s).collect());
            }
        }
        export.notes.extend(settings.notes());
        Ok(export)
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct FrameDiasCounts {
    frames: f64,
    points: f64,
    step_s: f64,
}

impl FrameDiasCounts {
    fn find(table: &DelimitedTable) -> Option<Self> {
        let row = table.head.first()?;
        let value = |cell: usize| match table.parse_cell(row.cells.get(cell)?) {
            CellNumber::Value(value) => Some(value),
            _ => None,
        };
        let counts = Self { frames: value(0)?, points: value(1)?, step_s: value(2)? };
        let count = |value: f64| value >= 1.0 && value.fract() == 0.0;
        (row.used_width() == COUNTS
            && count(counts.frames)
            && count(counts.points)
            && (0.0..=LONGEST_STEP_S).contains(&counts.step_s))
        .then_some(counts)
    }
}

/// Returns an error that refuses the table and names the line of a row; `row` is its index in
/// `DelimitedTable::head`.
fn refuse_row<T>(table: &DelimitedTable, row: usize, problem: &str, advice: &str) -> ImportResult<T> {
    let line = table.head.get(row).map_or(1, |row| row.line);
    Err(ImportError::columns(table.file, line, problem, advice))
}

/// Number of points in a row. It must be equal to the number of points in the first line.
fn count_points(table: &DelimitedTable, counts: FrameDiasCounts) -> ImportResult<usize> {
    let row = table.head.get(1).ok_or_else(|| ImportError::header_only(table.file, 1))?;
    let cells = row.used_width();
    if cells.is_multiple_of(2) && (cells / 2) as f64 == counts.points {
        return Ok(cells / 2);
    }
    let problem = format!(
        "found {cells} coordinates in the row, expected x and y of the {} points that the first line counts",
        counts.points
    );
    let advice =
        "save the two-dimensional coordinates (.rd) again: three-dimensional ones (.3d) are another file";
    refuse_row(table, 1, &problem, advice)
}

fn check_frame_count(
    table: &DelimitedTable,
    counts: FrameDiasCounts,
    export: &TrackFile,
) -> ImportResult<()> {
    let rows = export.clocks.first().map_or(0, Clock::len);
    if rows as f64 == counts.frames {
        return Ok(());
    }
    let problem = format!(
        "found {rows} rows of coordinates, expected the {} frames that the first line counts",
        counts.frames
    );
    refuse_row(table, 0, &problem, "the file is cut short or was edited: save it again")
}

/// Contents of the companion `.set` file; every field is empty if there is no such file.
#[derive(Debug, Clone, Default, PartialEq)]
struct FrameDiasSettings {
    file: Option<String>,
    rate_hz: Option<f64>,
    /// Whether only some of the camera's frames were recorded.
    interval: bool,
    names: Vec<String>,
}

impl FrameDiasSettings {
    fn from_companion(document: &Document) -> Self {
        let found = document.companions.iter().find(|(name, _)| name.to_lowercase().ends_with(".set"));
        found.map_or_else(Self::default, |(name, text)| Self::parse(name, text))
    }

    fn parse(file: &str, text: &str) -> Self {
        let entries = || text.lines().filter_map(|line| line.split_once('='));
        let value = |key: &str| entries().find(|(name, _)| name.trim() == key).map(|(_, value)| value.trim());
        let number = |key: &str| {
            let number = value(key)?.trim_matches('"').parse::<f64>().ok();
            number.filter(|value| value.is_finite())
        };
        Self {
            file: Some(base_name(file).to_owned()),
            rate_hz: number(RATE).filter(|rate| *rate > 0.0),
            interval: number(INTERVAL).is_some_and(|interval| interval > 1.0),
            names: value(NAMES).map(split_quoted_names).unwrap_or_default(),
        }
    }

    fn file_name(&self) -> &str {
        self.file.as_deref().unwrap_or_default()
    }

    /// Names of the points, from the `.set` file or else `point1`, `point2`, ... A list of names whose length
    /// is not `points` is refused, because it belongs to another table.
    fn names(&self, table: &DelimitedTable, points: usize) -> ImportResult<Vec<String>> {
        if self.names.is_empty() {
            return Ok((1..=points).map(|point| format!("point{point}")).collect());
        }
        if self.names.len() == points {
            return Ok(self.names.clone());
        }
        let (file, names) = (self.file_name(), self.names.len());
        let problem = format!(
            "found {points} points, expected the {names} that {NAMES} in {file} names ({})",
            self.names.join(", ")
        );
        let advice = "the two files belong to different measurements: keep the right .set in the folder of the table, or none";
        refuse_row(table, 0, &problem, advice)
    }

    /// Frame rate of the camera from the `.set` file. A rate that contradicts the time from frame to frame in
    /// the table is refused, unless the user declares that the times are playback times.
    fn frame_rate(
        &self,
        table: &DelimitedTable,
        counts: FrameDiasCounts,
        options: &ImportOptions,
    ) -> ImportResult<Fact<f64>> {
        let Some(rate) = self.rate_hz.filter(|_| !self.interval) else { return Ok(None) };
        let agrees = counts.step_s == 0.0 || (rate * counts.step_s - 1.0).abs() <= RATE_AGREEMENT;
        if agrees || options.time == Some(TimeColumn::Playback) {
            return Ok(Some((rate, format!("{RATE} in {}", self.file_name()))));
        }
        let (step, implied) = (counts.step_s, 1.0 / counts.step_s);
        let problem = format!(
            "found {step} s from frame to frame ({implied} frames/s), expected that of {RATE}={rate} in {}",
            self.file_name()
        );
        let advice = "if the camera recorded at the rate of the .set and the seconds only count frames, add \
            --time playback; else move the .set to another folder and give --frame-rate-hz";
        refuse_row(table, 0, &problem, advice)
    }

    fn notes(&self) -> Vec<String> {
        let unnamed = if self.file.is_none() { "no .set in its folder" } else { "its .set names no points" };
        let points = self.names.is_empty().then(|| {
            format!("{unnamed}: the points are called `point1`, `point2`, ... in the order of the columns")
        });
        let reason = "not every frame was recorded, so CameraSpeed is not taken for the rate";
        let interval =
            self.interval.then(|| format!("{INTERVAL} in {} is above 1: {reason}", self.file_name()));
        points.into_iter().chain(interval).collect()
    }
}

/// Splits a list such as `"a","b"` into names; a name in quotation marks may contain a comma.
fn split_quoted_names(list: &str) -> Vec<String> {
    let (mut names, mut open) = (vec![String::new()], false);
    for c in list.chars() {
        match c {
            '"' => open = !open,
            ',' if !open => names.push(String::new()),
            c => names.iter_mut().last().into_iter().for_each(|name| name.push(c)),
        }
    }
    let names = names.into_iter().map(|name| name.trim().to_owned());
    names.filter(|name| !name.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_settings_name_points_and_rate() {
        let text = "Memo=\"a=b\"\r\nRecInterval=0\r\nCameraSpeed=2000\r\nPointName=\"tip\",\"a,b\", \
            \"\u{5148}\u{7aef}\"\r\n";
        let found = FrameDiasSettings::parse("x/a.set", text);
        assert_eq!((found.rate_hz, found.interval, found.file_name()), (Some(2000.0), false, "a.set"));
        assert_eq!(found.names, ["tip", "a,b", "\u{5148}\u{7aef}"]);
        assert_eq!(
            FrameDiasSettings::parse("a.set", "CameraSpeed=-1\nRecInterval=2\n"),
            FrameDiasSettings {
                file: Some("a.set".to_owned()),
                interval: true,
                ..FrameDiasSettings::default()
            }
        );
    }
}
