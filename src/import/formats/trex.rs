//! TRex: one file an animal, with several positions of it; the unit stands in the header.

use crate::import::error::ImportError;
use crate::import::format::Format;
use crate::import::options::Options;
use crate::import::reader::{
    Document, Facts, Layout, LostRule, PointCells, Row, TrackFile, Unit, named_columns,
};
use crate::recording::files::YAxis;

/// Rounding of its numbers, times included, s.
const QUANTUM_S: f64 = 1e-3;
const FRAME: &str = "frame";
const TIME: &str = "time";
const MISSING: &str = "missing";
/// Kinds of position, the steadiest first: a centroid averages over the outline, the head depends on the
/// posture.
const PREFERRED: [&str; 3] = ["wcentroid", "pcentroid", ""];
/// Columns next to the position that distinguish a table of TRex from one with `X (cm)` of one's own.
const MARKS: [&str; 5] = ["num_pixels", "midline_length", "timestamp", "ANGLE", "SPEED#wcentroid (cm/s)"];
/// What TRex writes for a coordinate of a lost animal.
const VOID: [&str; 2] = ["inf", "-inf"];

/// TRex's tables.
pub(crate) struct Trex;

/// A column of a position, such as `X#wcentroid (cm)`.
struct Name<'n> {
    axis: &'n str,
    /// Which point of the animal; empty for the head.
    point: &'n str,
    unit: &'n str,
}

impl<'n> Name<'n> {
    fn parse(name: &'n str) -> Option<Self> {
        let (base, unit) =
            name.split_once(" (").map_or((name, ""), |(base, unit)| (base, unit.trim_end_matches(')')));
        let (axis, point) = base.split_once('#').unwrap_or((base, ""));
        ["X", "Y"].contains(&axis).then_some(Self { axis, point, unit })
    }
}

fn is_trex(names: &[&str]) -> bool {
    let positions = || names.iter().filter_map(|name| Name::parse(name));
    let has = |axis: &str| positions().any(|name| name.axis == axis);
    let marked = positions().any(|name| name.point.ends_with("centroid"))
        || MARKS.iter().any(|mark| names.contains(mark));
    names.contains(&FRAME) && has("X") && has("Y") && marked
}

impl Format for Trex {
    fn name(&self) -> &'static str {
        "trex"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let (_, row) = named_columns::header(document.table.as_ref().ok()?, is_trex)?;
        Some(format!("line {} names frame and positions with their units as TRex does", row.line))
    }

    fn read<'a>(&self, document: &'a Document<'a>, options: &Options) -> Result<TrackFile<'a>, ImportError> {
        let table = document.table()?;
        let (wanted, advice) = (
            "frame and X#wcentroid, Y#wcentroid or X, Y",
            "add frame, X#wcentroid and Y#wcentroid to output_fields and export again",
        );
        let (header, row) = named_columns::header(table, is_trex)
            .ok_or_else(|| named_columns::no_column(table, None, wanted, advice))?;
        let frame = named_columns::column(table, header, FRAME)?;
        let positions = positions(row);
        if positions.is_empty() {
            return Err(named_columns::no_column(table, Some(row.line), wanted, advice));
        }
        let at = |name: &str| row.cells.iter().position(|cell| cell == name);
        let lost = at(MISSING).map(|cell| LostRule {
            cell: Some(cell),
            is: |missing, _| missing != 0.0,
            words: "of frames that TRex marks as missing",
        });
        let points = |(index, found): (usize, &Position)| {
            PointCells::new(found.track(index, document.stem), found.x, Some(found.y))
        };
        let layout = Layout {
            start: header + 1,
            width: row.filled(),
            most: row.filled(),
            frame,
            time: at(TIME),
            points: positions.iter().enumerate().map(points).collect(),
            lost: lost.into_iter().collect(),
            void: &VOID,
            ..Layout::default()
        };
        let mut export = layout.read(document, table, facts(row, &positions[0]))?;
        export.notes.extend(notes(row, &positions, document.stem));
        named_columns::leave_out_useless_times(&mut export, options, QUANTUM_S);
        Ok(export)
    }
}

/// A point of the animal: its columns.
struct Position {
    point: String,
    unit: String,
    x: usize,
    y: usize,
}

impl Position {
    /// The first one is called as the file is, the others by what they are.
    fn track(&self, index: usize, stem: &str) -> String {
        match (index, self.point.as_str()) {
            (0, _) => stem.to_owned(),
            (_, "") => "posture-head".to_owned(),
            (_, point) => point.to_owned(),
        }
    }
}

/// The positions of the header, the preferred one first; smoothed ones are no measurement.
fn positions(row: &Row) -> Vec<Position> {
    let named = || row.cells.iter().enumerate().filter_map(|(cell, name)| Some((cell, Name::parse(name)?)));
    let xs = named().filter(|(_, name)| name.axis == "X" && !name.point.contains("smooth"));
    let pair = |(x, name): (usize, Name)| {
        let y = named()
            .find(|(_, other)| other.axis == "Y" && other.point == name.point && other.unit == name.unit)?
            .0;
        Some(Position { point: name.point.to_owned(), unit: name.unit.to_owned(), x, y })
    };
    let mut found: Vec<Position> = xs.filter_map(pair).collect();
    found.sort_by_key(|position| {
        PREFERRED.iter().position(|point| *point == position.point).unwrap_or(PREFERRED.len())
    });
    found
}

fn facts(row: &Row, taken: &Position) -> Facts {
    let place = format!("the header (line {}) says ({})", row.line, taken.unit);
    let why = "TRex writes image coordinates from the upper left corner".to_owned();
    Facts {
        y_axis: Some((YAxis::Down, why)),
        unit: Unit::named(&taken.unit).map(|unit| (unit, place)),
        ..Facts::default()
    }
}

fn notes(row: &Row, positions: &[Position], stem: &str) -> Vec<String> {
    let column = |position: &Position| row.cells.get(position.x).cloned().unwrap_or_default();
    let mut notes = vec![format!("track `{stem}` is {} and its Y", column(&positions[0]))];
    let others = positions
        .iter()
        .enumerate()
        .skip(1)
        .map(|(index, other)| format!("`{}` ({})", other.track(index, stem), column(other)));
    if positions.len() > 1 {
        notes.push(format!("other positions of the animal: {}", others.collect::<Vec<_>>().join(", ")));
    }
    if positions[0].unit == "cm" {
        notes.push(
            "TRex writes cm by its setting cm_per_pixel, which is the user's word: check it against a \
            known length"
                .to_owned(),
        );
    }
    notes
}
