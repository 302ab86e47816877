//! DICe (Digital Image Correlation Engine) in tracking mode: a file a subset, a row a frame.

use super::FileFormat;
use crate::import::error::ImportError;
use crate::import::options::ImportOptions;
use crate::import::reader::{
    CoordinateUnit, DelimitedTable, Document, Facts, LostRule, PointCells, TableLayout, TextRow, TrackFile,
};
use crate::recording::files::YAxis;

const FRAME: &str = "FRAME";
/// Where the centre of the subset was in the reference picture, and how far it has moved since.
const REFERENCE: [&str; 2] = ["COORDINATE_X", "COORDINATE_Y"];
const DISPLACEMENT: [&str; 2] = ["DISPLACEMENT_X", "DISPLACEMENT_Y"];
const SIGMA: &str = "SIGMA";
const STATUS: &str = "STATUS_FLAG";
/// Values of [`STATUS`] with which a frame was correlated: `CORRELATION_SUCCESSFUL`, the
/// `INITIALIZE_..._SUCCESSFUL` and `SEARCH_..._SUCCESSFUL` of DICe's `Status_Flag`. All others are failures,
/// or positions averaged from other subsets.
const SUCCESSFUL: [f64; 7] = [0.0, 1.0, 2.0, 3.0, 4.0, 6.0, 18.0];
/// Line of the comment block that says whether displacements start again in every frame.
const INCREMENTAL: &str = "Incremental correlation:";
/// Lines in which the comment block ends.
const PREAMBLE_LINES: usize = 64;

pub(crate) struct Dice;

impl FileFormat for Dice {
    fn name(&self) -> &'static str {
        "dice"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let (_, row) = find_header(document.table.as_ref().ok()?)?;
        Some(format!("line {} names {} and {} as DICe does", row.line, REFERENCE[0], REFERENCE[1]))
    }

    fn read<'a>(
        &self,
        document: &'a Document<'a>,
        _options: &ImportOptions,
    ) -> Result<TrackFile<'a>, ImportError> {
        let table = document.table()?;
        let (index, row) = find_header(table).ok_or_else(|| no_header_error(table))?;
        refuse_incremental(document)?;
        let at = |name: &str| row.cells.iter().position(|cell| cell == name);
        let [Some(dx), Some(dy)] = DISPLACEMENT.map(at) else {
            return Err(no_displacements_error(table, row));
        };
        let (Some(frame), [Some(x), Some(y)]) = (at(FRAME), REFERENCE.map(at)) else {
            return Err(full_field_error(
                table.location(row.line, 1).to_string(),
                format!("the columns {}", row.texts().join(", ")),
            ));
        };
        refuse_full_field(table, index + 1, frame, [x, y])?;
        let sigma = at(SIGMA).map(|cell| LostRule {
            cell: Some(cell),
            is: |sigma, _| sigma < 0.0,
            words: "with a SIGMA below 0",
        });
        let status = at(STATUS).map(|cell| LostRule {
            cell: Some(cell),
            is: |flag, _| !SUCCESSFUL.contains(&flag),
            words: "whose STATUS_FLAG is a failure",
        });
        let layout = TableLayout {
            start: index + 1,
            width: row.used_width(),
            most: row.used_width(),
            frame: Some(frame),
            points: vec![PointCells {
                name: document.stem.to_owned(),
                x: vec![x, dx],
                y: vec![y, dy],
                confidence: None,
            }],
            lost: sigma.into_iter().chain(status).collect(),
            ..TableLayout::default()
        };
        let mut export = layout.read_tracks(document, table, facts())?;
        export.notes.push(format!(
            "positions are {} + {}, and so for y; the track is called like its file",
            REFERENCE[0], DISPLACEMENT[0]
        ));
        Ok(export)
    }
}

fn facts() -> Facts {
    let why = "DICe counts from the upper left corner of the picture, y downwards".to_owned();
    let unit = "DICe's coordinates and displacements are pixels".to_owned();
    Facts { y_axis: Some((YAxis::Down, why)), unit: Some((CoordinateUnit::Pixel, unit)), ..Facts::default() }
}

/// Index of the row of column names, and the row.
fn find_header<'t>(table: &'t DelimitedTable) -> Option<(usize, &'t TextRow)> {
    let is_header = |row: &TextRow| REFERENCE.iter().all(|name| row.cells.iter().any(|cell| cell == name));
    table.head.iter().enumerate().find(|(_, row)| is_header(row))
}

fn no_header_error(table: &DelimitedTable) -> ImportError {
    let found = table.head.first().map(TextRow::texts).unwrap_or_default();
    ImportError::columns(
        table.file,
        table.head.first().map_or(1, |row| row.line),
        format!(
            "found `{}` and no row that names the columns, expected {FRAME}, {}, {}, {} and {}",
            found.join(" "),
            REFERENCE[0],
            REFERENCE[1],
            DISPLACEMENT[0],
            DISPLACEMENT[1]
        ),
        "give the solution file of a subset, DICe_solution_N.txt, as DICe wrote it",
    )
}

/// In tracking mode the reference stays where it is while the frames count up; a field has many references in
/// one frame.
fn refuse_full_field(
    table: &DelimitedTable,
    start: usize,
    frame: usize,
    reference: [usize; 2],
) -> Result<(), ImportError> {
    let cells = [frame, reference[0], reference[1]];
    let mut rows = table.rows(start);
    let mut first: Option<[String; 3]> = None;
    while let Some(record) = rows.next_row()? {
        let texts = cells.map(|cell| record.cell(cell));
        let Some(first) = &first else {
            first = Some(texts.map(str::to_owned));
            continue;
        };
        let line = record.line;
        if texts[0] == first[0] && !texts[0].is_empty() {
            return Err(full_field_error(
                table.location(line, table.text_column(line, frame)).to_string(),
                format!("frame {} again", texts[0]),
            ));
        }
        if let Some(axis) = (1..3).find(|&axis| {
            texts[axis] != first[axis] && table.parse_cell(texts[axis]) != table.parse_cell(&first[axis])
        }) {
            let place = table.location(line, table.text_column(line, cells[axis]));
            return Err(full_field_error(
                place.to_string(),
                format!("{} {} after {}", REFERENCE[axis - 1], texts[axis], first[axis]),
            ));
        }
    }
    Ok(())
}

/// Without displacements there is only the place of the subset in the reference picture.
fn no_displacements_error(table: &DelimitedTable, row: &TextRow) -> ImportError {
    ImportError::wrong_table(
        table.location(row.line, 1).to_string(),
        format!("{} and {} without {} and {}", REFERENCE[0], REFERENCE[1], DISPLACEMENT[0], DISPLACEMENT[1]),
        "the displacements too: the coordinates alone are where the subset was in the reference picture, the \
            same in every frame",
        "add DISPLACEMENT_X and DISPLACEMENT_Y to DICe's output fields and run it again",
    )
}

fn full_field_error(place: String, found: String) -> ImportError {
    ImportError::wrong_table(
        place,
        found,
        "one subset that is followed over the frames: this is the field of many points in one \
            frame",
        "run DICe in tracking mode with a subset on the tip and one on the head (separate output \
            file for each subset), and import their DICe_solution_N.txt together",
    )
}

/// Displacements from frame to frame are no positions.
fn refuse_incremental(document: &Document) -> Result<(), ImportError> {
    let lines =
        document.text.lines().take(PREAMBLE_LINES).enumerate().filter(|(_, line)| line.starts_with("***"));
    let stated = lines.filter_map(|(at, line)| Some((at + 1, line.split_once(INCREMENTAL)?.1.trim())));
    match stated.into_iter().find(|(_, value)| !value.eq_ignore_ascii_case("false")) {
        Some((line, value)) => Err(ImportError::wrong_table(
            format!("{}:{line}:1", document.file),
            format!("`{INCREMENTAL} {value}`"),
            "displacements from one reference picture",
            "run DICe without the incremental formulation and import its solution again",
        )),
        None => Ok(()),
    }
}
