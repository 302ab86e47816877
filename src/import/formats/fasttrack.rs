//! FastTrack: one row an object and image, with its head, its tail and its body.

use crate::import::error::ImportError;
use crate::import::format::Format;
use crate::import::options::Options;
use crate::import::reader::{Document, Facts, Layout, Order, PointCells, TrackFile, named_columns};

/// Points of an object: what they are called here, and their columns.
const POINTS: [(&str, &str, &str); 3] =
    [("head", "xHead", "yHead"), ("tail", "xTail", "yTail"), ("body", "xBody", "yBody")];
const FRAME: &str = "imageNumber";
const OBJECT: &str = "id";

/// FastTrack's `tracking.txt`.
pub(crate) struct FastTrack;

impl Format for FastTrack {
    fn name(&self) -> &'static str {
        "fasttrack"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let of_fasttrack = |names: &[&str]| {
            POINTS.iter().filter(|point| names.contains(&point.1) && names.contains(&point.2)).count() > 1
        };
        let (_, row) = named_columns::header(document.table.as_ref().ok()?, of_fasttrack)?;
        Some(format!("line {} names xHead, xTail or xBody as FastTrack does", row.line))
    }

    fn read<'a>(&self, document: &'a Document<'a>, _options: &Options) -> Result<TrackFile<'a>, ImportError> {
        let table = document.table()?;
        let wanted = "xHead, yHead, xTail, yTail, xBody, yBody, imageNumber and id";
        let advice = "take the file tracking.txt from the folder Tracking_Result as FastTrack wrote it";
        let has_point = |names: &[&str]| POINTS.iter().any(|point| names.contains(&point.1));
        let (header, row) = named_columns::header(table, has_point)
            .ok_or_else(|| named_columns::no_column(table, None, wanted, advice))?;
        let at = |name: &str| row.cells.iter().position(|cell| cell == name);
        let (Some(frame), Some(object)) = (at(FRAME), at(OBJECT)) else {
            return Err(named_columns::no_column(table, Some(row.line), wanted, advice));
        };
        let points: Vec<PointCells> = POINTS
            .iter()
            .filter_map(|(name, x, y)| Some(PointCells::new(*name, at(x)?, Some(at(y)?))))
            .collect();
        if points.is_empty() {
            return Err(named_columns::no_column(table, Some(row.line), wanted, advice));
        }
        let layout = Layout {
            start: header + 1,
            width: row.filled(),
            most: row.filled(),
            frame: Some(frame),
            key: vec![object],
            order: Order::Any,
            points,
            ..Layout::default()
        };
        let facts = Facts::pixels_down("FastTrack writes image coordinates from the upper left corner");
        let mut export = layout.read(document, table, facts)?;
        export.notes.push(
            "FastTrack's head is the larger end of the object that it found; with several \
            objects a point is called id:head"
                .to_owned(),
        );
        Ok(export)
    }
}
