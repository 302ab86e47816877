//! DeepLabCut and Lightning Pose: tables under three header rows (four with individuals), and tables of
//! labels set by hand.

mod header;
mod labelled;

use crate::import::error::ImportError;
use crate::import::format::Format;
use crate::import::options::Options;
use crate::import::reader::picked::picked;
use crate::import::reader::{Document, Facts, Layout, Number, Row, Table, TrackFile, finding};
use crate::recording::quality::{Check, Finding, Severity};
use header::{Header, ROW_NAMES};

/// Parts of a file's name or of a scorer's that tell of smoothed positions: DeepLabCut's filtered predictions
/// and the ensemble Kalman smoother of Lightning Pose.
const SMOOTHED: [&str; 3] = ["filtered", "smoother", "smoothed"];
/// Columns of the lengths and angles between body parts.
const SKELETON: [&str; 3] = ["length", "orientation", "likelihood"];

/// Tables of DeepLabCut and of programs that write its layout.
pub(crate) struct DeepLabCut;

impl Format for DeepLabCut {
    fn name(&self) -> &'static str {
        "deeplabcut"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let table = document.table.as_ref().ok()?;
        if let Some(row) = skeleton(table) {
            return Some(format!(
                "line {} names lengths and orientations as DeepLabCut's skeleton does",
                row.line
            ));
        }
        let rows: Vec<&Row> =
            table.head.iter().take(ROW_NAMES.len()).filter(|row| ROW_NAMES.contains(&row.first())).collect();
        let described: Vec<String> =
            rows.iter().map(|row| format!("line {} starts with `{}`", row.line, row.first())).collect();
        (rows.len() > 1 || rows.first().is_some_and(|row| row.first() == ROW_NAMES[0]))
            .then(|| described.join(", "))
    }

    fn read<'a>(&self, document: &'a Document<'a>, _options: &Options) -> Result<TrackFile<'a>, ImportError> {
        let table = document.table()?;
        if let Some(row) = skeleton(table) {
            return Err(wrong_skeleton(table, row));
        }
        let header = Header::find(table)?;
        let mut export = if header.index_cells > 1 || names_images(table, &header) {
            labelled::read(document, table, &header, facts())?
        } else {
            let layout = Layout {
                start: header.start,
                width: header.cells,
                most: header.cells,
                frame: Some(0),
                points: header.points.clone(),
                ..Layout::default()
            };
            let mut export = layout.read(document, table, facts())?;
            if header.points.iter().all(|point| point.confidence.is_none()) {
                // (predictions have a likelihood; what has none may be labels)
                export.findings.extend(export.clocks.iter().filter_map(|clock| picked(document.file, clock)));
            }
            export
        };
        export.notes.extend(header.note());
        export.findings.extend(smoothed(document, &header));
        Ok(export)
    }
}

fn facts() -> Facts {
    Facts::pixels_down("DeepLabCut writes image pixels, y downwards")
}

/// Whether the rows are named by pictures instead of being numbered.
fn names_images(table: &Table, header: &Header) -> bool {
    table
        .head
        .get(header.start)
        .is_some_and(|row| table.number(row.first()) == Number::Text && row.first().contains('.'))
}

fn skeleton<'t>(table: &'t Table) -> Option<&'t Row> {
    let names = |row: &&Row| SKELETON.iter().all(|name| row.cells.iter().any(|cell| cell == name));
    table.head.iter().take(ROW_NAMES.len()).find(names)
}

fn wrong_skeleton(table: &Table, row: &Row) -> ImportError {
    let cell = row.cells.iter().position(|cell| cell == SKELETON[0]).unwrap_or(0);
    ImportError::wrong_table(
        table.place(row.line, table.column(row.line, cell)),
        "lengths and orientations of a skeleton",
        "a table of body parts with the columns x, y and likelihood",
        "import the CSV that analyze_videos writes with save_as_csv=True, the one without \
            `_skeleton` in its name",
    )
}

/// Positions that went through a low-pass filter have lost part of what a spectrum is to show.
fn smoothed(document: &Document, header: &Header) -> Option<Finding> {
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
    Some(finding(
        Check::Filtered,
        Severity::Caution,
        (1.0, ""),
        found,
        "import the unfiltered table (without `_filtered` in its name) if chatter or noise matters",
    ))
}
