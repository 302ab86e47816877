//! Reads the solution files of DICe (Digital Image Correlation Engine) in tracking mode: one file per subset
//! of the picture, one row per frame.

use crate::import::error::{ImportError, ImportResult, TextLocation};
use crate::import::format::FileFormat;
use crate::import::options::ImportOptions;
use crate::import::reader::{
    CoordinateUnit, DelimitedTable, Document, Facts, LostRule, PointCells, TableLayout, TextRow, TrackFile,
};
use crate::recording::files::YAxis;

const FRAME: &str = "FRAME";
/// Columns with the centre of the subset in the reference picture, pixels. The columns in `DISPLACEMENT`
/// contain the displacement of the subset from this centre.
const REFERENCE: [&str; 2] = ["COORDINATE_X", "COORDINATE_Y"];
const DISPLACEMENT: [&str; 2] = ["DISPLACEMENT_X", "DISPLACEMENT_Y"];
const SIGMA: &str = "SIGMA";
const STATUS: &str = "STATUS_FLAG";
/// Values of the column [`STATUS`] in frames that were correlated: `CORRELATION_SUCCESSFUL`,
/// `INITIALIZE_..._SUCCESSFUL` and `SEARCH_..._SUCCESSFUL` of DICe's `Status_Flag`. Other values mean a
/// failure, or an average of other subsets.
const SUCCESSFUL: [f64; 7] = [0.0, 1.0, 2.0, 3.0, 4.0, 6.0, 18.0];
/// Text in the comment lines after which `true` or `false` says whether displacements are relative to the
/// previous frame.
const INCREMENTAL: &str = "Incremental correlation:";
/// Maximum number of comment lines at the start of a file.
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

    fn read<'a>(&self, document: &'a Document<'a>, _options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
        let table = document.table()?;
        let (index, row) = find_header(table).ok_or_else(|| no_header_error(table))?;
        refuse_incremental(document)?;
        let at = |name: &str| row.position(name);
        let [Some(dx), Some(dy)] = DISPLACEMENT.map(at) else {
            return Err(no_displacements_error(table, row));
        };
        let (Some(frame), [Some(x), Some(y)]) = (at(FRAME), REFERENCE.map(at)) else {
            let found = format!("the columns {}", row.texts().join(", "));
            return Err(full_field_error(table.location(row.line, 1), found));
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
        let (name, lost) = (document.stem.to_owned(), sigma.into_iter().chain(status).collect());
        let points = vec![PointCells { name, x: vec![x, dx], y: vec![y, dy], ..PointCells::default() }];
        let layout = TableLayout::new(index + 1, row.used_width(), points);
        let layout = TableLayout { frame: Some(frame), lost, ..layout };
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

/// Index of the row of column names, and the row itself.
fn find_header<'t>(table: &'t DelimitedTable) -> Option<(usize, &'t TextRow)> {
    table.find_row(usize::MAX, |row| REFERENCE.iter().all(|name| row.has(name)))
}

fn no_header_error(table: &DelimitedTable) -> ImportError {
    let ([x, y], [dx, dy], first) = (REFERENCE, DISPLACEMENT, table.first_texts().join(" "));
    let problem = format!(
        "found `{first}` and no row that names the columns, expected {FRAME}, {x}, {y}, {dx} and {dy}"
    );
    let advice = "give the solution file of a subset, DICe_solution_N.txt, as DICe wrote it";
    ImportError::columns(table.file, table.first_line(), problem, advice)
}

/// Refuses a full-field result, which has many reference positions in one frame. In tracking mode, the frame
/// number increases from row to row, and the reference position is constant.
fn refuse_full_field(
    table: &DelimitedTable,
    start: usize,
    frame: usize,
    reference: [usize; 2],
) -> ImportResult<()> {
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
                table.cell_location(line, frame),
                format!("frame {} again", texts[0]),
            ));
        }
        let differs = |&axis: &usize| {
            texts[axis] != first[axis] && table.parse_cell(texts[axis]) != table.parse_cell(&first[axis])
        };
        if let Some(axis) = (1..3).find(differs) {
            let found = format!("{} {} after {}", REFERENCE[axis - 1], texts[axis], first[axis]);
            return Err(full_field_error(table.cell_location(line, cells[axis]), found));
        }
    }
    Ok(())
}

fn no_displacements_error(table: &DelimitedTable, row: &TextRow) -> ImportError {
    ImportError::wrong_table(
        table.location(row.line, 1),
        format!("{} and {} without {} and {}", REFERENCE[0], REFERENCE[1], DISPLACEMENT[0], DISPLACEMENT[1]),
        "the displacements too: the coordinates alone are where the subset was in the reference picture, the \
            same in every frame",
        "add DISPLACEMENT_X and DISPLACEMENT_Y to DICe's output fields and run it again",
    )
}

fn full_field_error(place: TextLocation, found: String) -> ImportError {
    ImportError::wrong_table(
        place,
        found,
        "one subset that is followed over the frames: this is the field of many points in one \
            frame",
        "run DICe in tracking mode with a subset on the tip and one on the head (separate output \
            file for each subset), and import their DICe_solution_N.txt together",
    )
}

/// Refuses displacements relative to the previous frame, because they do not give positions.
fn refuse_incremental(document: &Document) -> ImportResult<()> {
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
