//! Labels set by hand: rows are named by the pictures taken from a video, whose names end in the frame
//! number.

use crate::import::error::{CellProblem, ImportError};
use crate::import::formats::deeplabcut::header::DeepLabCutHeader;
use crate::import::reader::picked::picked_frames_finding;
use crate::import::reader::{
    DelimitedTable, Document, Facts, InstanceFields, PointCells, PointFields, RowOrder, RowPosition,
    RowStamp, RowView, TrackCollector, TrackFile,
};

/// Reads every picture's row; a video's pictures come in any order and leave most frames out.
pub(crate) fn read_labels<'a>(
    document: &'a Document,
    table: &'a DelimitedTable,
    header: &DeepLabCutHeader,
    facts: Facts,
) -> Result<TrackFile<'a>, ImportError> {
    let point = |p: &PointCells| PointFields {
        name: p.name.clone(),
        has_y: true,
        has_confidence: p.confidence.is_some(),
    };
    let image_cell = header.index_cells - 1;
    let shape = InstanceFields {
        has_frame: true,
        has_time: false,
        clock_cell: image_cell,
        points: header.points.iter().map(point).collect(),
    };
    let mut collector = TrackCollector::new(shape);
    let (mut video, mut count): (Option<String>, usize) = (None, 0);
    let mut positions = vec![RowPosition::default(); header.points.len()];
    let mut rows = table.rows(header.start);
    while let Some(record) = rows.next_row()? {
        if record.is_empty() {
            continue;
        }
        table.check_row_length(&record, header.cells, header.cells)?;
        let (folder, image) = split_picture_path(&record, header.index_cells);
        check_same_video(table, &record, video.get_or_insert_with(|| folder.clone()), &folder)?;
        let frame =
            frame_number(image).ok_or_else(|| unnumbered_picture_error(table, &record, image_cell))?;
        for (position, cells) in positions.iter_mut().zip(&header.points) {
            *position = read_label(table, &record, cells)?;
        }
        collector.add_row("", RowStamp { line: record.line, frame: Some(frame), time: None }, &positions);
        count += 1;
    }
    let video = video.unwrap_or_default();
    let (clocks, tracks) =
        collector.finish(document.file, RowOrder::Any).map_err(|error| name_video_in_error(error, &video))?;
    let findings = clocks.iter().filter_map(|clock| picked_frames_finding(document.file, clock)).collect();
    Ok(TrackFile {
        table: Some(table),
        findings,
        clocks,
        tracks,
        facts,
        notes: vec![format!(
            "labels of {count} pictures of the video `{video}`; the names of the pictures give the frames"
        )],
        texts: table.head.iter().take(header.start).flat_map(|row| row.cells.iter().cloned()).collect(),
        ..TrackFile::for_document(document)
    })
}

fn read_label(
    table: &DelimitedTable,
    record: &RowView,
    cells: &PointCells,
) -> Result<RowPosition, ImportError> {
    let value = |cell: Option<usize>, axis: &str| {
        table.optional_number_at(record, cell, &format!("{axis} of {}", cells.name))
    };
    let [x, y] = [&cells.x, &cells.y].map(|cells| cells.first().copied());
    Ok(RowPosition {
        x: value(x, "x")?,
        y: value(y, "y")?,
        confidence: value(cells.confidence, "likelihood")?,
    })
}

/// The folder of a row's picture (its video's name) and the picture's name.
fn split_picture_path<'r>(record: &RowView<'r>, index_cells: usize) -> (String, &'r str) {
    if index_cells > 1 {
        return (record.cell(index_cells - 2).to_owned(), record.cell(index_cells - 1));
    }
    let path = record.cell(0);
    let (folder, image) = path.rsplit_once(['/', '\\']).unwrap_or(("", path));
    (folder.rsplit(['/', '\\']).next().unwrap_or("").to_owned(), image)
}

/// The number in which a picture's name ends, without its extension.
fn frame_number(image: &str) -> Option<f64> {
    let stem = image.rsplit_once('.').map_or(image, |(stem, _)| stem);
    let digits = stem.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    stem.get(digits..)?.parse::<u32>().ok().map(f64::from)
}

fn check_same_video(
    table: &DelimitedTable,
    record: &RowView,
    video: &str,
    folder: &str,
) -> Result<(), ImportError> {
    if video == folder {
        return Ok(());
    }
    Err(ImportError::wrong_table(
        table.location(record.line, 1),
        format!("a picture of the video `{folder}` after those of `{video}`"),
        "the labels of one video",
        "import the CollectedData file in the folder of one video, not the merged data set",
    ))
}

fn unnumbered_picture_error(table: &DelimitedTable, record: &RowView, cell: usize) -> ImportError {
    ImportError::Cell {
        place: table.location(record.line, table.text_column(record.line, cell)),
        problem: CellProblem::NotAFrame,
        name: "picture".to_owned(),
        found: record.cell(cell).chars().take(60).collect::<String>().into(),
        expected: "a picture whose name ends in its frame number, such as img0042.png",
        advice: "rename the pictures by their frames in the table, or import the table of analyze_videos, \
            which numbers the frames",
    }
}

/// The track of all points of a picture has no name: a refusal names the video.
fn name_video_in_error(error: ImportError, video: &str) -> ImportError {
    match error {
        ImportError::DuplicateRow { place, what, found, first, .. } => {
            ImportError::DuplicateRow { place, what, found, first, track: video.to_owned() }
        }
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_of_a_pictures_name_is_its_frame() {
        for (name, frame) in [
            ("img0042.png", Some(42.0)),
            ("img7.tif", Some(7.0)),
            ("run2_000.png", Some(0.0)),
            ("12", Some(12.0)),
        ] {
            assert_eq!(frame_number(name), frame, "{name}");
        }
        for name in ["img.png", "img12_crop.png", "", "img99999999999999999999.png", "é.png"] {
            assert_eq!(frame_number(name), None, "{name}");
        }
    }
}
