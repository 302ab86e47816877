//! Reads the solution files of DICe (Digital Image Correlation Engine) in tracking mode: one file per subset
//! of the picture, one row per frame.

use crate::import::format::*;

const FRAME: &str = "FRAME";
/// Columns with the centre of the subset in the reference picture, pixels. The columns in `DISPLACEMENT`
/// contain the displacement of the subset from this centre.
const REFERENCE: [&str; 2] = ["COORDINATE_X", "COORDINATE_Y"];
const DISPLACEMENT: [&str; 2] = ["DISPLACEMENT_X", "DISPLACEMENT_Y"];
/// Values of `STATUS_FLAG` for a correlated frame: `CORRELATION_SUCCESSFUL`, `INITIALIZE_..._SUCCESSFUL` and
/// `SEARCH_..._SUCCESSFUL` of DICe's `Status_Flag`. Other values mark failures or averages of other subsets.
const SUCCESSFUL: [f64; 7] = [0.0, 1.0, 2.0, 3.0, 4.0, 6.0, 18.0];
/// Text in the comment lines after which `true` or `false` says whether displacements are relative to the
/// previous frame.
const INCREMENTAL: &str = "Incremental correlation:";
/// Maximum number of comment lines at the start of a file.
const PREAMBLE_LINES: usize = 64;
const ONE_SUBSET: &str =
    "one subset that is followed over the frames: this is the field of many points in one frame";
const TRACKING_MODE: &str = "run DICe in tracking mode with a subset on the tip and one on the head (separate output \
    file for each subset), and import their DICe_solution_N.txt together";

pub(super) const FORMAT: FormatParser =
    FormatParser { name: "dice", recognises: recognise_export, read: read_export };

fn recognise_export(document: &Document) -> Option<String> {
    let (_, row) = find_header(document.table.as_ref().ok()?)?;
    Some(format!("line {} names {} and {} as DICe does", row.line, REFERENCE[0], REFERENCE[1]))
}

fn read_export<'a>(document: &'a Document<'a>, _options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
    let table = document.table()?;
    let Some((index, row)) = find_header(table) else {
        let found = format!("`{}` and no row that names the columns", table.first_texts().join(" "));
        let place = table.location(table.first_line(), 1);
        return Err(ImportError::format(place, found, REFERENCE.join(" and "), TRACKING_MODE));
    };
    refuse_incremental(document)?;
    let at = |name: &str| row.position(name);
    let [Some(dx), Some(dy)] = DISPLACEMENT.map(at) else {
        return Err(ImportError::wrong_table(
            table.location(row.line, 1),
            format!("{} without {}", REFERENCE.join(" and "), DISPLACEMENT.join(" and ")),
            "the displacements too: the coordinates alone are where the subset was in the reference picture, \
                the same in every frame",
            "add DISPLACEMENT_X and DISPLACEMENT_Y to DICe's output fields and run it again",
        ));
    };
    let (Some(frame), [Some(x), Some(y)]) = (at(FRAME), REFERENCE.map(at)) else {
        let found = format!("the columns {}", row.texts().join(", "));
        let place = table.location(row.line, 1);
        return Err(ImportError::wrong_table(place, found, ONE_SUBSET, TRACKING_MODE));
    };
    refuse_full_field(table, index + 1, [frame, x, y])?;
    let rule = |name: &str, is, words| at(name).map(|cell| LostRule { cell: Some(cell), is, words });
    let sigma = rule("SIGMA", |sigma, _| sigma < 0.0, "with a SIGMA below 0");
    let status = |flag: f64, _: f64| !SUCCESSFUL.contains(&flag);
    let status = rule("STATUS_FLAG", status, "whose STATUS_FLAG is a failure");
    let (name, lost) = (document.stem.to_owned(), sigma.into_iter().chain(status).collect());
    let points = vec![PointCells { name, x: vec![x, dx], y: vec![y, dy], ..PointCells::default() }];
    let layout = TableLayout::new(index + 1, row.used_width(), points);
    let layout = TableLayout { frame: Some(frame), lost, ..layout };
    let facts = Facts::pixels_down("DICe counts pixels from the upper left corner of the picture");
    let mut export = layout.read_tracks(document, table, facts)?;
    let note = "positions are COORDINATE_X + DISPLACEMENT_X, and so for y; the track is called like its file";
    export.notes.push(note.to_owned());
    Ok(export)
}

/// Index of the row of column names, and the row itself.
fn find_header<'t>(table: &'t DelimitedTable) -> Option<(usize, &'t TextRow)> {
    table.find_row(usize::MAX, |row| REFERENCE.iter().all(|name| row.has(name)))
}

/// Refuses a field of points, in which one frame has many reference positions. In tracking mode the frame
/// number changes and the reference position is constant.
fn refuse_full_field(table: &DelimitedTable, start: usize, cells: [usize; 3]) -> ImportResult<()> {
    let mut first: Option<[String; 3]> = None;
    let other = table.find_in_rows(start, |record| {
        let texts = cells.map(|cell| record.cell(cell));
        let first = first.get_or_insert_with(|| texts.map(str::to_owned));
        let again = record.line != table.head[start].line && texts[0] == first[0] && !texts[0].is_empty();
        let differs = |axis: &usize| table.parse_cell(texts[*axis]) != table.parse_cell(&first[*axis]);
        let at = again.then_some(0).or_else(|| (1..3).find(differs));
        Ok(at.map(|at| {
            let name = [FRAME, REFERENCE[0], REFERENCE[1]][at];
            let found = format!("{name} {} after {}", texts[at], first[at]);
            let place = table.cell_location(record.line, cells[at]);
            ImportError::wrong_table(place, found, ONE_SUBSET, TRACKING_MODE)
        }))
    })?;
    other.map_or(Ok(()), Err)
}

/// Refuses a file whose displacements are relative to the previous frame, because the import needs
/// displacements from one reference picture.
fn refuse_incremental(document: &Document) -> ImportResult<()> {
    let lines = document.text.lines().take(PREAMBLE_LINES).enumerate();
    let mut stated =
        lines.filter_map(|(at, line)| Some((at + 1, line.strip_prefix("***")?.split_once(INCREMENTAL)?.1)));
    match stated.find(|(_, value)| !value.trim().eq_ignore_ascii_case("false")) {
        Some((line, value)) => Err(ImportError::wrong_table(
            format!("{}:{line}:1", document.file),
            format!("`{INCREMENTAL}{value}`"),
            "displacements from one reference picture",
            "run DICe without the incremental formulation and import its solution again",
        )),
        None => Ok(()),
    }
}
