//! Reads the exports of TrackMate, a plugin of Fiji: tables of spots as CSV, simple tracks as XML, and whole
//! projects.

mod project;
mod spots;
mod xml;

use crate::import::error::{ImportError, ImportResult, TextLocation};
use crate::import::format::FileFormat;
use crate::import::options::ImportOptions;
use crate::import::reader::{
    Clock, CoordinateUnit, DelimitedTable, Document, Facts, TimeUnit, Track, TrackFile, clock_lines,
    new_finding,
};
use crate::recording::files::YAxis;
use crate::recording::quality::{Check, QualityFinding, Severity};
use xml::{XmlElement, XmlReader, XmlTag};

pub(crate) struct TrackMate;

impl FileFormat for TrackMate {
    fn name(&self) -> &'static str {
        "trackmate"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        match root_element(document) {
            Some(root) => Some(format!("the root element is <{root}>")),
            None => spots::recognise_spots(document.table.as_ref().ok()?),
        }
    }

    fn read<'a>(&self, document: &'a Document<'a>, options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
        let found = match root_element(document) {
            Some(SIMPLE_ROOT) => read_simple_tracks(document)?,
            Some(_) => project::read_project(document)?,
            None => spots::read_spot_table(document)?,
        };
        found.into_track_file(document, options)
    }
}

/// Name of the XML root element, if it is one that TrackMate writes.
fn root_element(document: &Document) -> Option<&'static str> {
    let element = XmlReader::root_name(document)?;
    [SIMPLE_ROOT, project::PROJECT_ROOT].into_iter().find(|known| element == *known)
}

// Simple tracks as XML: `<Tracks><particle><detection t x y z/>`, where the attribute `t` is the frame
// number.

pub(crate) const SIMPLE_ROOT: &str = "Tracks";
const SIMPLE_TRACK: &str = "particle";
const SIMPLE_SPOT: &str = "detection";

pub(crate) fn read_simple_tracks<'a>(document: &'a Document<'a>) -> ImportResult<TrackMateFile<'a>> {
    let mut xml = XmlReader::new(document);
    let mut found = TrackMateFile::default();
    let mut interval: Option<f64> = None;
    let mut track: Option<Vec<Spot>> = None;
    while let Some(node) = xml.next_tag()? {
        match node {
            XmlTag::Open(element) if element.has_name(SIMPLE_ROOT) => {
                let unit = xml.attribute(&element, "spaceUnits")?;
                found.space_unit = unit.map(|unit| (unit, "its attribute spaceUnits".to_owned()));
                found.time_unit = xml.attribute(&element, "timeUnits")?;
                let text = xml.attribute(&element, "frameInterval")?;
                interval = text.and_then(|text| text.trim().parse().ok()).filter(|interval| *interval > 0.0);
            }
            XmlTag::Open(element) if element.has_name(SIMPLE_TRACK) => track = Some(vec![]),
            XmlTag::Open(element) if element.has_name(SIMPLE_SPOT) => {
                if let Some(spots) = &mut track {
                    spots.push(read_simple_spot(&xml, &element, interval)?);
                }
            }
            node if node.closes(SIMPLE_TRACK) => {
                let name = format!("track{}", found.trajectories.len() + 1);
                found.trajectories.push(Trajectory { name, spots: track.take().unwrap_or_default() });
            }
            XmlTag::Open(_) | XmlTag::Close(_) => {}
        }
    }
    found.notes.push(format!(
        "simple tracks have no names: they are called track1 to track{} in the order of the file",
        found.trajectories.len()
    ));
    Ok(found)
}

fn read_simple_spot(xml: &XmlReader, element: &XmlElement, interval: Option<f64>) -> ImportResult<Spot> {
    let frame = xml.number_attribute(element, "t")?;
    let time = frame.zip(interval).map(|(frame, interval)| frame * interval).filter(|time| time.is_finite());
    let [x, y] = [xml.number_attribute(element, "x")?, xml.number_attribute(element, "y")?];
    Ok(Spot { line: element.line, frame, time, x, y })
}

// Conversion of the spots to clocks and tracks.

/// Advice on the exports that contain positions.
pub(crate) const EXPORT_ADVICE: &str = "in TrackMate's display panel press Tracks, choose the tab Spots and then \
    Export to CSV; or run the action Export tracks to XML file";

/// Position of a tracked object in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spot {
    pub line: usize,
    pub frame: Option<f64>,
    /// Time in the unit of the file.
    pub time: Option<f64>,
    pub x: Option<f64>,
    pub y: Option<f64>,
}

/// A track as TrackMate stores it; its spots may be in any order.
pub(crate) struct Trajectory {
    pub name: String,
    pub spots: Vec<Spot>,
}

/// Contents of a file of TrackMate, before they are converted to clocks and tracks.
#[derive(Default)]
pub(crate) struct TrackMateFile<'a> {
    pub trajectories: Vec<Trajectory>,
    /// Unit of the coordinates as the file writes it, and a text on where it was found.
    pub space_unit: Option<(String, String)>,
    pub time_unit: Option<String>,
    pub table: Option<&'a DelimitedTable<'a>>,
    pub clock_cell: usize,
    pub has_quality: bool,
    pub notes: Vec<String>,
}

/// How the times of a file are used, with a note and a finding for the report.
struct SpotTimes {
    /// Unit of the times; `None` if the file has no times, or if the times only repeat the frame numbers.
    unit: Option<TimeUnit>,
    note: Option<String>,
    finding: Option<QualityFinding>,
}

impl<'a> TrackMateFile<'a> {
    /// Converts every track to a clock and a track with positions; tracks that split or merge are left out.
    ///
    /// # Errors
    /// [`ImportError::DuplicateRow`] if a track that the user chooses has two spots in one frame;
    /// [`ImportError::WrongTable`] if there are no tracks.
    pub(crate) fn into_track_file(
        mut self,
        document: &'a Document<'a>,
        options: &ImportOptions,
    ) -> ImportResult<TrackFile<'a>> {
        if self.trajectories.is_empty() {
            return Err(no_tracks_error(document));
        }
        let branching = self.leave_out_branching(document, options)?;
        let times = self.spot_times(document.file);
        let mut notes = std::mem::take(&mut self.notes);
        notes.extend(times.note);
        if self.has_quality {
            notes.push("TrackMate's quality is no probability and is not taken as confidence".to_owned());
        }
        let timed = times.unit.is_some();
        let tracks = self.trajectories.iter().enumerate();
        let (clocks, tracks) =
            tracks.map(|(index, track)| track.to_clock_and_track(index, self.clock_cell, timed)).unzip();
        let why = "TrackMate measures from the upper left corner of the image".to_owned();
        let facts = Facts {
            y_axis: Some((YAxis::Down, why)),
            unit: self.space_unit.as_ref().and_then(|(unit, place)| length_unit(unit, place, &mut notes)),
            time: times.unit.unwrap_or_default(),
            ..Facts::default()
        };
        let findings = branching.into_iter().chain(times.finding).collect();
        let header = self.table.and_then(|table| table.head.first());
        let texts = header.map_or(vec![], |row| row.cells.clone());
        let file = TrackFile { facts, notes, findings, texts, ..TrackFile::for_document(document) };
        Ok(TrackFile { table: self.table, clocks, tracks, ..file })
    }

    /// Leaves out tracks that split or merge, because they have several positions in one frame.
    fn leave_out_branching(
        &mut self,
        document: &Document,
        options: &ImportOptions,
    ) -> ImportResult<Option<QualityFinding>> {
        let all = self.trajectories.len();
        let (mut left_out, mut first) = (vec![], None);
        let frame = |spot: &Spot| spot.frame.unwrap_or(f64::INFINITY);
        for mut track in std::mem::take(&mut self.trajectories) {
            track.spots.sort_by(|a, b| frame(a).total_cmp(&frame(b)));
            match track.duplicate_spot_error(document.file) {
                None => self.trajectories.push(track),
                Some(error) if is_requested(options, &track.name) => return Err(error),
                Some(error) => {
                    left_out.push(track.name);
                    first.get_or_insert(error);
                }
            }
        }
        if let Some(error) = first.filter(|_| self.trajectories.is_empty()) {
            return Err(error);
        }
        let named = left_out.iter().take(10).map(String::as_str).collect::<Vec<_>>().join(", ");
        let (file, count) = (document.file, left_out.len());
        let found = format!("{file}: {count} of {all} tracks split or merge and are left out: {named}");
        let advice = "forbid splitting and merging in TrackMate's tracker, or cut the links in TrackScheme, if one \
            of them is needed";
        let value = (count as f64, "");
        Ok((count > 0).then(|| new_finding(Check::BranchingTracks, Severity::Caution, value, found, advice)))
    }

    /// Decides whether the times are used: not if they only repeat the frame numbers.
    fn spot_times(&self, file: &str) -> SpotTimes {
        let mut spots = self.trajectories.iter().flat_map(|track| &track.spots);
        let none = SpotTimes { unit: None, note: None, finding: None };
        let unit = self.time_unit.as_deref().unwrap_or_default();
        let unit = unit.trim().trim_matches(['(', ')']).to_lowercase();
        if spots.clone().all(|spot| spot.time.is_none()) {
            return none;
        }
        if matches!(unit.as_str(), "frame" | "frames") {
            let note = "the times are numbers of frames: the interval was not set in TrackMate".to_owned();
            return SpotTimes { note: Some(note), ..none };
        }
        if spots.all(|spot| spot.time == spot.frame) {
            let step = if unit.is_empty() { "unit" } else { &unit };
            let found = format!(
                "{file}: the times are one {step} from frame to frame: the interval was never set in \
                 TrackMate"
            );
            let advice = "the times are left out and cannot check --frame-rate-hz; set the frame interval in \
                Image > Properties before tracking";
            let finding = new_finding(Check::FrameInterval, Severity::Caution, (1.0, ""), found, advice);
            return SpotTimes { finding: Some(finding), ..none };
        }
        if let Some(seconds) = unit_seconds(&unit) {
            return SpotTimes { unit: Some(TimeUnit::Seconds(seconds)), ..none };
        }
        let note = if unit.is_empty() {
            "the times have no unit in the file".to_owned()
        } else {
            format!("the times have the unknown unit `{unit}`")
        };
        SpotTimes { unit: Some(TimeUnit::Unknown), note: Some(note), ..none }
    }
}

impl Trajectory {
    /// Error for the first two spots of the track in one frame; `None` if every frame has one spot. The spots
    /// must be sorted by frame.
    fn duplicate_spot_error(&self, file: &str) -> Option<ImportError> {
        let same = |pair: &&[Spot]| pair[0].frame.is_some() && pair[0].frame == pair[1].frame;
        let pair = self.spots.windows(2).find(same)?;
        let place = TextLocation { file: file.to_owned(), line: pair[1].line, column: 1 };
        let (found, track, first) = (pair[1].frame?, self.name.clone(), pair[0].line);
        Some(ImportError::DuplicateRow { place, what: "frame", found, track, first })
    }

    fn to_clock_and_track(&self, clock: usize, cell: usize, timed: bool) -> (Clock, Track) {
        let lines = clock_lines(self.spots.iter().map(|spot| spot.line));
        let column = |value: fn(&Spot) -> Option<f64>| self.spots.iter().map(value).collect();
        let (frame, time) = (Some(column(|spot| spot.frame)), timed.then(|| column(|spot| spot.time)));
        let (x, y) = (column(|spot| spot.x), Some(column(|spot| spot.y)));
        let track = Track { name: self.name.clone(), clock, x, y, ..Track::default() };
        (Clock { lines, cell, frame, time, digit: 0.0 }, track)
    }
}

/// Whether the user chooses this track: `--point` names it, or no `--point` is given and it is called `tip`
/// or `head`.
fn is_requested(options: &ImportOptions, name: &str) -> bool {
    let named = [options.tip.as_deref(), options.head.as_deref()];
    if named.iter().all(Option::is_none) {
        return ["tip", "head"].contains(&name);
    }
    let mut files = named.into_iter().flatten().filter_map(|given| given.strip_suffix(name));
    files.any(|file| file.is_empty() || file.ends_with(':'))
}

fn no_tracks_error(document: &Document) -> ImportError {
    ImportError::wrong_table(
        document.file,
        "spots that belong to no track, or none",
        "at least one track",
        format!("run the tracking first; then {EXPORT_ADVICE}"),
    )
}

/// Length of a unit of time, s; `unit` is its name in lower case.
fn unit_seconds(unit: &str) -> Option<f64> {
    match unit {
        "s" | "sec" | "secs" | "second" | "seconds" => Some(1.0),
        "ms" | "msec" | "millisecond" | "milliseconds" => Some(1e-3),
        "us" | "\u{b5}s" | "\u{3bc}s" | "usec" | "microsecond" | "microseconds" => Some(1e-6),
        "min" | "mn" | "minute" | "minutes" => Some(60.0),
        "h" | "hr" | "hour" | "hours" => Some(3600.0),
        _ => None,
    }
}

/// The unit with the name `text`, and a text on where it was found. An unknown unit gives `None` and a note.
fn length_unit(text: &str, place: &str, notes: &mut Vec<String>) -> Option<(CoordinateUnit, String)> {
    let name = text.trim().trim_matches(['(', ')']).trim();
    // (a unit with a damaged character is the micrometre: only its micro sign is outside ASCII)
    let sign = name.strip_suffix('m').unwrap_or_default();
    let lost = !sign.is_empty() && sign.chars().all(|c| c == '?' || !c.is_ascii());
    let unit = match name {
        "nm" => Some(CoordinateUnit::Metres(1e-9)),
        _ if lost => Some(CoordinateUnit::Metres(1e-6)),
        _ => CoordinateUnit::parse(name),
    };
    let Some(unit) = unit else {
        notes.push(format!("the unit of length `{name}` ({place}) is not known"));
        return None;
    };
    let shown = if lost { "micrometres" } else { name };
    let uncalibrated = if unit == CoordinateUnit::Pixel { ": TrackMate was not calibrated" } else { "" };
    Some((unit, format!("{place} says `{shown}`{uncalibrated}")))
}
