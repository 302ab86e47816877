//! TrackMate (Fiji): tables of spots as CSV, simple tracks as XML, and whole projects.

mod project;
mod spots;
mod xml;

use super::FileFormat;
use crate::import::error::{ImportError, TextLocation};
use crate::import::options::ImportOptions;
use crate::import::reader::{
    Clock, CoordinateUnit, DelimitedTable, Document, Facts, TimeUnit, Track, TrackFile, new_finding,
};
use crate::recording::files::YAxis;
use crate::recording::quality::{Check, QualityFinding, Severity};
use xml::{XmlElement, XmlReader, XmlTag};

/// TrackMate's tables and files.
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

    fn read<'a>(
        &self,
        document: &'a Document<'a>,
        options: &ImportOptions,
    ) -> Result<TrackFile<'a>, ImportError> {
        let found = match root_element(document) {
            Some(SIMPLE_ROOT) => read_simple_tracks(document)?,
            Some(_) => project::read_project(document)?,
            None => spots::read_spot_table(document)?,
        };
        found.into_track_file(document, options)
    }
}

/// The name of the root element, where it is one of TrackMate's.
fn root_element(document: &Document) -> Option<&'static str> {
    let element = xml::XmlReader::root_name(document)?;
    [SIMPLE_ROOT, project::PROJECT_ROOT].into_iter().find(|known| element == *known)
}

// Simple tracks: `<Tracks><particle><detection t x y z/>`, where `t` counts frames.

pub(crate) const SIMPLE_ROOT: &str = "Tracks";
const SIMPLE_TRACK: &str = "particle";
const SIMPLE_SPOT: &str = "detection";

pub(crate) fn read_simple_tracks<'a>(document: &'a Document<'a>) -> Result<TrackMateFile<'a>, ImportError> {
    let mut xml = XmlReader::new(document);
    let mut found = TrackMateFile::default();
    let mut interval = None;
    let mut track: Option<Vec<Spot>> = None;
    while let Some(node) = xml.next_tag()? {
        match node {
            XmlTag::Open(element) if element.has_name(SIMPLE_ROOT) => {
                found.space_unit = xml
                    .attribute(&element, "spaceUnits")?
                    .map(|unit| (unit, "its attribute spaceUnits".to_owned()));
                found.time_unit = xml.attribute(&element, "timeUnits")?;
                interval = xml
                    .attribute(&element, "frameInterval")?
                    .and_then(|text| text.trim().parse::<f64>().ok())
                    .filter(|interval| *interval > 0.0);
            }
            XmlTag::Open(element) if element.has_name(SIMPLE_TRACK) => track = Some(vec![]),
            XmlTag::Open(element) if element.has_name(SIMPLE_SPOT) => {
                if let Some(spots) = &mut track {
                    spots.push(read_simple_spot(&xml, &element, interval)?);
                }
            }
            XmlTag::Close(end) if end.has_name(SIMPLE_TRACK) => {
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

fn read_simple_spot(
    xml: &XmlReader,
    element: &XmlElement,
    interval: Option<f64>,
) -> Result<Spot, ImportError> {
    let frame = xml.number_attribute(element, "t")?;
    let time = frame.zip(interval).map(|(frame, interval)| frame * interval).filter(|time| time.is_finite());
    Ok(Spot {
        line: element.line,
        frame,
        time,
        x: xml.number_attribute(element, "x")?,
        y: xml.number_attribute(element, "y")?,
    })
}

// Spots to tracks: order, branches, and what the units of the file mean.

/// What to export instead of a table or file without positions.
pub(crate) const EXPORT_ADVICE: &str = "in TrackMate's display panel press Tracks, choose the tab Spots and then \
    Export to CSV; or run the action Export tracks to XML file";

/// A position in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spot {
    pub line: usize,
    pub frame: Option<f64>,
    /// In the file's unit of time.
    pub time: Option<f64>,
    pub x: Option<f64>,
    pub y: Option<f64>,
}

/// A track with its spots in any order.
pub(crate) struct Trajectory {
    pub name: String,
    pub spots: Vec<Spot>,
}

/// What a file of TrackMate holds.
#[derive(Default)]
pub(crate) struct TrackMateFile<'a> {
    pub trajectories: Vec<Trajectory>,
    /// Unit of the coordinates, and where it stands.
    pub space_unit: Option<(String, String)>,
    pub time_unit: Option<String>,
    pub table: Option<&'a DelimitedTable<'a>>,
    pub clock_cell: usize,
    pub has_quality: bool,
    pub notes: Vec<String>,
}

/// What the times of the file are worth.
struct SpotTimes {
    /// Their unit; `None` where they only repeat the frames.
    unit: Option<TimeUnit>,
    note: Option<String>,
    finding: Option<QualityFinding>,
}

impl<'a> TrackMateFile<'a> {
    /// Puts every track in order.
    ///
    /// # Errors
    /// [`ImportError::DuplicateRow`] where a track that is asked for has two spots in one frame, and a refusal of
    /// files without tracks.
    pub(crate) fn into_track_file(
        mut self,
        document: &'a Document<'a>,
        options: &ImportOptions,
    ) -> Result<TrackFile<'a>, ImportError> {
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
        let (clocks, tracks) = self
            .trajectories
            .iter()
            .enumerate()
            .map(|(index, track)| track.to_clock_and_track(index, self.clock_cell, times.unit.is_some()))
            .unzip();
        let facts = Facts {
            y_axis: Some((
                YAxis::Down,
                "TrackMate measures from the upper left corner of the image".to_owned(),
            )),
            unit: self.space_unit.as_ref().and_then(|(unit, place)| length_unit(unit, place, &mut notes)),
            time: times.unit.unwrap_or_default(),
            ..Facts::default()
        };
        let findings = branching.into_iter().chain(times.finding).collect();
        let texts = self
            .table
            .iter()
            .flat_map(|table| table.head.first())
            .flat_map(|row| row.cells.iter().cloned())
            .collect();
        Ok(TrackFile {
            table: self.table,
            clocks,
            tracks,
            facts,
            notes,
            findings,
            texts,
            ..TrackFile::for_document(document)
        })
    }

    /// A track that splits or merges has no one position in a frame.
    fn leave_out_branching(
        &mut self,
        document: &Document,
        options: &ImportOptions,
    ) -> Result<Option<QualityFinding>, ImportError> {
        let all = self.trajectories.len();
        let (mut left_out, mut first) = (vec![], None);
        for track in std::mem::take(&mut self.trajectories) {
            let track = track.sort_by_frame();
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
        let found = format!(
            "{}: {} of {all} tracks split or merge and are left out: {named}",
            document.file,
            left_out.len()
        );
        let advice = "forbid splitting and merging in TrackMate's tracker, or cut the links in TrackScheme, \
            if one of them is needed";
        Ok((!left_out.is_empty()).then(|| {
            new_finding(Check::BranchingTracks, Severity::Caution, (left_out.len() as f64, ""), found, advice)
        }))
    }

    /// Whether the times say more than the frames do.
    fn spot_times(&self, file: &str) -> SpotTimes {
        let mut spots = self.trajectories.iter().flat_map(|track| &track.spots);
        let none = SpotTimes { unit: None, note: None, finding: None };
        let unit = self
            .time_unit
            .as_deref()
            .map(|unit| unit.trim().trim_matches(['(', ')']).to_lowercase())
            .unwrap_or_default();
        if spots.clone().all(|spot| spot.time.is_none()) {
            return none;
        }
        if matches!(unit.as_str(), "frame" | "frames") {
            return SpotTimes {
                note: Some(
                    "the times are numbers of frames: the interval was not set in TrackMate".to_owned(),
                ),
                ..none
            };
        }
        if spots.all(|spot| spot.time == spot.frame) {
            let step = if unit.is_empty() { "unit" } else { &unit };
            let found = format!(
                "{file}: the times are one {step} from frame to frame: the interval was never set in \
                 TrackMate"
            );
            let advice = "the times are left out and cannot check --frame-rate-hz; set the frame interval in \
                Image > Properties before tracking";
            return SpotTimes {
                finding: Some(new_finding(Check::FrameInterval, Severity::Caution, (1.0, ""), found, advice)),
                ..none
            };
        }
        match unit_seconds(&unit) {
            Some(seconds) => SpotTimes { unit: Some(TimeUnit::Seconds(seconds)), ..none },
            None => {
                let note = format!(
                    "the times have {}",
                    if unit.is_empty() {
                        "no unit in the file".to_owned()
                    } else {
                        format!("the unknown unit `{unit}`")
                    }
                );
                SpotTimes { unit: Some(TimeUnit::Unknown), note: Some(note), ..none }
            }
        }
    }
}

impl Trajectory {
    fn sort_by_frame(mut self) -> Self {
        let key = |spot: &Spot| spot.frame.unwrap_or(f64::INFINITY);
        self.spots.sort_by(|a, b| key(a).total_cmp(&key(b)));
        self
    }

    /// The refusal of a second spot in one frame.
    fn duplicate_spot_error(&self, file: &str) -> Option<ImportError> {
        let pair =
            self.spots.windows(2).find(|pair| pair[0].frame.is_some() && pair[0].frame == pair[1].frame)?;
        let place = TextLocation { file: file.to_owned(), line: pair[1].line, column: 1 };
        Some(ImportError::DuplicateRow {
            place,
            what: "frame",
            found: pair[1].frame?,
            track: self.name.clone(),
            first: pair[0].line,
        })
    }

    fn to_clock_and_track(&self, clock: usize, cell: usize, timed: bool) -> (Clock, Track) {
        let lines = self.spots.iter().map(|spot| u32::try_from(spot.line).unwrap_or(u32::MAX)).collect();
        let column = |value: fn(&Spot) -> Option<f64>| self.spots.iter().map(value).collect();
        let clock_columns = Clock {
            lines,
            cell,
            frame: Some(column(|spot| spot.frame)),
            time: timed.then(|| column(|spot| spot.time)),
        };
        (
            clock_columns,
            Track {
                name: self.name.clone(),
                clock,
                x: column(|spot| spot.x),
                y: Some(column(|spot| spot.y)),
                confidence: None,
            },
        )
    }
}

/// Whether the user means the track of that name, or would get it for its name.
fn is_requested(options: &ImportOptions, name: &str) -> bool {
    let named = [options.tip.as_deref(), options.head.as_deref()];
    if named.iter().all(Option::is_none) {
        return ["tip", "head"].contains(&name);
    }
    named.into_iter().flatten().any(|name_given| {
        name_given.strip_suffix(name).is_some_and(|file| file.is_empty() || file.ends_with(':'))
    })
}

fn no_tracks_error(document: &Document) -> ImportError {
    ImportError::wrong_table(
        document.file,
        "spots that belong to no track, or none",
        "at least one track",
        format!("run the tracking first; then {EXPORT_ADVICE}"),
    )
}

/// Seconds of a unit of time by its name.
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

/// The unit that the file names; one that is not known is asked for.
fn length_unit(text: &str, place: &str, notes: &mut Vec<String>) -> Option<(CoordinateUnit, String)> {
    let name = text.trim().trim_matches(['(', ')']).trim();
    // the only unit with a sign beyond ASCII is the micrometre: its sign is lost where the character set was
    let lost = name
        .strip_suffix('m')
        .is_some_and(|sign| !sign.is_empty() && sign.chars().all(|c| c == '?' || !c.is_ascii()));
    let unit = match name {
        "nm" => Some(CoordinateUnit::Metres(1e-9)),
        _ if lost => Some(CoordinateUnit::Metres(1e-6)),
        _ => CoordinateUnit::parse(name),
    };
    if unit.is_none() {
        notes.push(format!("the unit of length `{name}` ({place}) is not known"));
    }
    let shown = if lost { "micrometres" } else { name };
    unit.map(|unit| match unit {
        CoordinateUnit::Pixel => (unit, format!("{place} says `{shown}`: TrackMate was not calibrated")),
        CoordinateUnit::Metres(_) => (unit, format!("{place} says `{shown}`")),
    })
}
