//! idtracker.ai: `trajectories.csv` (a time, then x and y of each animal) and `trajectories_tidy.csv` (a row
//! a frame and animal).

use crate::import::error::ImportError;
use crate::import::format::Format;
use crate::import::options::Options;
use crate::import::reader::rounding::RATE_AGREEMENT;
use crate::import::reader::{
    Column, Document, Facts, Layout, Order, PointCells, Row, Table, TrackFile, named_columns,
};
use crate::recording::clock::OFF_GRID_LIMIT_FRAMES;
use crate::recording::files::YAxis;

/// Rounding of the times of `trajectories.csv`, s.
const QUANTUM_S: f64 = 1e-3;
/// Names of the time column: of older versions, and of version 6, which tables of one's own use too.
const TIMES: [&str; 2] = ["seconds", "time"];
const TIDY: [&str; 5] = ["frame", "time", "individual", "x", "y"];
const PROBABILITY: &str = "probability";
/// Columns of `id_probabilities.csv`, which idtracker.ai writes next to the trajectories.
const PROBABILITIES: &str = "id_probabilities";

/// idtracker.ai's tables.
pub(crate) struct IdTracker;

/// Layouts of its tables.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// With the time column of older versions.
    Seconds,
    /// With that of version 6.
    Time,
    /// Without times, which is how a video of unknown rate is written.
    Untimed,
    Tidy,
    Probabilities,
}

fn kind(names: &[&str]) -> Option<Kind> {
    let names = &names[..names.iter().rposition(|name| !name.is_empty()).map_or(0, |last| last + 1)];
    if names.iter().any(|name| name.starts_with(PROBABILITIES)) {
        return Some(Kind::Probabilities);
    }
    if TIDY.iter().chain([&PROBABILITY]).all(|name| names.contains(name)) {
        return Some(Kind::Tidy);
    }
    let (first, rest) = names.split_first()?;
    match TIMES.iter().position(|time| time == first) {
        Some(index) if is_pairs(rest) => Some(if index == 0 { Kind::Seconds } else { Kind::Time }),
        None if is_pairs(names) => Some(Kind::Untimed),
        _ => None,
    }
}

/// x1, y1, x2, y2, ... and nothing else.
fn is_pairs(names: &[&str]) -> bool {
    let expected =
        |index: usize| format!("{}{}", if index.is_multiple_of(2) { 'x' } else { 'y' }, index / 2 + 1);
    !names.is_empty()
        && names.len().is_multiple_of(2)
        && names.iter().enumerate().all(|(index, name)| *name == expected(index))
}

impl Format for IdTracker {
    fn name(&self) -> &'static str {
        "idtracker"
    }

    /// Columns x1, y1, ... without a time may be anything, such as corners of a box.
    fn recognises(&self, document: &Document) -> Option<String> {
        let (_, row) = named_columns::header(document.table.as_ref().ok()?, |names| {
            kind(names).is_some_and(|kind| kind != Kind::Untimed)
        })?;
        Some(format!(
            "line {} names the columns {} as idtracker.ai does",
            row.line,
            row.cells.iter().take(3).cloned().collect::<Vec<_>>().join(", ")
        ))
    }

    fn read<'a>(&self, document: &'a Document<'a>, options: &Options) -> Result<TrackFile<'a>, ImportError> {
        let table = document.table()?;
        let wanted = "seconds or time, then x1, y1, x2, y2, ...";
        let (header, row) = named_columns::header(table, |names| kind(names).is_some())
            .ok_or_else(|| named_columns::no_column(table, None, wanted, REMEDY))?;
        let kind = kind(&row.texts()).unwrap_or(Kind::Untimed);
        let sure = kind != Kind::Time || options.format.as_deref() == Some("idtracker");
        let why = "idtracker.ai writes image coordinates from the upper left corner".to_owned();
        let facts = Facts { y_axis: sure.then_some((YAxis::Down, why)), ..Facts::default() };
        match kind {
            Kind::Probabilities => Err(probabilities(table, row)),
            Kind::Tidy => tidy(document, table, (header, row), facts),
            _ => wide(document, table, (header, row), (kind, facts), options),
        }
        .map(|mut export| {
            if !sure {
                export.notes.push(
                    "the header may be one of your own too: the direction of y is asked for; --format \
                        idtracker takes it as idtracker.ai's"
                        .to_owned(),
                );
            }
            named_columns::leave_out_useless_times(&mut export, options, QUANTUM_S);
            export
        })
    }
}

/// What to take instead.
const REMEDY: &str = "take trajectories.csv from the folder trajectories/trajectories_csv of the session";

fn probabilities(table: &Table, row: &Row) -> ImportError {
    let cell = row.cells.iter().position(|name| name.starts_with(PROBABILITIES)).unwrap_or(0);
    ImportError::wrong_table(
        table.place(row.line, table.column(row.line, cell)),
        format!("idtracker.ai's table of identity probabilities (column {})", row.cells[cell]),
        "its table of trajectories with x1, y1, ...",
        REMEDY,
    )
}

fn wide<'a>(
    document: &'a Document,
    table: &'a Table,
    (header, row): (usize, &Row),
    (kind, facts): (Kind, Facts),
    options: &Options,
) -> Result<TrackFile<'a>, ImportError> {
    let first = usize::from(kind != Kind::Untimed);
    let animals = (row.filled() - first) / 2;
    let point = |animal: usize| {
        PointCells::new((animal + 1).to_string(), first + 2 * animal, Some(first + 2 * animal + 1))
    };
    let layout = Layout {
        start: header + 1,
        width: row.filled(),
        most: row.filled(),
        time: (first == 1).then_some(0),
        points: (0..animals).map(point).collect(),
        ..Layout::default()
    };
    let mut export = layout.read(document, table, facts)?;
    count_rows(&mut export, options);
    Ok(export)
}

/// The program writes a row a frame and rounds the times. Where they are too coarse to number the frames, and
/// fit a steady count of the rows as near as their rounding, the rows are the frames; where they are fine
/// enough, they show a row that is lost or doubled.
fn count_rows(export: &mut TrackFile, options: &Options) {
    let Some(clock) = export.clocks.first_mut().filter(|clock| clock.frame.is_none()) else { return };
    let times: Vec<f64> = clock.time.iter().flat_map(Column::iter).flatten().collect();
    let last = times.len().saturating_sub(1);
    if last < 2 || times.len() != clock.len() || !times.is_sorted() {
        return;
    }
    let mean_s = (times[last] - times[0]) / last as f64;
    if QUANTUM_S <= 2.0 * OFF_GRID_LIMIT_FRAMES * mean_s {
        return;
    }
    let fits = |step_s: f64| {
        let off_s = times.iter().enumerate().map(|(row, time)| time - times[0] - row as f64 * step_s);
        let (least, most) = off_s
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), off| (least.min(off), most.max(off)));
        most - least < QUANTUM_S * (1.0 - 1e-6)
    };
    // a mean near the declared rate may hide a row too many; the check of the rate finds one far from it
    let near = |rate_hz: f64| {
        (mean_s * rate_hz - 1.0).abs() <= RATE_AGREEMENT + QUANTUM_S / (times[last] - times[0])
    };
    if options
        .frame_rate_hz
        .map_or(fits(mean_s), |rate_hz| fits(1.0 / rate_hz) || (!near(rate_hz) && fits(mean_s)))
    {
        clock.frame = Some((0..times.len()).map(|row| Some(row as f64)).collect());
        export
            .notes
            .push("idtracker.ai writes a row a frame: the rows are counted, as the times allow".to_owned());
    }
}

fn tidy<'a>(
    document: &'a Document,
    table: &'a Table,
    (header, row): (usize, &Row),
    facts: Facts,
) -> Result<TrackFile<'a>, ImportError> {
    let at = |name: &str| row.cells.iter().position(|cell| cell == name);
    let (Some(frame), Some(x)) = (at(TIDY[0]), at(TIDY[3])) else {
        return Err(named_columns::no_column(table, Some(row.line), "frame and x", REMEDY));
    };
    let layout = Layout {
        start: header + 1,
        width: row.filled(),
        most: row.filled(),
        frame: Some(frame),
        time: at(TIDY[1]),
        key: at(TIDY[2]).into_iter().collect(),
        order: Order::Any,
        points: vec![PointCells { confidence: at(PROBABILITY), ..PointCells::new("", x, at(TIDY[4])) }],
        ..Layout::default()
    };
    let mut export = layout.read(document, table, facts)?;
    export
        .notes
        .push("the confidence is the probability of the animal's identity, not of its position".to_owned());
    // a video of unknown rate is written with its frames as times
    if export.clocks.iter().all(|clock| clock.time == clock.frame) {
        export.clocks.iter_mut().for_each(|clock| clock.time = None);
        export.notes.push(
            "the times repeat the frames, as idtracker.ai writes them where it does not know \
            the rate; they are left out"
                .to_owned(),
        );
    }
    Ok(export)
}
