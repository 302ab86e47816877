//! AnimalTA: coordinates of all animals side by side, or one row an animal and frame. Frames count; the times
//! are rounded and may break.

use crate::import::error::ImportError;
use crate::import::format::Format;
use crate::import::options::Options;
use crate::import::reader::{Document, Facts, Layout, Order, PointCells, Row, TrackFile, named_columns};
use crate::recording::files::YAxis;

/// Rounding of its times, s.
const QUANTUM_S: f64 = 0.01;
const FRAME: &str = "Frame";
const TIME: &str = "Time";
/// What the names of a wide table's columns start with, before the name of the animal.
const WIDE: [&str; 2] = ["X_", "Y_"];
/// What the name of an animal in a wide table starts with.
const ARENA: &str = "Arena";
/// Columns of a long table that name the animal.
const ANIMAL: [&str; 2] = ["Arena", "Ind"];
const POSITION: [&str; 2] = ["X", "Y"];

/// AnimalTA's coordinates.
pub(crate) struct AnimalTa;

fn is_wide(names: &[&str]) -> bool {
    names.iter().any(|name| {
        name.strip_prefix(WIDE[0]).is_some_and(|animal| animal.starts_with(ARENA) && animal.contains("_Ind"))
    })
}

fn is_long(names: &[&str]) -> bool {
    [FRAME, TIME].iter().chain(&ANIMAL).chain(&POSITION).all(|name| names.contains(name))
}

impl Format for AnimalTa {
    fn name(&self) -> &'static str {
        "animalta"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let (_, row) =
            named_columns::header(document.table.as_ref().ok()?, |names| is_wide(names) || is_long(names))?;
        Some(format!("line {} names frames, arenas and individuals as AnimalTA does", row.line))
    }

    fn read<'a>(&self, document: &'a Document<'a>, options: &Options) -> Result<TrackFile<'a>, ImportError> {
        let table = document.table()?;
        let wanted = "Frame, Time and X_Arena0_Ind0, Y_Arena0_Ind0, ... or Arena, Ind, X, Y";
        let advice =
            "take a file from the folder coordinates of the AnimalTA project, not one of its results";
        let refuse = |line: Option<usize>| named_columns::no_column(table, line, wanted, advice);
        let (header, row) = named_columns::header(table, |names| is_wide(names) || is_long(names))
            .ok_or_else(|| refuse(None))?;
        let at = |name: &str| row.cells.iter().position(|cell| cell == name);
        let long = is_long(&row.texts());
        let frame = at(FRAME).ok_or_else(|| refuse(Some(row.line)))?;
        let layout = Layout {
            start: header + 1,
            width: row.filled(),
            most: row.filled(),
            frame: Some(frame),
            time: at(TIME),
            key: if long { ANIMAL.iter().filter_map(|name| at(name)).collect() } else { vec![] },
            order: if long { Order::Any } else { Order::AsWritten },
            points: if long {
                at(POSITION[0]).map(|x| PointCells::new("", x, at(POSITION[1]))).into_iter().collect()
            } else {
                points(row)
            },
            ..Layout::default()
        };
        let why = "AnimalTA writes image coordinates from the upper left corner".to_owned();
        let mut export =
            layout.read(document, table, Facts { y_axis: Some((YAxis::Down, why)), ..Facts::default() })?;
        if long {
            name_as_wide(&mut export);
        }
        named_columns::leave_out_useless_times(&mut export, options, QUANTUM_S);
        Ok(export)
    }
}

/// The animals of a wide table, each an X and its Y.
fn points(row: &Row) -> Vec<PointCells> {
    let at = |name: String| row.cells.iter().position(|cell| *cell == name);
    let animals = row.cells.iter().enumerate().filter_map(|(x, name)| Some((x, name.strip_prefix(WIDE[0])?)));
    animals.map(|(x, animal)| PointCells::new(animal, x, at(format!("{}{animal}", WIDE[1])))).collect()
}

/// Animals of a long table are called as those of a wide one.
fn name_as_wide(export: &mut TrackFile) {
    for track in &mut export.tracks {
        if let Some((arena, animal)) = track.name.split_once(':') {
            let (arena, animal) = (arena.trim_start_matches(ARENA), animal.trim_start_matches("Ind"));
            track.name = format!("Arena{arena}_Ind{animal}");
        }
    }
}
