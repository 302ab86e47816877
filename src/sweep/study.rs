//! A study file, which is checked completely before any run: axes, camera and maps.

mod as_written;

use super::grid::{self, AxisSpacing, AxisValues, SamplePlan, SweepAxis};
use crate::checkpoint::fingerprint;
use crate::feature::{Reading, ReadingEntry, ReadingKind};
use crate::model::parameters::{ModelParameter, find_parameter, parameter_names};
use crate::recording::channel::WindowEnd;
use crate::simulate::scene::Scene;
use crate::simulate::scene::error::SceneError;
use crate::simulate::twin::Camera;
use crate::toml_file::{self, KeyRefusal, NumberPair, TomlError, refuse_key, suggest_key};
use as_written::{Map, StudyAxisFile, StudyFile};
use serde::Serialize;

/// Maximum number of frames of a run: a mistyped rate is refused before it fills the memory of every thread.
pub(crate) const MOST_FRAMES: f64 = 1e6;

/// Maximum number of points of a map: a figure that is one column wide can show 200 by 200 cells.
const MOST_MAPPED: usize = 40_000;

/// A checked study.
#[derive(Debug, Clone)]
pub struct Study {
    /// Title of the figures.
    pub title: String,
    /// Path of the scene, relative to the study file.
    pub scene: String,
    /// Camera that records every run, without noise.
    pub camera: Camera,
    /// Parameters that vary; the first axis of a grid changes slowest.
    pub axes: Vec<SweepAxis>,
    /// Plan of the sample; `None` for a grid.
    pub sample: Option<SamplePlan>,
    /// Readings that are drawn as maps over the axes.
    pub maps: Vec<SweepMap>,
}

/// Reason for refusing a study.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StudyError {
    /// The file is not TOML with the keys of a study.
    #[error(transparent)]
    Toml(#[from] TomlError),
    /// A value that cannot be used.
    #[error("{file}: {key}: {problem}")]
    Value {
        /// File as named by the user.
        file: String,
        /// Key, with the entry that contains it.
        key: String,
        /// What was found, what was expected, and what to do.
        problem: String,
    },
    /// The scene refuses a point of the study.
    #[error("{file}: the point with {point}: {problem}")]
    Point {
        /// File as named by the user.
        file: String,
        /// Names and values of the parameters at the point.
        point: String,
        /// Error of the scene.
        problem: Box<SceneError>,
    },
}

impl Study {
    /// Reads and checks a study; `file` is its name in errors.
    ///
    /// # Errors
    /// [`StudyError`] at the first problem.
    pub fn parse(file: &str, text: &str) -> Result<Self, StudyError> {
        let written = read_study_file(file, text)?;
        let check = || {
            require(!written.scene.trim().is_empty(), "scene", || {
                format!("found \"{}\", expected the path of a scene, relative to this file", written.scene)
            })?;
            Self::from_axes(&written, check_axes(&written.axis, written.sample.as_ref())?)
        };
        check().map_err(value_error(file))
    }

    /// Reads the maps of a study without its axes, so that the only point of the study is the scene itself.
    ///
    /// # Errors
    /// [`StudyError`] at the first problem.
    pub fn parse_maps(file: &str, text: &str) -> Result<Self, StudyError> {
        Self::from_axes(&read_study_file(file, text)?, Vec::new()).map_err(value_error(file))
    }

    /// Number of points.
    #[must_use]
    pub fn point_count(&self) -> usize {
        let grid = || self.axes.iter().map(|axis| axis.values.len()).product();
        self.sample.map_or_else(grid, |sample| sample.points)
    }

    /// Whether the figures show every point as a cell over one or two axes.
    pub(crate) fn is_mapped(&self) -> bool {
        self.sample.is_none() && self.axes.len() <= 2 && self.point_count() <= MOST_MAPPED
    }

    /// Whether a figure with all maps (or with the rank correlations) is drawn; it is not if the only map has
    /// a figure of its own.
    pub(crate) fn has_sheet(&self) -> bool {
        self.maps.len() > 1 || !self.is_mapped()
    }

    /// Value of every axis at point `index`, in SI units.
    #[must_use]
    pub fn point_values(&self, index: usize) -> Vec<f64> {
        let axes = self.axes.iter().map(|axis| AxisValues { of: &axis.values, spacing: axis.spacing });
        grid::point_values(&axes.collect::<Vec<_>>(), self.sample.as_ref(), index)
    }

    /// The scene of point `index`.
    ///
    /// # Errors
    /// [`SceneError`] if the scene refuses a value.
    pub fn scene_of_point(&self, scene: &Scene, index: usize) -> Result<Scene, SceneError> {
        let mut axes = self.axes.iter().zip(self.point_values(index));
        axes.try_fold(scene.clone(), |scene, (axis, value)| scene.with_parameter(axis.parameter.name, value))
    }

    /// Checks a study against its scene: the scene must accept the points (all points of a small study, an
    /// even selection of those of a large one), windows in seconds must lie within the run, and the run must
    /// have a permitted number of frames.
    ///
    /// # Errors
    /// [`StudyError`] at the first problem.
    pub fn check_scene(&self, file: &str, scene: &Scene) -> Result<(), StudyError> {
        self.check_frames(scene).map_err(value_error(file))?;
        self.maps.iter().try_for_each(|map| map.check_window(scene)).map_err(value_error(file))?;
        let point = |index: usize| {
            let values = self.point_values(index).into_iter().zip(&self.axes);
            let named = values.map(|(value, axis)| format!("{} = {value}", axis.parameter.name));
            named.collect::<Vec<_>>().join(" and ")
        };
        let step = self.point_count().div_ceil(MOST_MAPPED).max(1);
        (0..self.point_count()).step_by(step).try_for_each(|index| {
            let refused = |problem| StudyError::Point {
                file: file.to_owned(),
                point: point(index),
                problem: Box::new(problem),
            };
            self.scene_of_point(scene, index).map(|_| ()).map_err(refused)
        })
    }

    /// SHA-256 of everything that determines the outcome: study, scene and version of the program
    /// ([`fingerprint`]).
    pub(crate) fn fingerprint(&self, scene: &Scene) -> String {
        fingerprint(&StudyFingerprint {
            version: env!("CARGO_PKG_VERSION"),
            scene,
            camera: self.camera,
            axes: self.axes.iter().map(|axis| (axis.parameter.name, axis.values.as_slice())).collect(),
            sample: self.sample.map(|sample| (sample, self.axes.iter().map(|axis| axis.spacing).collect())),
            readings: self.maps.iter().map(|map| &map.reading).collect(),
        })
    }

    /// JSON Schema of a study file, for editors and messages.
    #[must_use]
    pub fn schema() -> serde_json::Value {
        toml_file::schema_of::<StudyFile>()
    }

    fn from_axes(written: &StudyFile, axes: Vec<SweepAxis>) -> Result<Self, KeyRefusal> {
        let Camera { frame_rate_hz, exposure_s } = written.camera;
        toml_file::check_above_zero("camera.frame_rate_hz", frame_rate_hz)?;
        require(exposure_s >= 0.0 && exposure_s * frame_rate_hz <= 1.0, "camera.exposure_s", || {
            format!("found {exposure_s}, expected 0 to {} (one frame)", 1.0 / frame_rate_hz)
        })?;
        Ok(Self {
            title: written.title.clone(),
            scene: written.scene.clone(),
            camera: written.camera,
            axes,
            sample: written.sample,
            maps: check_maps(&written.map, frame_rate_hz / 2.0)?,
        })
    }

    fn check_frames(&self, scene: &Scene) -> Result<(), KeyRefusal> {
        let (start_s, stop_s) = (scene.start_s, scene.run.stop_s);
        let frames = (stop_s - start_s) * self.camera.frame_rate_hz;
        require((1.0..=MOST_FRAMES).contains(&frames), "camera.frame_rate_hz", || {
            format!(
                "found {frames:.3e} frames in the run from {start_s} s to {stop_s} s, expected 1 to \
                 {MOST_FRAMES:e}; correct the rate or the run"
            )
        })
    }
}

fn read_study_file(file: &str, text: &str) -> Result<StudyFile, StudyError> {
    let written: StudyFile = toml_file::parse_toml(file, text)?;
    toml_file::check_format(file, written.format)?;
    Ok(written)
}

fn value_error(file: &str) -> impl Fn(KeyRefusal) -> StudyError {
    move |(key, problem)| StudyError::Value { file: file.to_owned(), key, problem }
}

/// Returns a refusal of `key` if `holds` is false.
fn require(holds: bool, key: &str, problem: impl FnOnce() -> String) -> Result<(), KeyRefusal> {
    if holds { Ok(()) } else { refuse_key(key, problem()) }
}

/// Everything that determines the outcome of a study.
#[derive(Serialize)]
struct StudyFingerprint<'a> {
    version: &'static str,
    scene: &'a Scene,
    camera: Camera,
    axes: Vec<(&'static str, &'a [f64])>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sample: Option<(SamplePlan, Vec<grid::AxisSpacing>)>,
    readings: Vec<&'a Reading>,
}

// Axes: each is a parameter of the scene with rising values.

/// Maximum number of points of a study. A cluster computes them in a day; a larger number is probably
/// mistyped.
const MOST_POINTS: usize = 100_000_000;
/// Maximum number of values of an axis.
const MOST_VALUES: usize = 100_000;

fn check_axes(written: &[StudyAxisFile], sample: Option<&SamplePlan>) -> Result<Vec<SweepAxis>, KeyRefusal> {
    if written.is_empty() {
        return refuse_key("axis", "found none, expected at least one [[axis]]: a parameter that is varied");
    }
    if let Some(SamplePlan { points, .. }) = sample {
        require((2..=MOST_POINTS).contains(points), "sample.points", || {
            format!("found {points}, expected 2 to {MOST_POINTS}")
        })?;
    }
    let counts = written.iter().map(|axis| axis.values.as_ref().map_or(axis.points.unwrap_or(0), Vec::len));
    let points = counts.fold(1, usize::saturating_mul);
    require(sample.is_some() || points <= MOST_POINTS, "axis", || {
        format!(
            "found {points} points in all, expected at most {MOST_POINTS}; lower `points` of an axis, \
             or take a [sample]"
        )
    })?;
    let axes = written.iter().map(|written| check_axis(written, sample.is_some()));
    let axes = axes.collect::<Result<Vec<_>, _>>()?;
    let mut pairs = axes.iter().enumerate().flat_map(|(i, axis)| axes[..i].iter().map(move |b| (b, axis)));
    match pairs.find(|(a, b)| a.parameter.quantity == b.parameter.quantity) {
        Some((first, second)) => refuse_key(
            format!("axis `{}`", second.parameter.name),
            format!(
                "sets the same quantity as the axis `{}`; vary another parameter or remove one axis",
                first.parameter.name
            ),
        ),
        None => Ok(axes),
    }
}

fn check_axis(written: &StudyAxisFile, sampled: bool) -> Result<SweepAxis, KeyRefusal> {
    let key = |key: &str| format!("axis `{}`, `{key}`", written.name);
    let Some(parameter) = find_parameter(&written.name) else {
        let advice = suggest_key(&written.name, &parameter_names());
        return refuse_key(key("name"), format!("not a parameter of a scene; {advice}"));
    };
    let spacing = written.scale.unwrap_or_default();
    let points = if sampled { check_sampled_ends(&key, written)? } else { written.points };
    let values = match (&written.values, written.from, written.to, points) {
        (Some(values), None, None, None) => values.clone(),
        (Some(_), ..) => {
            let problem = "found together with `from`, `to` or `points`, expected one of the two ways; \
                           remove the other";
            return refuse_key(key("values"), problem);
        }
        (None, Some(from), Some(to), Some(points)) => {
            spread_between(&key, parameter, spacing, (from, to), points)?
        }
        _ => {
            let problem = "expected `from`, `to` and `points`, or `values` alone; add what is missing";
            return refuse_key(key("from"), problem);
        }
    };
    check_rising(&key("values"), &values)?;
    check_log_values(&key("scale"), spacing, &values)?;
    let ModelParameter { name, range, meaning, unit, .. } = parameter;
    match values.iter().find(|value| !range.admits(**value)) {
        Some(value) => {
            let problem = format!("found {value}, expected {} ({meaning}, {unit})", range.describe());
            refuse_key(format!("axis `{name}`"), problem)
        }
        None => Ok(SweepAxis { parameter, values, spacing }),
    }
}

/// Number of values of a sampled axis: two, the ends of its range. Refuses the keys `values` and `points`.
fn check_sampled_ends(
    key: &impl Fn(&str) -> String,
    written: &StudyAxisFile,
) -> Result<Option<usize>, KeyRefusal> {
    let extra = match (&written.values, written.points) {
        (Some(_), _) => "values",
        (_, Some(_)) => "points",
        _ if written.from.is_none() || written.to.is_none() => {
            let problem = "expected `from` and `to`, the range that is sampled; add what is missing";
            return refuse_key(key("from"), problem);
        }
        _ => return Ok(Some(2)),
    };
    let problem = format!(
        "found next to a [sample], which has points of its own between `from` and `to`; remove `{extra}`, or \
         the table [sample] for a grid"
    );
    refuse_key(key(extra), problem)
}

fn spread_between(
    key: &impl Fn(&str) -> String,
    parameter: &ModelParameter,
    spacing: AxisSpacing,
    (from, to): (f64, f64),
    points: usize,
) -> Result<Vec<f64>, KeyRefusal> {
    require(from.is_finite() && to.is_finite() && from < to, &key("to"), || {
        let unit = parameter.unit;
        format!("found {from} to {to}, expected `from` below `to`, in {unit}; exchange or correct them")
    })?;
    require((2..=MOST_VALUES).contains(&points), &key("points"), || {
        format!("found {points}, expected 2 to {MOST_VALUES}: both ends are points")
    })?;
    check_log_values(&key("scale"), spacing, &[from, to])?;
    Ok(spacing.spread_values(from, to, points))
}

fn check_rising(key: &str, values: &[f64]) -> Result<(), KeyRefusal> {
    require(values.len() >= 2, key, || {
        format!("found {}, expected two values or more; a single one belongs into the scene", values.len())
    })?;
    values.windows(2).find(|pair| pair[0].is_nan() || pair[0] >= pair[1]).map_or(Ok(()), |pair| {
        let found = format!("found {} before {}", pair[0], pair[1]);
        refuse_key(key, found + ", expected rising values; sort them, or take fewer points")
    })
}

fn check_log_values(key: &str, spacing: AxisSpacing, values: &[f64]) -> Result<(), KeyRefusal> {
    let refused = values.iter().find(|value| spacing == AxisSpacing::Log && **value <= 0.0);
    refused.map_or(Ok(()), |value| {
        let found = format!("found \"log\" with the value {value}");
        refuse_key(key, found + ", expected values above 0; take \"linear\" or correct the value")
    })
}

// Maps: their names and readings.

/// Maximum number of maps; each becomes a figure in three sizes.
const MOST_MAPS: usize = 100;
/// File name, without suffix, of the figure with all maps.
pub const SHEET_NAME: &str = "all-maps";
/// Columns of every `sweep.csv`, whose names no map may have.
const RESERVED_COLUMNS: [&str; 4] = ["status", "stopped_at_s", "missing", "source"];

/// A reading over the points of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepMap {
    /// Name as written in the study file.
    pub name: String,
    /// Name in letters and digits, with `-` between words; the figure is `SLUG.svg`.
    pub slug: String,
    /// Quantity that is read from each run.
    pub reading: Reading,
    /// Values at the two ends of the colour scale, in the unit of the reading; `None` uses the smallest and
    /// largest value.
    pub range: Option<(f64, f64)>,
}

impl SweepMap {
    /// Name of the column in `sweep.csv`: name and unit of the map.
    #[must_use]
    pub fn column(&self) -> String {
        self.slug.replace('-', "_") + self.reading.unit().suffix
    }

    /// Refuses a window given in seconds outside the scene's run, where no point would have a value.
    fn check_window(&self, scene: &Scene) -> Result<(), KeyRefusal> {
        let Some(window) = self.reading.window() else { return Ok(()) };
        let run = scene.start_s..=scene.run.stop_s;
        let outside = |end: &WindowEnd| matches!(end, WindowEnd::Time(time_s) if !run.contains(time_s));
        let inside = ![window.from, window.to].iter().any(outside);
        require(inside, &map_key(&self.name, "window"), || {
            format!(
                "found `{window}`, expected one within the scene's run, {} s to {} s; correct it, or change \
                 start.time_s and run.stop_s",
                run.start(),
                run.end()
            )
        })
    }
}

fn map_key(name: &str, key: &str) -> String {
    format!("map `{name}`, `{key}`")
}

fn check_maps(written: &[Map], nyquist_hz: f64) -> Result<Vec<SweepMap>, KeyRefusal> {
    if written.is_empty() {
        return refuse_key("map", "found none, expected at least one [[map]]: what is read from every run");
    }
    require(written.len() <= MOST_MAPS, "map", || {
        format!("found {}, expected at most {MOST_MAPS}; leave some out", written.len())
    })?;
    let mut maps: Vec<SweepMap> = Vec::new();
    for written in written {
        for map in maps_of_entry(written, nyquist_hz)? {
            check_names(&map, &maps)?;
            maps.push(map);
        }
    }
    Ok(maps)
}

/// Refuses a map that shares its column or its file with another map.
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

/// The maps of an entry; some kinds of reading give several maps.
fn maps_of_entry(written: &Map, nyquist_hz: f64) -> Result<Vec<SweepMap>, KeyRefusal> {
    let name = &written.name;
    require(!slugify(name).is_empty(), &map_key(name, "name"), || {
        "expected a name with letters a to z or digits in it, such as \"high component\": it names a file"
            .into()
    })?;
    let range = written.range.map(|NumberPair([low, high])| (low, high));
    if let Some((low, high)) = range {
        require(low.is_finite() && high.is_finite() && low < high, &map_key(name, "range"), || {
            format!("found [{low}, {high}], expected [lowest, highest] in the map's unit; correct them")
        })?;
    }
    let kind =
        ReadingKind::find(&written.kind).or_else(|problem| refuse_key(map_key(name, "kind"), problem))?;
    let entry = ReadingEntry {
        name: &format!("map `{name}`"),
        noun: "map",
        keys: &written.keys(),
        nyquist_hz: Some(nyquist_hz),
        noisy: false,
    };
    let readings = kind.make_readings(name, &entry)?;
    let map = |(name, reading): (String, Reading)| SweepMap { slug: slugify(&name), name, reading, range };
    Ok(readings.into_iter().map(map).collect())
}

/// Letters and digits of a name in lower case, with `-` between words.
fn slugify(name: &str) -> String {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("-").to_ascii_lowercase()
}

#[cfg(test)]
mod tests;
