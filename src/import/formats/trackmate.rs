//! Reads the exports of TrackMate, a plugin of Fiji: tables of spots as CSV, simple tracks as XML, and whole
//! projects.

mod xml;

use crate::import::format::*;
use std::collections::HashMap;
use xml::{XmlElement, XmlReader};

/// Number of rows at the top of a table that are searched for the column names. Old versions have one header
/// row, later versions up to four.
const HEADER_ROWS: usize = 4;
/// Columns that occur only in tables of edges or of tracks.
const OTHER_COLUMNS: [&str; 5] =
    ["SPOT_SOURCE_ID", "EDGE_TIME", "LINK_COST", "NUMBER_SPOTS", "TRACK_DURATION"];
const POSITION: [&str; 2] = ["POSITION_X", "POSITION_Y"];
const FRAME: &str = "FRAME";
const TRACK: &str = "TRACK_ID";
/// Separates the number and the name of a track in its key; no name contains it.
const SEPARATOR: char = '\u{1f}';
/// Maximum number of names in a message.
const MOST_NAMES: usize = 10;
/// Advice on the exports that contain positions.
const EXPORT_ADVICE: &str = "in TrackMate's display panel press Tracks, choose the tab Spots and then \
    Export to CSV; or run the action Export tracks to XML file";

pub(super) const FORMAT: FormatParser =
    FormatParser { name: "trackmate", recognises: recognise_export, read: read_export };

fn recognise_export(document: &Document) -> Option<String> {
    if let Some(root) = XmlReader::root_name(document) {
        return ROOTS.contains(&root.as_str()).then(|| format!("the root element is <{root}>"));
    }
    let table = document.table.as_ref().ok()?;
    let named = |row: &TextRow| row.has(POSITION[0]) && (row.has(FRAME) || row.has(TRACK));
    let other = |row: &TextRow| row.has(TRACK) && OTHER_COLUMNS.iter().any(|name| row.has(name));
    let (_, row) = table.find_row(HEADER_ROWS, |row| named(row) || other(row))?;
    Some(format!("line {} names the columns of a table of TrackMate", row.line))
}

fn read_export<'a>(document: &'a Document<'a>, options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
    let spots = match XmlReader::root_name(document) {
        Some(_) => read_xml(document)?,
        None => read_spot_table(document)?,
    };
    spots.into_track_file(document, options)
}

/// Spots of a file, collected by track.
pub(super) struct TrackMateSpots<'a> {
    tracks: TrackCollector,
    table: Option<&'a DelimitedTable<'a>>,
    /// Unit of the coordinates, and text on where it was found.
    length_unit: Option<(String, String)>,
    time_unit: String,
    notes: Vec<String>,
}

impl<'a> TrackMateSpots<'a> {
    fn new(table: Option<&'a DelimitedTable<'a>>, clock_cell: usize) -> Self {
        let point = PointFields { has_y: true, ..PointFields::default() };
        let fields = InstanceFields { has_frame: true, has_time: true, clock_cell, points: vec![point] };
        let (length_unit, time_unit) = (None, String::new());
        Self { tracks: TrackCollector::new(fields), table, length_unit, time_unit, notes: vec![] }
    }

    /// Adds a spot to a track, which has a number and a name.
    fn add_spot(&mut self, (id, name): (&str, &str), stamp: RowStamp, [x, y]: [Option<f64>; 2]) {
        let position = RowPosition { x, y, confidence: None };
        self.tracks.add_row(&format!("{id}{SEPARATOR}{name}"), stamp, &[position]);
    }

    /// Sorts the spots into clocks and tracks.
    ///
    /// # Errors
    /// [`ImportError::DuplicateRow`] if a track that the user chooses has two spots in one frame;
    /// [`ImportError::WrongTable`] if there are no tracks.
    fn into_track_file(
        mut self,
        document: &'a Document<'a>,
        options: &ImportOptions,
    ) -> ImportResult<TrackFile<'a>> {
        let branching = self.leave_out_branching(document.file, options)?;
        let (mut clocks, mut tracks) = self.tracks.finish(document.file, RowOrder::Any)?;
        if tracks.is_empty() {
            let (found, expected) = ("spots that belong to no track, or none", "at least one track");
            let advice = format!("run the tracking, loosen the filters of the tracks; then {EXPORT_ADVICE}");
            return Err(ImportError::wrong_table(document.file, found, expected, advice));
        }
        tracks.iter_mut().for_each(|track| track.name = name_of_key(&track.name).to_owned());
        let unit = self.time_unit.trim().trim_matches(['(', ')']).to_lowercase();
        let repeat = unit.starts_with("frame") || clocks.iter().all(|clock| clock.time == clock.frame);
        if repeat {
            self.notes.push(
                "the times are numbers of frames, because the frame interval was not set in TrackMate: they cannot \
                 check --frame-rate-hz"
                    .to_owned(),
            );
        }
        for clock in clocks.iter_mut().filter(|clock| repeat || clock.times().is_empty()) {
            clock.time = None;
        }
        let why = "TrackMate measures from the upper left corner of the image".to_owned();
        let facts = Facts {
            y_axis: Some((YAxis::Down, why)),
            unit: self
                .length_unit
                .as_ref()
                .and_then(|(unit, place)| Some((parse_length_unit(unit)?, format!("{place} says `{unit}`")))),
            time: TimeUnit::parse(&unit).unwrap_or(TimeUnit::Unknown),
            ..Facts::default()
        };
        let header = self.table.and_then(|table| table.head.first());
        Ok(TrackFile {
            table: self.table,
            clocks,
            tracks,
            facts,
            notes: self.notes,
            findings: branching.into_iter().collect(),
            texts: header.map_or(vec![], |row| row.cells.clone()),
            ..TrackFile::for_document(document)
        })
    }

    /// Leaves out tracks that split or merge, because they have several positions in a frame. If the user
    /// requested such a track, or if no other track is left, the import is refused.
    fn leave_out_branching(
        &mut self,
        file: &str,
        options: &ImportOptions,
    ) -> ImportResult<Option<QualityFinding>> {
        let all = self.tracks.len();
        let mut names = vec![];
        for (key, error) in self.tracks.take_branching(file) {
            let name = name_of_key(&key).to_owned();
            let given = || options.tip.iter().chain(&options.head);
            let asked = given().any(|given| given.rsplit(':').next() == Some(name.as_str()));
            let default = given().next().is_none() && ["tip", "head"].contains(&name.as_str());
            if asked || default || self.tracks.len() == 0 {
                return Err(error.with_track(&name));
            }
            names.push(name);
        }
        let count = names.len();
        let found = format!(
            "{file}: {count} of {all} tracks split or merge and are left out: {}",
            names[..count.min(MOST_NAMES)].join(", ")
        );
        let advice = "forbid splitting and merging in TrackMate's tracker, or cut the links in TrackScheme, if one \
            of them is needed";
        let value = (count as f64, "");
        Ok((count > 0).then(|| {
            QualityFinding::advise((Check::BranchingTracks, Severity::Caution), value, found, advice)
        }))
    }
}

fn name_of_key(key: &str) -> &str {
    key.split_once(SEPARATOR).map_or(key, |(_, name)| name)
}

/// Reads a unit of length. An `m` after a damaged sign means micrometres, because only their sign is outside
/// ASCII and can be damaged by a wrong encoding.
fn parse_length_unit(text: &str) -> Option<CoordinateUnit> {
    let name = text.trim().trim_matches(['(', ')']).trim();
    let sign = name.strip_suffix('m').unwrap_or_default();
    let lost = !sign.is_empty() && sign.chars().all(|c| c == '?' || !c.is_ascii());
    if lost { Some(CoordinateUnit::Metres(1e-6)) } else { CoordinateUnit::parse(name) }
}

/// Reads the table of spots: one to four header rows, rows in any order, no quotation marks.
fn read_spot_table<'a>(document: &'a Document<'a>) -> ImportResult<TrackMateSpots<'a>> {
    let table = document.table()?;
    let columns = |row: &TextRow| {
        Some([
            row.position(TRACK)?,
            row.position(FRAME)?,
            row.position(POSITION[0])?,
            row.position(POSITION[1])?,
        ])
    };
    let found = table.find_row(HEADER_ROWS, |row| columns(row).is_some());
    let Some((above, row, [track, frame, x, y])) = found.and_then(|(at, row)| Some((at, row, columns(row)?)))
    else {
        let other = table.find_row(HEADER_ROWS, |row| row.has(TRACK) || row.has(POSITION[0]));
        let (_, row) = other.unwrap_or((0, &table.head[0]));
        let names = row.texts().into_iter().take(2 * MOST_NAMES).collect::<Vec<_>>().join(", ");
        let expected = "its table of linked spots with POSITION_X, POSITION_Y, FRAME and TRACK_ID";
        let found = format!("TrackMate's columns {names}");
        return Err(ImportError::wrong_table(table.location(row.line, 1), found, expected, EXPORT_ADVICE));
    };
    let [id, name, time] = ["ID", "TRACK_NAME", "POSITION_T"].map(|name| row.position(name));
    let start = table.first_numeric_row(above + 1, &[id.unwrap_or(frame), x]);
    let start =
        start.ok_or_else(|| ImportError::header_only(table.file, table.head[table.head.len() - 1].line))?;
    let mut spots = TrackMateSpots::new(Some(table), frame);
    if let Some(units) = table.head.get(start - 1).filter(|row| row.cell(x).starts_with('(')) {
        let place = format!("the row of units, line {}", units.line);
        spots.length_unit = Some((units.cell(x).trim_matches(['(', ')']).to_owned(), place));
        spots.time_unit = time.map_or("", |time| units.cell(time)).to_owned();
    }
    table.refuse_comment_names(row.line, "a label", "rename the spot in TrackMate and export again")?;
    let (mut unlinked, mut rows) = (0_usize, table.rows(start));
    while let Some(record) = rows.next_row()? {
        if record.is_empty() {
            continue;
        }
        if record.len() != row.cells.len() || id.is_some_and(|id| record.cell(id).parse::<i64>().is_err()) {
            let problem = format!(
                "found {} cells, expected {} and a whole number as ID",
                record.len(),
                row.cells.len()
            );
            let advice = "a comma in a name moves the cells after it, as TrackMate quotes nothing: rename the spot or \
                track without commas and export again";
            return Err(ImportError::columns(table.file, record.line, problem, advice));
        }
        let id = record.cell(track);
        if table.parse_cell(id) == CellNumber::Missing {
            unlinked += 1;
            continue;
        }
        let name = name.map(|cell| record.cell(cell)).filter(|name| !name.is_empty()).unwrap_or(id);
        let number = |cell: usize, name: &str| table.number_at(&record, cell, name);
        let time = table.optional_number_at(&record, time, "POSITION_T")?;
        let stamp = RowStamp { line: record.line, frame: number(frame, FRAME)?, time };
        spots.add_spot((id, name), stamp, [number(x, POSITION[0])?, number(y, POSITION[1])?]);
    }
    if unlinked > 0 {
        spots.notes.push(format!("{unlinked} spots belong to no track and are left out"));
    }
    Ok(spots)
}

// TrackMate's XML: simple tracks, `<Tracks><particle><detection t x y z/>` with `t` in frames, and projects
// with spots, the edges that link them, and the tracks that passed the filters.

/// Root elements of simple tracks and of projects.
const ROOTS: [&str; 2] = ["Tracks", "TrackMate"];
const SAVE_AGAIN: &str = "save the project again in TrackMate";

/// A position in one frame.
type Spot = (RowStamp, [Option<f64>; 2]);

/// A track of a project, with the identifiers of its spots.
#[derive(Default)]
struct ProjectTrack {
    id: String,
    name: String,
    spots: Vec<String>,
}

/// Reads a file of simple tracks or a project. The elements of these two kinds of files have different names.
fn read_xml<'a>(document: &'a Document<'a>) -> ImportResult<TrackMateSpots<'a>> {
    let mut xml = XmlReader::new(document);
    let mut file = TrackMateSpots::new(None, 0);
    let (mut particles, mut interval): (usize, Option<f64>) = (0, None);
    let (mut spots, mut tracks): (HashMap<String, Spot>, Vec<ProjectTrack>) = (HashMap::new(), vec![]);
    let mut kept: Option<Vec<String>> = None;
    while let Some(element) = xml.next_element()? {
        match element.name() {
            "Tracks" => {
                read_units(&xml, &element, ["spaceUnits", "timeUnits"], &mut file)?;
                let text = xml.attribute(&element, "frameInterval")?;
                interval = text.and_then(|text| text.trim().parse().ok()).filter(|interval| *interval > 0.0);
            }
            "particle" => particles += 1,
            "detection" if particles > 0 => {
                let (mut stamp, position) = read_spot(&xml, &element, ["t", "x", "y"])?;
                let time = stamp.frame.zip(interval).map(|(frame, interval)| frame * interval);
                stamp.time = time.filter(|time| time.is_finite());
                file.add_spot((&particles.to_string(), &format!("track{particles}")), stamp, position);
            }
            "Model" => read_units(&xml, &element, ["spatialunits", "timeunits"], &mut file)?,
            "Spot" => {
                let id = xml.required_attribute(&element, "ID")?;
                let (mut stamp, position) = read_spot(&xml, &element, ["FRAME", "POSITION_X", "POSITION_Y"])?;
                if xml.attribute(&element, "POSITION_T")?.is_some() {
                    stamp.time = xml.number_attribute(&element, "POSITION_T")?;
                }
                if let Some((first, _)) = spots.insert(id.clone(), (stamp, position)) {
                    let found = format!("the spot {id} a second time (first in line {})", first.line);
                    let place = xml.element_location(&element);
                    return Err(ImportError::wrong_table(place, found, "every spot once", SAVE_AGAIN));
                }
            }
            "Track" => {
                let id = xml.required_attribute(&element, "TRACK_ID")?;
                let name = xml.attribute(&element, "name")?.filter(|name| !name.trim().is_empty());
                let name = name.unwrap_or_else(|| id.clone());
                tracks.push(ProjectTrack { id, name, spots: vec![] });
            }
            "Edge" => {
                for end in ["SPOT_SOURCE_ID", "SPOT_TARGET_ID"] {
                    let id = xml.required_attribute(&element, end)?;
                    if !spots.contains_key(&id) {
                        let found = format!("an edge to the spot {id}, which the file does not have");
                        let (place, expected) =
                            (xml.element_location(&element), "every spot under <AllSpots>");
                        return Err(ImportError::wrong_table(place, found, expected, SAVE_AGAIN));
                    }
                    tracks.last_mut().into_iter().for_each(|track| track.spots.push(id.clone()));
                }
            }
            "FilteredTracks" => {
                kept.get_or_insert_default();
            }
            "TrackID" => kept.get_or_insert_default().push(xml.required_attribute(&element, "TRACK_ID")?),
            _ => {}
        }
    }
    if particles > 0 {
        file.notes.push(
            "simple tracks have no names: they are called track1, track2, ... in their order".to_owned(),
        );
    }
    let all = tracks.len();
    tracks.retain(|track| kept.as_ref().is_none_or(|kept| kept.contains(&track.id)));
    if tracks.len() < all {
        let left_out = all - tracks.len();
        file.notes
            .push(format!("{left_out} of {all} tracks do not pass the project's filters and are left out"));
    }
    for mut track in tracks {
        // (most spots are at the end of one edge and the start of the next)
        track.spots.sort_unstable();
        track.spots.dedup();
        for (stamp, position) in track.spots.iter().filter_map(|id| spots.get(id)) {
            file.add_spot((&track.id, &track.name), *stamp, *position);
        }
    }
    Ok(file)
}

fn read_units(
    xml: &XmlReader,
    element: &XmlElement,
    [length, time]: [&str; 2],
    file: &mut TrackMateSpots,
) -> ImportResult<()> {
    let unit = xml.attribute(element, length)?;
    file.length_unit = unit.map(|unit| (unit, format!("the attribute {length}")));
    file.time_unit = xml.attribute(element, time)?.unwrap_or_default();
    Ok(())
}

fn read_spot(xml: &XmlReader, element: &XmlElement, [frame, x, y]: [&str; 3]) -> ImportResult<Spot> {
    let stamp = RowStamp { line: element.line, frame: xml.number_attribute(element, frame)?, time: None };
    Ok((stamp, [xml.number_attribute(element, x)?, xml.number_attribute(element, y)?]))
}
