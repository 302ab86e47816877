//! Which columns of a table of SLEAP are what.

use crate::import::error::ImportError;
use crate::import::reader::{DelimitedTable, InstanceFields, PointFields, RowView, TextRow};

/// Column of the frame numbers, from 0.
pub(crate) const FRAME: &str = "frame_idx";
const TRACK: &str = "track";
const NODE: &str = "node";
/// Columns that name the video.
const VIDEO: [&str; 3] = ["video_path", "video_idx", "video"];
/// Prefix of instances that are numbered within each frame.
const NUMBERED: &str = "inst";
const ADVICE: &str = "export again with File > Export Analysis CSV, or `sio export FILE.slp -o FILE.csv`";

/// Columns of a node.
pub(crate) struct NodeCells {
    pub name: String,
    pub x: usize,
    pub y: usize,
    pub score: Option<usize>,
}

/// What says to which track an instance belongs.
pub(crate) enum TrackSource {
    /// A cell of its row.
    Cell(usize),
    /// The names of its columns.
    Name(String),
    /// Nothing.
    Nobody,
}

/// Columns of an instance.
pub(crate) struct InstanceColumns {
    pub whose: TrackSource,
    pub nodes: Vec<NodeCells>,
}

/// Columns of a table.
pub(crate) struct SleapColumns {
    pub frame: usize,
    /// Column that names the node, where every row is a point.
    pub node: Option<usize>,
    pub slots: Vec<InstanceColumns>,
    video: Option<usize>,
    cells: usize,
}

impl SleapColumns {
    pub(crate) fn find(table: &DelimitedTable, header: &TextRow) -> Result<Self, ImportError> {
        let names = header.texts();
        let at = |name: &str| names.iter().position(|known| *known == name);
        let refuse = |found: String, expected: &str| {
            columns_error(table, header, format!("found {found}, expected {expected}"))
        };
        let frame = at(FRAME).ok_or_else(|| {
            refuse(format!("the columns {}", join_names(&names)), "frame_idx and the coordinates of nodes")
        })?;
        let (node, track) = (at(NODE), at(TRACK));
        let nodes = match (node, at("x"), at("y")) {
            (Some(_), Some(x), Some(y)) => vec![NodeCells { name: String::new(), x, y, score: at("score") }],
            (Some(_), ..) => {
                return Err(refuse(format!("the columns {}", join_names(&names)), "x and y of every node"));
            }
            _ => find_nodes(&names).map_err(|(found, expected)| refuse(found, &expected))?,
        };
        let whose = |track: Option<usize>| track.map_or(TrackSource::Nobody, TrackSource::Cell);
        let slots = if node.is_some() || track.is_some() {
            vec![InstanceColumns { whose: whose(track), nodes }]
        } else {
            find_instances(nodes, at)
        };
        if slots.len() > 1 && slots.iter().any(|slot| matches!(slot.whose, TrackSource::Nobody)) {
            return Err(refuse(
                "instances that are numbered again in every frame".to_owned(),
                "the track of each",
            ));
        }
        if slots.iter().any(|slot| {
            slot.nodes.iter().map(|node| &node.name).ne(slots[0].nodes.iter().map(|node| &node.name))
        }) {
            return Err(refuse("instances with different nodes".to_owned(), "the same nodes in each"));
        }
        Ok(Self {
            frame,
            node,
            slots,
            video: VIDEO.iter().find_map(|name| at(name)),
            cells: header.used_width(),
        })
    }

    pub(crate) fn instance_shape(&self) -> InstanceFields {
        let point = |node: &NodeCells| PointFields {
            name: node.name.clone(),
            has_y: true,
            has_confidence: node.score.is_some(),
        };
        let points = self.slots.first().map_or(vec![], |slot| slot.nodes.iter().map(point).collect());
        InstanceFields { has_frame: true, has_time: false, clock_cell: self.frame, points }
    }

    /// Refuses a row of another length or of another video than the `video` of the rows before.
    pub(crate) fn check_row(
        &self,
        table: &DelimitedTable,
        record: &RowView,
        video: &mut Option<String>,
    ) -> Result<(), ImportError> {
        if record.len() < self.cells || record.used_width() > self.cells {
            return Err(ImportError::Ragged {
                place: table.location(record.line, 1),
                found: record.len(),
                expected: self.cells,
            });
        }
        let Some(cell) = self.video else { return Ok(()) };
        let (known, found) = (video.get_or_insert_with(|| record.cell(cell).to_owned()), record.cell(cell));
        if known == found {
            return Ok(());
        }
        Err(ImportError::wrong_table(
            table.location(record.line, table.text_column(record.line, cell)),
            format!("a row of the video `{found}` after those of `{known}`"),
            "the rows of one video",
            "export each video to a file of its own",
        ))
    }
}

/// A column `NAME.x` and what belongs to it.
fn find_nodes(names: &[&str]) -> Result<Vec<NodeCells>, (String, String)> {
    let at = |name: String| names.iter().position(|known| *known == name);
    let node = |(x, name): (usize, &str)| -> Result<NodeCells, (String, String)> {
        let y = at(format!("{name}.y"))
            .ok_or_else(|| (format!("the column {name}.x"), format!("also {name}.y")))?;
        Ok(NodeCells { name: name.to_owned(), x, y, score: at(format!("{name}.score")) })
    };
    let nodes: Vec<NodeCells> = names
        .iter()
        .enumerate()
        .filter_map(|(x, name)| Some((x, name.strip_suffix(".x")?)))
        .map(node)
        .collect::<Result<_, (String, String)>>()?;
    if nodes.is_empty() {
        Err((format!("the columns {}", join_names(names)), "NODE.x and NODE.y of every node".to_owned()))
    } else {
        Ok(nodes)
    }
}

/// The instances of a table with a row a frame, whose columns are `INSTANCE.NODE.x`.
fn find_instances(nodes: Vec<NodeCells>, at: impl Fn(&str) -> Option<usize>) -> Vec<InstanceColumns> {
    let mut slots: Vec<(String, InstanceColumns)> = vec![];
    for mut node in nodes {
        let (instance, name) = node
            .name
            .split_once('.')
            .map_or((String::new(), node.name.clone()), |(i, n)| (i.to_owned(), n.to_owned()));
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

fn join_names(names: &[&str]) -> String {
    names.iter().take(12).copied().collect::<Vec<_>>().join(", ")
}

fn columns_error(table: &DelimitedTable, header: &TextRow, problem: String) -> ImportError {
    ImportError::columns(table.file, header.line.max(1), problem, ADVICE)
}
