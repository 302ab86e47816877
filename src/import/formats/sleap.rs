//! Reads tables of SLEAP: the analysis CSV, and the tables of sleap-io with one row per point, per instance
//! or per frame.

use crate::import::format::*;
use crate::import::reader::findings::picked_frames_finding;

/// Name of the column of frame numbers; the first frame of the video is 0.
const FRAME: &str = "frame_idx";
const TRACK: &str = "track";
const NODE: &str = "node";
/// Columns that name the video.
const VIDEO: [&str; 3] = ["video_path", "video_idx", "video"];
/// Prefix of the names of instances that are numbered anew in each frame.
const NUMBERED: &str = "inst";
/// Separates the names of track and node in the key of a row with one point; no name contains it.
const SEPARATOR: char = '\u{1f}';
const ADVICE: &str = "export again with File > Export Analysis CSV, or `sio export FILE.slp -o FILE.csv`";
const TRACK_FIRST: &str = "give every instance a track of its own in SLEAP (run the inference with a \
    tracker, or at most one instance), and export again";

/// Tables of SLEAP and sleap-io, except those in DeepLabCut's layout.
pub(super) const FORMAT: FormatParser =
    FormatParser { name: "sleap", recognises: recognise_export, read: read_export };

fn recognise_export(document: &Document) -> Option<String> {
    let row = document.table.as_ref().ok()?.head.first()?;
    let of_nodes = row.cells.iter().any(|name| name.ends_with(".x")) || (row.has(NODE) && row.has("x"));
    (row.has(FRAME) && of_nodes)
        .then(|| format!("line {} names `{FRAME}` and coordinates of nodes as SLEAP does", row.line))
}

fn read_export<'a>(document: &'a Document<'a>, _options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
    let table = document.table()?;
    let header = table.head.first().ok_or_else(|| ImportError::empty(document.file))?;
    let columns = SleapColumns::find(table, header)?;
    table.refuse_comment_names(header.line, "a track or video", "rename it in SLEAP and export again")?;
    let points = columns.instances[0].nodes.iter().map(PointCells::fields).collect();
    let fields = InstanceFields { has_frame: true, has_time: false, clock_cell: columns.frame, points };
    let mut collector = TrackCollector::new(fields);
    let width = header.used_width();
    let mut rows = table.rows(1);
    while let Some(record) = rows.next_row()? {
        if record.is_empty() {
            continue;
        }
        table.check_row_length(&record, width, width)?;
        for instance in &columns.instances {
            columns.read_instance(table, &record, instance, &mut collector)?;
        }
    }
    // (this follows the rows, because a row that is cut short also seems to name another video)
    columns.refuse_other_video(table)?;
    let found = collector.finish(document.file, RowOrder::Any);
    let (clocks, mut tracks) = found.map_err(duplicate_instance_error)?;
    match (columns.node, columns.instances.as_slice(), tracks.as_mut_slice()) {
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
        facts: Facts::pixels_down("SLEAP writes image pixels, y downwards"),
        table: Some(table),
        ..TrackFile::for_document(document)
    })
}

/// Names the tracks of a table with one row per point: by the node if there is only one instance, by the
/// instance if there is only one node, and otherwise by both.
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
    let whose = if track.is_empty() || track.starts_with(SEPARATOR) {
        "an instance without a track".to_owned()
    } else {
        format!("`{}`", track.trim_matches(SEPARATOR).replace(SEPARATOR, ":"))
    };
    untracked_error(place, &format!("frame {found} of {whose} a second time (first in line {first})"))
}

fn untracked_error(place: TextLocation, found: &str) -> ImportError {
    ImportError::wrong_table(place, found, "one instance of a track in a frame", TRACK_FIRST)
}

/// Where the track of an instance is named.
enum TrackSource {
    /// In a cell of the row; the value is the index of this cell.
    Cell(usize),
    /// In the names of the instance's columns; the value is the name of the instance, or empty if the
    /// instances are numbered anew in each frame.
    Name(String),
}

/// Columns of an instance.
struct InstanceColumns {
    whose: TrackSource,
    nodes: Vec<PointCells>,
}

/// Columns of a table.
struct SleapColumns {
    frame: usize,
    /// Column that names the node, if every row is a point.
    node: Option<usize>,
    instances: Vec<InstanceColumns>,
    video: Option<usize>,
}

impl SleapColumns {
    fn find(table: &DelimitedTable, header: &TextRow) -> ImportResult<Self> {
        let at = |name: &str| header.position(name);
        let refuse = |found: &str, expected: &str| {
            let problem = format!("found {found}, expected {expected}");
            Err(ImportError::columns(table.file, header.line, problem, ADVICE))
        };
        let columns =
            format!("the columns {}", header.texts().into_iter().take(12).collect::<Vec<_>>().join(", "));
        let Some(frame) = at(FRAME) else {
            return refuse(&columns, "frame_idx and the coordinates of nodes");
        };
        let (node, mut nodes) = (at(NODE), vec![]);
        let names = header.cells.iter().filter_map(|name| name.strip_suffix(".x"));
        let prefixes = if node.is_some() { vec![""] } else { names.collect() };
        for name in prefixes {
            let column = |end: &str| at(format!("{name}.{end}").trim_start_matches('.'));
            let (Some(x), Some(y)) = (column("x"), column("y")) else {
                return refuse(&format!("the column {name}.x"), &format!("also {name}.y"));
            };
            nodes.push(PointCells { confidence: column("score"), ..PointCells::new(name, x, Some(y)) });
        }
        let instances = match at(TRACK) {
            Some(track) => vec![InstanceColumns { whose: TrackSource::Cell(track), nodes }],
            None if node.is_some() => {
                vec![InstanceColumns { whose: TrackSource::Name(String::new()), nodes }]
            }
            None => group_by_instance(nodes, at),
        };
        let Some(first) = instances.first() else {
            return refuse(&columns, "NODE.x and NODE.y of every node");
        };
        let numbered = |of: &InstanceColumns| matches!(&of.whose, TrackSource::Name(name) if name.is_empty());
        if instances.len() > 1 && instances.iter().any(numbered) {
            return refuse("instances that are numbered again in every frame", "the track of each");
        }
        let names = |of: &InstanceColumns| of.nodes.iter().map(|node| node.name.clone()).collect::<Vec<_>>();
        if instances.iter().any(|other| names(other) != names(first)) {
            return refuse("instances with different nodes", "the same nodes in each");
        }
        Ok(Self { frame, node, video: VIDEO.iter().find_map(|name| at(name)), instances })
    }

    /// Refuses a table with rows of several videos.
    fn refuse_other_video(&self, table: &DelimitedTable) -> ImportResult<()> {
        let Some(cell) = self.video else { return Ok(()) };
        let (known, other) = table.find_change(1, |record| record.cell(cell).to_owned())?;
        let Some((line, other)) = other else { return Ok(()) };
        let found = format!("a row of the video `{other}` after those of `{known}`");
        let (place, advice) = (table.cell_location(line, cell), "export each video to a file of its own");
        Err(ImportError::wrong_table(place, found, "the rows of one video", advice))
    }

    /// Reads one instance of a row. An instance with neither a track nor a position is skipped.
    fn read_instance(
        &self,
        table: &DelimitedTable,
        record: &RowView,
        instance: &InstanceColumns,
        collector: &mut TrackCollector,
    ) -> ImportResult<()> {
        let mut positions = vec![];
        for PointCells { name, x, y, confidence, .. } in &instance.nodes {
            let number = |cell: Option<usize>, axis: &str| {
                let name = format!("{name}.{axis}");
                table.optional_number_at(record, cell, name.trim_start_matches('.'))
            };
            let [x, y] = [number(x.first().copied(), "x")?, number(y.first().copied(), "y")?];
            positions.push(RowPosition { x, y, confidence: number(*confidence, "score")? });
        }
        let track = match &instance.whose {
            TrackSource::Cell(cell) => record.cell(*cell),
            TrackSource::Name(name) => name,
        };
        if track.is_empty() && positions.iter().all(|position| position.x.is_none() && position.y.is_none()) {
            return Ok(());
        }
        if track.is_empty() && self.instances.len() > 1 {
            let found = "an instance without a track in a frame with others";
            return Err(untracked_error(table.location(record.line, 1), found));
        }
        let with_node = |node| format!("{track}{SEPARATOR}{}", record.cell(node));
        let key = self.node.map_or_else(|| track.to_owned(), with_node);
        let frame = table.number_at(record, self.frame, FRAME)?;
        collector.add_row(&key, RowStamp { line: record.line, frame, time: None }, &positions);
        Ok(())
    }
}

/// Groups the nodes of a table with one row per frame by instance: their columns are `INSTANCE.NODE.x`.
fn group_by_instance(nodes: Vec<PointCells>, at: impl Fn(&str) -> Option<usize>) -> Vec<InstanceColumns> {
    let mut instances: Vec<(String, InstanceColumns)> = vec![];
    for node in nodes {
        let (instance, name) = node.name.split_once('.').unwrap_or(("", &node.name));
        let (instance, node) = (instance.to_owned(), PointCells { name: name.to_owned(), ..node.clone() });
        if let Some((_, columns)) = instances.iter_mut().find(|(known, _)| *known == instance) {
            columns.nodes.push(node);
            continue;
        }
        let numbered = instance.strip_prefix(NUMBERED).is_some_and(|number| number.parse::<u32>().is_ok());
        let name = if numbered { String::new() } else { instance.clone() };
        let whose = at(&format!("{instance}.{TRACK}")).map_or(TrackSource::Name(name), TrackSource::Cell);
        instances.push((instance, InstanceColumns { whose, nodes: vec![node] }));
    }
    instances.into_iter().map(|(_, columns)| columns).collect()
}
