//! Reads tables of SLEAP: the analysis CSV, and the tables of sleap-io with one row per point, per instance
//! or per frame.

use crate::import::error::{ImportError, ImportResult, TextLocation};
use crate::import::format::FileFormat;
use crate::import::options::ImportOptions;
use crate::import::reader::findings::picked_frames_finding;
use crate::import::reader::{
    DelimitedTable, Document, Facts, InstanceFields, PointFields, RowOrder, RowPosition, RowStamp, RowView,
    TextRow, Track, TrackCollector, TrackFile,
};

/// Character between the names of track and node in the key of a row, if every row is one point. No name
/// contains this character.
const SEPARATOR: char = '\u{1f}';
const TRACK_FIRST: &str = "give every instance a track of its own in SLEAP (run the inference with a \
    tracker, or at most one instance), and export again";

/// Tables of SLEAP and sleap-io, except those in DeepLabCut's layout.
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

    fn read<'a>(&self, document: &'a Document<'a>, _options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
        let table = document.table()?;
        let header = table.head.first().ok_or_else(|| ImportError::empty(document.file))?;
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
            // (if there is one instance with one node, the track gets the name of the node)
            (None, [InstanceColumns { nodes, .. }], [track]) if nodes.len() == 1 => {
                track.name.clone_from(&nodes[0].name)
            }
            _ => {}
        }
        // (a table of labels has the same columns as a table of predictions, so its frame numbers are
        // checked)
        let longest = clocks.iter().max_by_key(|clock| clock.len());
        let finding = longest.and_then(|clock| picked_frames_finding(document.file, clock));
        Ok(TrackFile {
            findings: finding.into_iter().collect(),
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

/// Reads the positions of one instance in a row. An instance with neither a track nor a position is skipped.
fn read_instance(
    table: &DelimitedTable,
    record: &RowView,
    columns: &SleapColumns,
    slot: &InstanceColumns,
    collector: &mut TrackCollector,
) -> ImportResult<()> {
    let coordinate = |cell: usize, axis: &str, cells: &NodeCells| {
        // (the name of the column is composed only for an error)
        table.number_at(record, cell, axis).map_err(|_| {
            let name = format!("{}.{axis}", cells.name);
            table.not_a_number_error(record.line, cell, record.cell(cell), name.trim_start_matches('.'))
        })
    };
    let position = |cells: &NodeCells| -> ImportResult<RowPosition> {
        Ok(RowPosition {
            x: coordinate(cells.x, "x", cells)?,
            y: coordinate(cells.y, "y", cells)?,
            confidence: table.optional_number_at(record, cells.score, "score")?,
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
        let found = "an instance without a track in a frame with others";
        return Err(untracked_error(table.location(record.line, 1), found));
    }
    let with_node = |node| format!("{track}{SEPARATOR}{}", record.cell(node));
    let key = columns.node.map_or_else(|| track.to_owned(), with_node);
    let frame = table.number_at(record, columns.frame, FRAME)?;
    collector.add_row(&key, RowStamp { line: record.line, frame, time: None }, &positions);
    Ok(())
}

/// Names the tracks of a table with one row per point. A track is named after its node if there is only one
/// instance, after its instance if there is only one node, otherwise after both.
fn name_by_node(tracks: &mut [Track]) {
    let parts = tracks.iter().filter_map(|track| track.name.split_once(SEPARATOR));
    let parts: Vec<(String, String)> = parts.map(|(a, b)| (a.to_owned(), b.to_owned())).collect();
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

/// Replaces the error for a repeated frame by an error that says that the frame contains two instances with
/// the same track or without a track, which cannot be distinguished.
fn duplicate_instance_error(error: ImportError) -> ImportError {
    let ImportError::DuplicateRow { place, found, track, first, .. } = error else { return error };
    let name = track.trim_matches(SEPARATOR).replace(SEPARATOR, ":");
    let whose = if track.is_empty() || track.starts_with(SEPARATOR) {
        "an instance without a track".to_owned()
    } else {
        format!("`{name}`")
    };
    untracked_error(place, &format!("frame {found} of {whose} a second time (first in line {first})"))
}

fn untracked_error(place: TextLocation, found: &str) -> ImportError {
    ImportError::wrong_table(place, found, "one instance of a track in a frame", TRACK_FIRST)
}

/// Name of the column of frame numbers, which count from 0.
pub(crate) const FRAME: &str = "frame_idx";
const TRACK: &str = "track";
const NODE: &str = "node";
/// Names of columns that identify the video.
const VIDEO: [&str; 3] = ["video_path", "video_idx", "video"];
/// Beginning of the names of instances that are numbered anew in each frame, so that a name does not identify
/// a track.
const NUMBERED: &str = "inst";
const ADVICE: &str = "export again with File > Export Analysis CSV, or `sio export FILE.slp -o FILE.csv`";

/// Name of a node (a tracked point of the skeleton), and indices of its columns.
pub(crate) struct NodeCells {
    pub name: String,
    pub x: usize,
    pub y: usize,
    pub score: Option<usize>,
}

/// Where the name of the track of an instance is found.
pub(crate) enum TrackSource {
    /// The cell with this index in each row contains the name.
    Cell(usize),
    /// The column names contain the name of the instance, which is this text.
    Name(String),
    Nobody,
}

/// Columns of an instance (one tracked animal or object).
pub(crate) struct InstanceColumns {
    pub whose: TrackSource,
    pub nodes: Vec<NodeCells>,
}

/// Indices of the columns of a table of SLEAP.
pub(crate) struct SleapColumns {
    pub frame: usize,
    /// Index of the column that names the node, if every row is a point; otherwise `None`.
    pub node: Option<usize>,
    pub slots: Vec<InstanceColumns>,
    video: Option<usize>,
    cells: usize,
}

impl SleapColumns {
    pub(crate) fn find(table: &DelimitedTable, header: &TextRow) -> ImportResult<Self> {
        let names = header.texts();
        let at = |name: &str| names.iter().position(|known| *known == name);
        let refuse = |found: &str, expected: &str| {
            let problem = format!("found {found}, expected {expected}");
            ImportError::columns(table.file, header.line.max(1), problem, ADVICE)
        };
        let columns = format!("the columns {}", names[..names.len().min(12)].join(", "));
        let frame = at(FRAME).ok_or_else(|| refuse(&columns, "frame_idx and the coordinates of nodes"))?;
        let (node, track) = (at(NODE), at(TRACK));
        let nodes = match (node, at("x"), at("y")) {
            (Some(_), Some(x), Some(y)) => vec![NodeCells { name: String::new(), x, y, score: at("score") }],
            (Some(_), ..) => return Err(refuse(&columns, "x and y of every node")),
            _ => find_nodes(&names)
                .map_err(|name| refuse(&format!("the column {name}.x"), &format!("also {name}.y")))?,
        };
        if nodes.is_empty() {
            return Err(refuse(&columns, "NODE.x and NODE.y of every node"));
        }
        let whose = |track: Option<usize>| track.map_or(TrackSource::Nobody, TrackSource::Cell);
        let slots = if node.is_some() || track.is_some() {
            vec![InstanceColumns { whose: whose(track), nodes }]
        } else {
            find_instances(nodes, at)
        };
        if slots.len() > 1 && slots.iter().any(|slot| matches!(slot.whose, TrackSource::Nobody)) {
            return Err(refuse("instances that are numbered again in every frame", "the track of each"));
        }
        let node_names = |slot: &InstanceColumns| slot.nodes.iter().map(|node| node.name.clone()).collect();
        let expected: Vec<String> = slots.first().map_or(vec![], node_names);
        if slots.iter().any(|slot| node_names(slot) != expected) {
            return Err(refuse("instances with different nodes", "the same nodes in each"));
        }
        let (video, cells) = (VIDEO.iter().find_map(|name| at(name)), header.used_width());
        Ok(Self { frame, node, slots, video, cells })
    }

    pub(crate) fn instance_shape(&self) -> InstanceFields {
        let point = |node: &NodeCells| PointFields {
            name: node.name.clone(),
            has_y: true,
            has_confidence: node.score.is_some(),
            ..PointFields::default()
        };
        let points = self.slots.first().map_or(vec![], |slot| slot.nodes.iter().map(point).collect());
        InstanceFields { has_frame: true, has_time: false, clock_cell: self.frame, points }
    }

    /// Refuses a row with a wrong number of cells, or with another video than the rows before it. `video` is
    /// the video of the first row; that row sets it.
    pub(crate) fn check_row(
        &self,
        table: &DelimitedTable,
        record: &RowView,
        video: &mut Option<String>,
    ) -> ImportResult<()> {
        if record.len() < self.cells || record.used_width() > self.cells {
            return Err(table.ragged_error(record.line, record.len(), self.cells));
        }
        let Some(cell) = self.video else { return Ok(()) };
        let (known, found) = (video.get_or_insert_with(|| record.cell(cell).to_owned()), record.cell(cell));
        if known == found {
            return Ok(());
        }
        Err(ImportError::wrong_table(
            table.cell_location(record.line, cell),
            format!("a row of the video `{found}` after those of `{known}`"),
            "the rows of one video",
            "export each video to a file of its own",
        ))
    }
}

/// Finds the nodes in the column names. A node has the columns `NAME.x`, `NAME.y` and perhaps `NAME.score`.
///
/// # Errors
/// The name of the first node that has no column for y.
fn find_nodes(names: &[&str]) -> Result<Vec<NodeCells>, String> {
    let at = |name: String| names.iter().position(|known| *known == name);
    let node = |(x, name): (usize, &str)| {
        let y = at(format!("{name}.y")).ok_or_else(|| name.to_owned())?;
        Ok(NodeCells { name: name.to_owned(), x, y, score: at(format!("{name}.score")) })
    };
    let columns = names.iter().enumerate().filter_map(|(x, name)| Some((x, name.strip_suffix(".x")?)));
    columns.map(node).collect()
}

/// Groups the nodes of a table with one row per frame by their instance. The column names have the form
/// `INSTANCE.NODE.x`.
fn find_instances(nodes: Vec<NodeCells>, at: impl Fn(&str) -> Option<usize>) -> Vec<InstanceColumns> {
    let mut slots: Vec<(String, InstanceColumns)> = vec![];
    for mut node in nodes {
        let (instance, name) = node.name.split_once('.').unwrap_or(("", &node.name));
        let (instance, name) = (instance.to_owned(), name.to_owned());
        node.name = name;
        let numbered = instance.is_empty()
            || instance.strip_prefix(NUMBERED).is_some_and(|number| number.parse::<u32>().is_ok());
        let whose = match at(&format!("{instance}.{TRACK}")) {
            Some(cell) => TrackSource::Cell(cell),
            None if numbered => TrackSource::Nobody,
            None => TrackSource::Name(instance.clone()),
        };
        match slots.iter_mut().find(|(known, _)| *known == instance) {
            Some((_, slot)) => slot.nodes.push(node),
            None => slots.push((instance, InstanceColumns { whose, nodes: vec![node] })),
        }
    }
    slots.into_iter().map(|(_, slot)| slot).collect()
}
