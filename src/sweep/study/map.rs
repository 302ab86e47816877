//! The maps of a study: their names, and what each reads.

use super::as_written;
use crate::feature::{Reading, ReadingEntry, ReadingKind};
use crate::recording::channel::WindowEnd;
use crate::simulate::scene::Scene;
use crate::toml_file::{KeyRefusal, NumberPair, refuse_key};

/// Most maps: each is a figure in three sizes.
const MOST_MAPS: usize = 100;
/// File of the figure with every map.
pub const SHEET_NAME: &str = "all-maps";
/// Names of columns that every table has.
const RESERVED_COLUMNS: [&str; 4] = ["status", "stopped_at_s", "missing", "source"];

/// A reading over the grid.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepMap {
    /// Name as written.
    pub name: String,
    /// The name in letters and digits, with `-` between words: its figure is `SLUG.svg`.
    pub slug: String,
    /// What is read.
    pub reading: Reading,
    /// Values of the first and the last colour, in its unit; `None` for those of the data.
    pub range: Option<(f64, f64)>,
}

impl SweepMap {
    /// Its column in `sweep.csv`: the name with its unit.
    #[must_use]
    pub fn column(&self) -> String {
        self.slug.replace('-', "_") + self.reading.unit().suffix
    }

    /// A window given in seconds lies in the run of the scene, or no point would have a value.
    pub(super) fn check_window(&self, scene: &Scene) -> Result<(), KeyRefusal> {
        let Some(window) = self.reading.window() else { return Ok(()) };
        let run = scene.start_s..=scene.run.stop_s;
        let outside = |end: &WindowEnd| matches!(end, WindowEnd::Time(time_s) if !run.contains(time_s));
        if ![window.from, window.to].iter().any(outside) {
            return Ok(());
        }
        let expected = format!(
            "expected one within the scene's run, {} s to {} s; correct it, or change start.time_s \
         and run.stop_s",
            run.start(),
            run.end()
        );
        refuse_key(map_key(&self.name, "window"), format!("found `{window}`, {expected}"))
    }
}

fn map_key(name: &str, key: &str) -> String {
    format!("map `{name}`, `{key}`")
}

pub(super) fn check_maps(written: &[as_written::Map], nyquist_hz: f64) -> Result<Vec<SweepMap>, KeyRefusal> {
    if written.is_empty() {
        return refuse_key("map", "found none, expected at least one [[map]]: what is read from every run");
    }
    if written.len() > MOST_MAPS {
        return refuse_key(
            "map",
            format!("found {}, expected at most {MOST_MAPS}; leave some out", written.len()),
        );
    }
    let mut maps: Vec<SweepMap> = Vec::new();
    for written in written {
        for map in maps_of_entry(written, nyquist_hz)? {
            check_names(&map, &maps)?;
            maps.push(map);
        }
    }
    Ok(maps)
}

/// A map must not share its column or its file with another.
fn check_names(map: &SweepMap, earlier: &[SweepMap]) -> Result<(), KeyRefusal> {
    let problem = if RESERVED_COLUMNS.contains(&map.column().as_str()) {
        format!("`{}` is a column of every table; give the map another name", map.column())
    } else if map.slug == SHEET_NAME {
        format!("`{SHEET_NAME}.svg` is the sheet with every map; give the map another name")
    } else if let Some(other) = earlier.iter().find(|other| other.slug == map.slug) {
        format!("its file `{}.svg` is that of the map `{}`; give each its own name", map.slug, other.name)
    } else {
        return Ok(());
    };
    refuse_key(map_key(&map.name, "name"), problem)
}

/// The maps of an entry: several where its kind stands for several readings.
fn maps_of_entry(written: &as_written::Map, nyquist_hz: f64) -> Result<Vec<SweepMap>, KeyRefusal> {
    if slugify(&written.name).is_empty() {
        return refuse_key(
            map_key(&written.name, "name"),
            "expected a name with letters a to z or digits in it, such as \"high component\": \
             it names a file",
        );
    }
    let range = check_map_range(written)?;
    let kind = ReadingKind::find(&written.kind)
        .or_else(|problem| refuse_key(map_key(&written.name, "kind"), problem))?;
    let entry = ReadingEntry {
        name: &format!("map `{}`", written.name),
        noun: "map",
        keys: &written.keys(),
        nyquist_hz: Some(nyquist_hz),
        noisy: false,
    };
    let readings = kind.make_readings(&written.name, &entry)?;
    let map = |(name, reading): (String, Reading)| SweepMap { slug: slugify(&name), name, reading, range };
    Ok(readings.into_iter().map(map).collect())
}

fn check_map_range(written: &as_written::Map) -> Result<Option<(f64, f64)>, KeyRefusal> {
    match written.range {
        Some(NumberPair([low, high])) if !(low.is_finite() && high.is_finite() && low < high) => refuse_key(
            map_key(&written.name, "range"),
            format!("found [{low}, {high}], expected [lowest, highest] in the map's unit; correct them"),
        ),
        range => Ok(range.map(|NumberPair([low, high])| (low, high))),
    }
}

/// Letters and digits of a name in lower case, with `-` between them.
fn slugify(name: &str) -> String {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("-").to_ascii_lowercase()
}
