//! sweep.toml: which parameters are varied and what is mapped, checked completely before anything runs.

mod as_written;

use super::grid;
use super::grid::{AxisSpacing, AxisValues, SamplePlan, SweepAxis};
use crate::checkpoint::fingerprint;
use crate::feature::{Reading, ReadingEntry, ReadingKind};
use crate::model::parameters::{ModelParameter, find_parameter, parameter_names};
use crate::recording::channel::WindowEnd;
use crate::simulate::scene::{Scene, SceneError};
use crate::simulate::twin::Camera;
use crate::toml_file::{
    KeyRefusal, NumberPair, TomlError, check_format, parse_toml, refuse_key, suggest_key,
};
use serde::Serialize;

/// Most frames of a run: a mistyped rate is refused instead of filling memory, once for every thread.
pub(crate) const MOST_FRAMES: f64 = 1e6;

/// Most points of a map: 200 by 200 cells are as many as a figure in one column can show.
const MOST_MAPPED: usize = 40_000;

/// A checked study.
#[derive(Debug, Clone)]
pub struct Study {
    /// Title for figures.
    pub title: String,
    /// Path of the scene, relative to the file.
    pub scene: String,
    /// The camera through which the traces are read; no noise.
    pub camera: Camera,
    /// The parameters that are varied; the first one of a grid is the slowest.
    pub axes: Vec<SweepAxis>,
    /// How points are drawn, where they are not on a grid.
    pub sample: Option<SamplePlan>,
    /// What is mapped.
    pub maps: Vec<SweepMap>,
}

/// Why a study was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StudyError {
    /// It is not TOML of the right shape.
    #[error(transparent)]
    Toml(#[from] TomlError),
    /// A value that cannot be used.
    #[error("{file}: {key}: {problem}")]
    Value {
        /// File as named by the user.
        file: String,
        /// The key, with the entry that it belongs to.
        key: String,
        /// What was found, what was expected, and what to do.
        problem: String,
    },
    /// The scene refuses a point of the grid.
    #[error("{file}: the point with {point}: {problem}")]
    Point {
        /// File as named by the user.
        file: String,
        /// Names and values.
        point: String,
        /// The scene's refusal.
        problem: Box<SceneError>,
    },
}

impl Study {
    /// Reads and checks a study; `file` is its name in refusals.
    ///
    /// # Errors
    /// [`StudyError`] at the first problem.
    pub fn parse(file: &str, text: &str) -> Result<Self, StudyError> {
        let written: as_written::StudyFile = parse_toml(file, text)?;
        check_format(file, written.format)?;
        Self::from_file(&written).map_err(|(key, problem)| StudyError::Value {
            file: file.to_owned(),
            key,
            problem,
        })
    }

    /// The same without axes, for points that come from elsewhere: it has one point, its scene.
    ///
    /// # Errors
    /// [`StudyError`] at the first problem.
    pub fn parse_maps(file: &str, text: &str) -> Result<Self, StudyError> {
        let written: as_written::StudyFile = parse_toml(file, text)?;
        check_format(file, written.format)?;
        let value = |(key, problem): KeyRefusal| StudyError::Value { file: file.to_owned(), key, problem };
        Self::from_axes(&written, Vec::new()).map_err(value)
    }

    /// Number of points.
    #[must_use]
    pub fn point_count(&self) -> usize {
        match self.sample {
            Some(sample) => sample.points,
            None => self.axes.iter().map(|axis| axis.values.len()).product(),
        }
    }

    /// Whether every map is drawn over the axes, point by point.
    pub(crate) fn is_mapped(&self) -> bool {
        self.sample.is_none() && self.axes.len() <= 2 && self.point_count() <= MOST_MAPPED
    }

    /// Whether there is a sheet with every map: one alone that is drawn has its own figure.
    pub(crate) fn has_sheet(&self) -> bool {
        self.maps.len() > 1 || !self.is_mapped()
    }

    /// Value of every axis at point `index`.
    #[must_use]
    pub fn point_values(&self, index: usize) -> Vec<f64> {
        let axes = self.axes.iter().map(|axis| AxisValues { of: &axis.values, spacing: axis.spacing });
        grid::point_values(&axes.collect::<Vec<_>>(), self.sample.as_ref(), index)
    }

    /// The scene of point `index`.
    ///
    /// # Errors
    /// The scene's refusal of a value.
    pub fn scene_of_point(&self, scene: &Scene, index: usize) -> Result<Scene, SceneError> {
        self.axes
            .iter()
            .zip(self.point_values(index))
            .try_fold(scene.clone(), |scene, (axis, value)| scene.with_parameter(axis.parameter.name, value))
    }

    /// Checks a study against its scene: its points are scenes (each of a small study, and as many of a large
    /// one, spread over all), windows in seconds lie in the run, and the camera fits it.
    ///
    /// # Errors
    /// [`StudyError`] at the first problem.
    pub fn check_scene(&self, file: &str, scene: &Scene) -> Result<(), StudyError> {
        let value = |(key, problem): KeyRefusal| StudyError::Value { file: file.to_owned(), key, problem };
        self.check_frames(scene).map_err(value)?;
        self.maps.iter().try_for_each(|map| map.check_window(scene)).map_err(value)?;
        let point = |index: usize| {
            let named = self
                .point_values(index)
                .into_iter()
                .zip(&self.axes)
                .map(|(value, axis)| format!("{} = {value}", axis.parameter.name));
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

    /// SHA-256 over everything that decides the outcome, from [`fingerprint`]: values of the study and its
    /// scene, and the version of the program.
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

    /// The JSON Schema of a study: for editors, and for messages.
    #[must_use]
    pub fn schema() -> serde_json::Value {
        crate::toml_file::schema_of::<as_written::StudyFile>()
    }

    fn from_file(written: &as_written::StudyFile) -> Result<Self, KeyRefusal> {
        if written.scene.trim().is_empty() {
            return refuse_key(
                "scene",
                format!("found \"{}\", expected the path of a scene, relative to this file", written.scene),
            );
        }
        let axes = check_axes(&written.axis, written.sample.as_ref())?;
        Self::from_axes(written, axes)
    }

    fn from_axes(written: &as_written::StudyFile, axes: Vec<SweepAxis>) -> Result<Self, KeyRefusal> {
        let camera = check_study_camera(&written.camera)?;
        let maps = check_maps(&written.map, camera.frame_rate_hz / 2.0)?;
        Ok(Self {
            title: written.title.clone(),
            scene: written.scene.clone(),
            camera,
            axes,
            sample: written.sample,
            maps,
        })
    }

    fn check_frames(&self, scene: &Scene) -> Result<(), KeyRefusal> {
        let frames = (scene.run.stop_s - scene.start_s) * self.camera.frame_rate_hz;
        if (1.0..=MOST_FRAMES).contains(&frames) {
            return Ok(());
        }
        let run = format!("{} s to {} s", scene.start_s, scene.run.stop_s);
        refuse_key(
            "camera.frame_rate_hz",
            format!(
                "found {frames:.3e} frames in the run from {run}, expected 1 to {MOST_FRAMES:e}; correct \
                 the rate or the run"
            ),
        )
    }
}

fn check_study_camera(written: &Camera) -> Result<Camera, KeyRefusal> {
    let Camera { frame_rate_hz, exposure_s } = *written;
    if !(frame_rate_hz.is_finite() && frame_rate_hz > 0.0) {
        return refuse_key(
            "camera.frame_rate_hz",
            format!("found {frame_rate_hz}, expected a finite number above 0"),
        );
    }
    if !(exposure_s >= 0.0 && exposure_s * frame_rate_hz <= 1.0) {
        return refuse_key(
            "camera.exposure_s",
            format!("found {exposure_s}, expected 0 to {} (one frame)", 1.0 / frame_rate_hz),
        );
    }
    Ok(Camera { frame_rate_hz, exposure_s })
}

/// What decides the outcome of a study.
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

// The axes of a study: each is a parameter of a scene with rising values.

/// Most points of a study: a mistyped number is refused; so many take a cluster a day.
const MOST_POINTS: usize = 100_000_000;
/// Most values of an axis.
const MOST_VALUES: usize = 100_000;

pub(super) fn check_axes(
    written: &[as_written::StudyAxisFile],
    sample: Option<&SamplePlan>,
) -> Result<Vec<SweepAxis>, KeyRefusal> {
    if written.is_empty() {
        return refuse_key("axis", "found none, expected at least one [[axis]]: a parameter that is varied");
    }
    if let Some(SamplePlan { points, .. }) = sample
        && !(2..=MOST_POINTS).contains(points)
    {
        return refuse_key("sample.points", format!("found {points}, expected 2 to {MOST_POINTS}"));
    }
    let counts = written.iter().map(|axis| axis.values.as_ref().map_or(axis.points.unwrap_or(0), Vec::len));
    let points = counts.fold(1, usize::saturating_mul);
    if sample.is_none() && points > MOST_POINTS {
        return refuse_key(
            "axis",
            format!(
                "found {points} points in all, expected at most {MOST_POINTS}; lower `points` of an axis, \
                 or take a [sample]"
            ),
        );
    }
    let axes = written.iter().map(|written| check_axis(written, sample.is_some()));
    let axes = axes.collect::<Result<Vec<_>, _>>()?;
    let pairs = axes.iter().enumerate().flat_map(|(at, axis)| axes.iter().take(at).map(move |b| (b, axis)));
    let same = |(a, b): &(&SweepAxis, &SweepAxis)| a.parameter.quantity == b.parameter.quantity;
    if let Some((first, second)) = pairs.into_iter().find(same) {
        let (first, second) = (first.parameter.name, second.parameter.name);
        return refuse_key(
            format!("axis `{second}`"),
            format!(
                "sets the same quantity as the axis `{first}`; vary another parameter or remove one axis"
            ),
        );
    }
    Ok(axes)
}

fn check_axis(written: &as_written::StudyAxisFile, sampled: bool) -> Result<SweepAxis, KeyRefusal> {
    let key = |key: &str| format!("axis `{}`, `{key}`", written.name);
    let Some(parameter) = find_parameter(&written.name) else {
        return refuse_key(
            key("name"),
            format!("not a parameter of a scene; {}", suggest_key(&written.name, &parameter_names())),
        );
    };
    let spacing = written.scale.unwrap_or_default();
    let points = if sampled { check_sampled_ends(&key, written)? } else { written.points };
    let values = match (&written.values, written.from, written.to, points) {
        (Some(values), None, None, None) => values.clone(),
        (Some(_), ..) => {
            return refuse_key(
                key("values"),
                "found together with `from`, `to` or `points`, expected one of the two ways; \
                 remove the other",
            );
        }
        (None, Some(from), Some(to), Some(points)) => {
            spread_between(&key, parameter, spacing, (from, to), points)?
        }
        _ => {
            return refuse_key(
                key("from"),
                "expected `from`, `to` and `points`, or `values` alone; add what is missing",
            );
        }
    };
    check_rising(&key("values"), &values)?;
    check_log_values(&key("scale"), spacing, &values)?;
    if let Some(value) = values.iter().find(|value| !parameter.range.admits(**value)) {
        let expected = parameter.range.describe();
        return refuse_key(
            format!("axis `{}`", parameter.name),
            format!("found {value}, expected {expected} ({}, {})", parameter.meaning, parameter.unit),
        );
    }
    Ok(SweepAxis { parameter, values, spacing })
}

/// An axis of a sample has a range; its ends are what is kept of it.
fn check_sampled_ends(
    key: &impl Fn(&str) -> String,
    written: &as_written::StudyAxisFile,
) -> Result<Option<usize>, KeyRefusal> {
    let extra = match (&written.values, written.points) {
        (Some(_), _) => "values",
        (_, Some(_)) => "points",
        _ if written.from.is_none() || written.to.is_none() => {
            return refuse_key(
                key("from"),
                "expected `from` and `to`, the range that is sampled; add what is missing",
            );
        }
        _ => return Ok(Some(2)),
    };
    refuse_key(
        key(extra),
        format!(
            "found next to a [sample], which has points of its own between `from` and `to`; remove `{extra}`, or \
             the table [sample] for a grid"
        ),
    )
}

fn spread_between(
    key: &impl Fn(&str) -> String,
    parameter: &ModelParameter,
    spacing: AxisSpacing,
    (from, to): (f64, f64),
    points: usize,
) -> Result<Vec<f64>, KeyRefusal> {
    if !(from.is_finite() && to.is_finite() && from < to) {
        return refuse_key(
            key("to"),
            format!(
                "found {from} to {to}, expected `from` below `to`, in {}; exchange or correct them",
                parameter.unit
            ),
        );
    }
    if !(2..=MOST_VALUES).contains(&points) {
        let expected = format!("expected 2 to {MOST_VALUES}: both ends are points");
        return refuse_key(key("points"), format!("found {points}, {expected}"));
    }
    check_log_values(&key("scale"), spacing, &[from, to])?;
    Ok(spacing.spread_values(from, to, points))
}

fn check_rising(key: &str, values: &[f64]) -> Result<(), KeyRefusal> {
    if values.len() < 2 {
        return refuse_key(
            key,
            format!(
                "found {}, expected two values or more; a single one belongs into the scene",
                values.len()
            ),
        );
    }
    match values.windows(2).find(|pair| pair[0].is_nan() || pair[0] >= pair[1]) {
        Some(pair) => refuse_key(
            key,
            format!(
                "found {} before {}, expected rising values; sort them, or take fewer points",
                pair[0], pair[1]
            ),
        ),
        None => Ok(()),
    }
}

fn check_log_values(key: &str, spacing: AxisSpacing, values: &[f64]) -> Result<(), KeyRefusal> {
    match values.iter().find(|value| spacing == AxisSpacing::Log && **value <= 0.0) {
        Some(value) => refuse_key(
            key,
            format!(
                "found \"log\" with the value {value}, expected values above 0; \
                 take \"linear\" or correct the value"
            ),
        ),
        None => Ok(()),
    }
}

// The maps of a study: their names, and what each reads.

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

#[cfg(test)]
mod tests;
