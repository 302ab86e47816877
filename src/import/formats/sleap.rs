//! SLEAP: the analysis CSV and the tables of sleap-io with a row a point, an instance or a frame.

mod columns;

use crate::import::error::{ImportError, TextLocation};
use crate::import::format::FileFormat;
use crate::import::options::ImportOptions;
use crate::import::reader::picked::picked_frames_finding;
use crate::import::reader::{
    DelimitedTable, Document, Facts, RowOrder, RowPosition, RowStamp, RowView, Track, TrackCollector,
    TrackFile,
};
use columns::{FRAME, InstanceColumns, SleapColumns, TrackSource};

/// Between track and node in the key of a row of one point: no name has it.
const SEPARATOR: char = '\u{1f}';
const TRACK_FIRST: &str = "give every instance a track of its own in SLEAP (run the inference with a \
    tracker, or at most one instance), and export again";

/// Tables of SLEAP and sleap-io; sleap-io's table in DeepLabCut's layout is DeepLabCut's.
pub(crate) struct Sleap;

impl FileFormat for Sleap {
    fn name(&self) -> &'static str {
        "sleap"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let row = document.table.as_ref().ok()?.head.first()?;
        let names = row.texts();
        let of_nodes = names.iter().any(|name| name.ends_with(".x"))
            || ["node", "x"].iter().all(|name| names.contains(name));
        (names.contains(&FRAME) && of_nodes)
            .then(|| format!("line {} names `{FRAME}` and coordinates of nodes as SLEAP does", row.line))
    }

    fn read<'a>(
        &self,
        document: &'a Document<'a>,
        _options: &ImportOptions,
    ) -> Result<TrackFile<'a>, ImportError> {
        let table = document.table()?;
        let header =
            table.head.first().ok_or_else(|| ImportError::Empty { file: document.file.to_owned() })?;
        let columns = SleapColumns::find(table, header)?;
        table.refuse_comment_names(header.line, "a track or video", "rename it in SLEAP and export again")?;
        let mut collector = TrackCollector::new(columns.instance_shape());
        let mut video: Option<String> = None;
        let mut rows = table.rows(1);
        while let Some(record) = rows.next_row()? {
            if !record.is_empty() {
                columns.check_row(table, &record, &mut video)?;
                for slot in &columns.slots {
                    read_instance(table, &record, &columns, slot, &mut collector)?;
                }
            }
        }
        let (clocks, mut tracks) =
            collector.finish(document.file, RowOrder::Any).map_err(duplicate_instance_error)?;
        match (columns.node, columns.slots.as_slice(), tracks.as_mut_slice()) {
            (Some(_), ..) => name_by_node(&mut tracks),
            // the only node of the only instance is called by what it is
            (None, [InstanceColumns { nodes, .. }], [track]) if nodes.len() == 1 => {
                track.name.clone_from(&nodes[0].name)
            }
            _ => {}
        }
        // (a table of labels looks like one of predictions)
        let longest = clocks.iter().max_by_key(|clock| clock.len());
        Ok(TrackFile {
            findings: longest
                .and_then(|clock| picked_frames_finding(document.file, clock))
                .into_iter()
                .collect(),
            clocks,
            tracks,
            texts: header.cells.clone(),
            facts: facts(),
            table: Some(table),
            ..TrackFile::for_document(document)
        })
    }
}

fn facts() -> Facts {
    Facts::pixels_down("SLEAP writes image pixels, y downwards")
}

/// An instance of a row; one that has neither a track nor a position only fills the row.
fn read_instance(
    table: &DelimitedTable,
    record: &RowView,
    columns: &SleapColumns,
    slot: &InstanceColumns,
    collector: &mut TrackCollector,
) -> Result<(), ImportError> {
    let number =
        |cell: Option<usize>, name: &str| cell.map_or(Ok(None), |cell| table.number_at(record, cell, name));
    let coordinate = |cell: usize, axis: &str, cells: &columns::NodeCells| {
        // (its name is put together only for a refusal)
        let named = |_| {
            table.not_a_number_error(
                record.line,
                cell,
                record.cell(cell),
                format!("{}.{axis}", cells.name).trim_start_matches('.'),
            )
        };
        table.number_at(record, cell, axis).map_err(named)
    };
    let position = |cells: &columns::NodeCells| -> Result<RowPosition, ImportError> {
        Ok(RowPosition {
            x: coordinate(cells.x, "x", cells)?,
            y: coordinate(cells.y, "y", cells)?,
            confidence: number(cells.score, "score")?,
        })
    };
    let positions = slot.nodes.iter().map(position).collect::<Result<Vec<_>, _>>()?;
    let track = match &slot.whose {
        TrackSource::Cell(cell) => record.cell(*cell),
        TrackSource::Name(name) => name,
        TrackSource::Nobody => "",
    };
    if track.is_empty() && positions.iter().all(|position| position.x.is_none() && position.y.is_none()) {
        return Ok(());
    }
    if track.is_empty() && columns.slots.len() > 1 {
        return Err(untracked_error(
            table.location(record.line, 1).to_string(),
            "an instance without a track in a frame with others".to_owned(),
        ));
    }
    let key = columns
        .node
        .map_or_else(|| track.to_owned(), |node| format!("{track}{SEPARATOR}{}", record.cell(node)));
    collector.add_row(
        &key,
        RowStamp { line: record.line, frame: number(Some(columns.frame), FRAME)?, time: None },
        &positions,
    );
    Ok(())
}

/// Tracks of a table with a row a point are called as those of the others: by their node, by their instance
/// where that has one node only, or by both.
fn name_by_node(tracks: &mut [Track]) {
    let parts: Vec<(String, String)> = tracks
        .iter()
        .filter_map(|track| track.name.split_once(SEPARATOR))
        .map(|(a, b)| (a.to_owned(), b.to_owned()))
        .collect();
    let instances = parts.windows(2).any(|pair| pair[0].0 != pair[1].0);
    let nodes = parts.windows(2).any(|pair| pair[0].1 != pair[1].1);
    for (track, (instance, node)) in tracks.iter_mut().zip(&parts) {
        track.name = match (instances && !instance.is_empty(), nodes) {
            (true, true) => format!("{instance}:{node}"),
            (true, false) => instance.clone(),
            (false, _) => node.clone(),
        };
    }
}

/// Two instances of one track, or of none, in one frame: which of them is which nobody can tell.
fn duplicate_instance_error(error: ImportError) -> ImportError {
    let ImportError::DuplicateRow { place: TextLocation { file, line, column }, found, track, first, .. } =
        error
    else {
        return error;
    };
    let name = track.trim_matches(SEPARATOR).replace(SEPARATOR, ":");
    let whose = if track.is_empty() || track.starts_with(SEPARATOR) {
        "an instance without a track".to_owned()
    } else {
        format!("`{name}`")
    };
    untracked_error(
        TextLocation { file, line, column }.to_string(),
        format!("frame {found} of {whose} a second time (first in line {first})"),
    )
}

fn untracked_error(place: String, found: String) -> ImportError {
    ImportError::wrong_table(place, found, "one instance of a track in a frame", TRACK_FIRST)
}
