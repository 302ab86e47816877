//! DeepLabCut and Lightning Pose: tables under three header rows (four with individuals), and tables of
//! labels set by hand.

mod header;
mod labelled;

use crate::import::error::ImportError;
use crate::import::format::FileFormat;
use crate::import::options::ImportOptions;
use crate::import::reader::picked::picked_frames_finding;
use crate::import::reader::{
    CellNumber, DelimitedTable, Document, Facts, TableLayout, TextRow, TrackFile, new_finding,
};
use crate::recording::quality::{Check, QualityFinding, Severity};
use header::{DeepLabCutHeader, ROW_NAMES};

/// Parts of a file's name or of a scorer's that tell of smoothed positions: DeepLabCut's filtered predictions
/// and the ensemble Kalman smoother of Lightning Pose.
const SMOOTHED: [&str; 3] = ["filtered", "smoother", "smoothed"];
/// Columns of the lengths and angles between body parts.
const SKELETON: [&str; 3] = ["length", "orientation", "likelihood"];

/// Tables of DeepLabCut and of programs that write its layout.
pub(crate) struct DeepLabCut;

impl FileFormat for DeepLabCut {
    fn name(&self) -> &'static str {
        "deeplabcut"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let table = document.table.as_ref().ok()?;
        if let Some(row) = find_skeleton_row(table) {
            return Some(format!(
                "line {} names lengths and orientations as DeepLabCut's skeleton does",
                row.line
            ));
        }
        let rows: Vec<&TextRow> = table
            .head
            .iter()
            .take(ROW_NAMES.len())
            .filter(|row| ROW_NAMES.contains(&row.first_cell()))
            .collect();
        let described: Vec<String> =
            rows.iter().map(|row| format!("line {} starts with `{}`", row.line, row.first_cell())).collect();
        (rows.len() > 1 || rows.first().is_some_and(|row| row.first_cell() == ROW_NAMES[0]))
            .then(|| described.join(", "))
    }

    fn read<'a>(
        &self,
        document: &'a Document<'a>,
        _options: &ImportOptions,
    ) -> Result<TrackFile<'a>, ImportError> {
        let table = document.table()?;
        if let Some(row) = find_skeleton_row(table) {
            return Err(skeleton_table_error(table, row));
        }
        let header = DeepLabCutHeader::find(table)?;
        let mut export = if header.index_cells > 1 || names_images(table, &header) {
            labelled::read_labels(document, table, &header, facts())?
        } else {
            let layout = TableLayout {
                start: header.start,
                width: header.cells,
                most: header.cells,
                frame: Some(0),
                points: header.points.clone(),
                ..TableLayout::default()
            };
            let mut export = layout.read_tracks(document, table, facts())?;
            if header.points.iter().all(|point| point.confidence.is_none()) {
                // (predictions have a likelihood; what has none may be labels)
                export.findings.extend(
                    export.clocks.iter().filter_map(|clock| picked_frames_finding(document.file, clock)),
                );
            }
            export
        };
        export.notes.extend(header.ignored_columns_note());
        export.findings.extend(filtering_finding(document, &header));
        Ok(export)
    }
}

fn facts() -> Facts {
    Facts::pixels_down("DeepLabCut writes image pixels, y downwards")
}

/// Whether the rows are named by pictures instead of being numbered.
fn names_images(table: &DelimitedTable, header: &DeepLabCutHeader) -> bool {
    table.head.get(header.start).is_some_and(|row| {
        table.parse_cell(row.first_cell()) == CellNumber::Text && row.first_cell().contains('.')
    })
}

fn find_skeleton_row<'t>(table: &'t DelimitedTable) -> Option<&'t TextRow> {
    let names = |row: &&TextRow| SKELETON.iter().all(|name| row.cells.iter().any(|cell| cell == name));
    table.head.iter().take(ROW_NAMES.len()).find(names)
}

fn skeleton_table_error(table: &DelimitedTable, row: &TextRow) -> ImportError {
    let cell = row.cells.iter().position(|cell| cell == SKELETON[0]).unwrap_or(0);
    ImportError::wrong_table(
        table.location(row.line, table.text_column(row.line, cell)),
        "lengths and orientations of a skeleton",
        "a table of body parts with the columns x, y and likelihood",
        "import the CSV that analyze_videos writes with save_as_csv=True, the one without \
            `_skeleton` in its name",
    )
}

/// Positions that went through a low-pass filter have lost part of what a spectrum is to show.
fn filtering_finding(document: &Document, header: &DeepLabCutHeader) -> Option<QualityFinding> {
    let tells = |name: &str| SMOOTHED.iter().any(|word| name.to_lowercase().contains(word));
    let who = if tells(document.stem) {
        Some("the name of the file")
    } else {
        header.scorers.iter().any(|scorer| tells(scorer)).then_some("its scorer")
    }?;
    let found = format!(
        "{}: {who} says that the positions were filtered: fast motion is weakened and noise looks smaller \
         than it is",
        document.file
    );
    Some(new_finding(
        Check::Filtered,
        Severity::Caution,
        (1.0, ""),
        found,
        "import the unfiltered table (without `_filtered` in its name) if chatter or noise matters",
    ))
}
