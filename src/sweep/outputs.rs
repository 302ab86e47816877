//! Output of a study: the table of all points and its summary.

use super::grid::{AxisSpacing, SamplePlan, SweepAxis};
use super::point::PointOutcome;
use super::rank_correlation::{RankCorrelation, RankCorrelations};
use super::study::{SHEET_NAME, Study, SweepMap};
use crate::feature::MissingReason;
use crate::simulate::twin::Camera;
use serde::Serialize;
use std::collections::BTreeMap;

/// Source of the numbers, which is stated in every row of the table and in the summary.
const SOURCE: &str = "simulation";

/// Header of `sweep.csv`.
pub(crate) fn csv_header(study: &Study) -> String {
    let mut cells: Vec<String> = study.axes.iter().map(|axis| axis.parameter.name.to_owned()).collect();
    cells.extend(["status", "stopped_at_s"].map(str::to_owned));
    cells.extend(study.maps.iter().map(SweepMap::column));
    cells.extend(["missing", "source"].map(str::to_owned));
    cells.join(",") + "\n"
}

/// Row of a point in `sweep.csv`. A missing value is an empty cell; the columns `status` and `missing` give
/// the reason.
pub(crate) fn csv_row(study: &Study, index: usize, outcome: &PointOutcome) -> String {
    let number = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
    let mut cells: Vec<String> = study.point_values(index).iter().map(|value| value.to_string()).collect();
    cells.extend([outcome.status().to_owned(), number(outcome.stopped_at_s)]);
    cells.extend(outcome.values.iter().map(|value| number(value.ok())));
    cells.extend([describe_missing(study, outcome), SOURCE.to_owned()]);
    cells.join(",") + "\n"
}

/// Text on the maps whose value is missing, but not because the run ended early:
/// `column: reason; column: reason`.
fn describe_missing(study: &Study, outcome: &PointOutcome) -> String {
    let ended = outcome.ended.as_ref().map(|ended| ended.reason);
    let of = |(map, value): (&SweepMap, &Result<f64, MissingReason>)| {
        let reason = value.err()?;
        (Some(reason) != ended).then(|| format!("{}: {}", map.column(), reason.name()))
    };
    study.maps.iter().zip(&outcome.values).filter_map(of).collect::<Vec<_>>().join("; ")
}

#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)] // the fields have the names of the keys in the file, which include their units
pub(crate) struct SweepSummary {
    pub title: String,
    pub scene: String,
    pub scene_title: String,
    /// Always true: the numbers are simulated, not measured.
    pub synthetic: bool,
    pub source: &'static str,
    pub fingerprint: String,
    pub version: &'static str,
    pub camera: Camera,
    pub points: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sample: Option<SamplePlan>,
    pub status: BTreeMap<&'static str, usize>,
    pub axes: Vec<AxisSummary>,
    /// Name of the figure with all maps, or with the rank correlations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sheet: Option<String>,
    pub maps: Vec<MapSummary>,
}

#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub(crate) struct AxisSummary {
    pub name: &'static str,
    pub unit: &'static str,
    pub scale: AxisSpacing,
    /// Number of values on the axis of a grid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub points: Option<usize>,
    pub from: Option<f64>,
    pub to: Option<f64>,
}

#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub(crate) struct MapSummary {
    pub name: String,
    pub kind: &'static str,
    pub unit: &'static str,
    pub column: String,
    /// Name of the figure of the map, if the study is drawn as maps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub figure: Option<String>,
    pub values: usize,
    pub least: Option<f64>,
    pub greatest: Option<f64>,
    pub missing: BTreeMap<&'static str, usize>,
    /// Rank correlation with each parameter, if the study is not drawn as maps.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rank_correlations: Vec<RankCorrelation>,
}

impl SweepSummary {
    /// The summary before any point is counted.
    pub(crate) fn new(study: &Study, scene_title: &str, fingerprint: &str) -> Self {
        let axis = |axis: &SweepAxis| AxisSummary {
            name: axis.parameter.name,
            unit: axis.parameter.unit,
            scale: axis.spacing,
            points: study.sample.is_none().then_some(axis.values.len()),
            from: axis.values.first().copied(),
            to: axis.values.last().copied(),
        };
        let map = |map: &SweepMap| MapSummary {
            name: map.name.clone(),
            kind: map.reading.kind(),
            unit: map.reading.unit().name,
            column: map.column(),
            figure: study.is_mapped().then(|| format!("{}.svg", map.slug)),
            values: 0,
            least: None,
            greatest: None,
            missing: BTreeMap::new(),
            rank_correlations: Vec::new(),
        };
        Self {
            title: study.title.clone(),
            scene: study.scene.clone(),
            scene_title: scene_title.to_owned(),
            synthetic: true,
            source: SOURCE,
            fingerprint: fingerprint.to_owned(),
            version: env!("CARGO_PKG_VERSION"),
            camera: study.camera,
            points: 0,
            sample: study.sample,
            status: BTreeMap::new(),
            axes: study.axes.iter().map(axis).collect(),
            sheet: study.has_sheet().then(|| format!("{SHEET_NAME}.svg")),
            maps: study.maps.iter().map(map).collect(),
        }
    }

    pub(crate) fn count_point(&mut self, outcome: &PointOutcome) {
        self.points += 1;
        *self.status.entry(outcome.status()).or_default() += 1;
        for (map, value) in self.maps.iter_mut().zip(&outcome.values) {
            match *value {
                Ok(value) => {
                    map.values += 1;
                    map.least = Some(map.least.map_or(value, |least| least.min(value)));
                    map.greatest = Some(map.greatest.map_or(value, |greatest| greatest.max(value)));
                }
                Err(reason) => *map.missing.entry(reason.name()).or_default() += 1,
            }
        }
    }

    /// Adds the rank correlations of every map.
    pub(crate) fn add_correlations(&mut self, study: &Study, found: &RankCorrelations) {
        for (at, map) in self.maps.iter_mut().enumerate() {
            map.rank_correlations = found.of_map(study, at);
        }
    }

    /// Whether any map has a value at any point.
    pub(crate) fn has_values(&self) -> bool {
        self.maps.iter().any(|map| map.values > 0)
    }

    /// Text of the summary file.
    ///
    /// # Errors
    /// None in practice: every field has a JSON form.
    pub(crate) fn to_json(&self) -> Result<String, serde_json::Error> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}
