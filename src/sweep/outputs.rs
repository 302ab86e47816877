//! What a study writes: the table of all points and its summary.

use super::grid::SamplePlan;
use super::grid::{AxisSpacing, SweepAxis};
use super::point::PointOutcome;
use super::rank_correlation::{RankCorrelation, RankCorrelations};
use super::study::{SHEET_NAME, Study, SweepMap};
use crate::feature::MissingReason;
use crate::simulate::twin::Camera;
use serde::Serialize;
use std::collections::BTreeMap;

/// What every row of the table and the summary say of where the numbers come from.
const SOURCE: &str = "simulation";

/// First row of `sweep.csv`.
pub(crate) fn csv_header(study: &Study) -> String {
    let mut cells: Vec<String> = study.axes.iter().map(|axis| axis.parameter.name.to_owned()).collect();
    cells.extend(["status", "stopped_at_s"].map(str::to_owned));
    cells.extend(study.maps.iter().map(SweepMap::column));
    cells.extend(["missing", "source"].map(str::to_owned));
    cells.join(",") + "\n"
}

/// Row of a point in `sweep.csv`, in which the first axis is the slowest; a cell without a value is empty,
/// and `status` or `describe_missing` says why.
pub(crate) fn csv_row(study: &Study, index: usize, outcome: &PointOutcome) -> String {
    let number = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
    let mut cells: Vec<String> = study.point_values(index).iter().map(|value| value.to_string()).collect();
    cells.extend([outcome.status().to_owned(), number(outcome.stopped_at_s)]);
    cells.extend(outcome.values.iter().map(|value| number(value.ok())));
    cells.extend([describe_missing(study, outcome), SOURCE.to_owned()]);
    cells.join(",") + "\n"
}

/// Which maps have no value for a reason of their own, and which: `column: reason; column: reason`.
fn describe_missing(study: &Study, outcome: &PointOutcome) -> String {
    let ended = outcome.ended.as_ref().map(|ended| ended.reason);
    let of = |(map, value): (&SweepMap, &Result<f64, MissingReason>)| {
        let reason = value.err()?;
        (Some(reason) != ended).then(|| format!("{}: {}", map.column(), reason.name()))
    };
    study.maps.iter().zip(&outcome.values).filter_map(of).collect::<Vec<_>>().join("; ")
}

#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)] // the fields are those of the file, named with their units
pub(crate) struct SweepSummary {
    pub title: String,
    pub scene: String,
    pub scene_title: String,
    /// A simulation is no measurement, and its files say so.
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
    /// The figure with every map, where there are several, or with the rank correlations.
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
    /// Values on the axis of a grid.
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
    /// Of a study that is drawn as maps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub figure: Option<String>,
    pub values: usize,
    pub least: Option<f64>,
    pub greatest: Option<f64>,
    pub missing: BTreeMap<&'static str, usize>,
    /// With every parameter of a study that is not drawn as maps.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rank_correlations: Vec<RankCorrelation>,
}

impl SweepSummary {
    /// That of a study of which no point is counted yet.
    pub(crate) fn new(study: &Study, scene_title: &str, fingerprint: &str) -> Self {
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
            axes: study
                .axes
                .iter()
                .map(|axis| AxisSummary::from_axis(axis, study.sample.is_some()))
                .collect(),
            sheet: study.has_sheet().then(|| format!("{SHEET_NAME}.svg")),
            maps: study.maps.iter().map(|map| MapSummary::from_map(study, map)).collect(),
        }
    }

    pub(crate) fn count_point(&mut self, outcome: &PointOutcome) {
        self.points += 1;
        *self.status.entry(outcome.status()).or_default() += 1;
        for (map, value) in self.maps.iter_mut().zip(&outcome.values) {
            map.count_value(*value);
        }
    }

    /// Adds the rank correlations of every map.
    pub(crate) fn add_correlations(&mut self, study: &Study, found: &RankCorrelations) {
        for (at, map) in self.maps.iter_mut().enumerate() {
            map.rank_correlations = found.of_map(study, at);
        }
    }

    /// Whether any map has a value anywhere.
    pub(crate) fn has_values(&self) -> bool {
        self.maps.iter().any(|map| map.values > 0)
    }

    /// The file.
    ///
    /// # Errors
    /// None for what [`Self::new`] makes.
    pub(crate) fn to_json(&self) -> Result<String, serde_json::Error> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}

impl AxisSummary {
    fn from_axis(axis: &SweepAxis, sampled: bool) -> Self {
        let (from, to) = (axis.values.first().copied(), axis.values.last().copied());
        Self {
            name: axis.parameter.name,
            unit: axis.parameter.unit,
            scale: axis.spacing,
            points: (!sampled).then_some(axis.values.len()),
            from,
            to,
        }
    }
}

impl MapSummary {
    fn from_map(study: &Study, map: &SweepMap) -> Self {
        Self {
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
        }
    }

    fn count_value(&mut self, value: Result<f64, MissingReason>) {
        match value {
            Ok(value) => {
                self.values += 1;
                self.least = Some(self.least.map_or(value, |least| least.min(value)));
                self.greatest = Some(self.greatest.map_or(value, |greatest| greatest.max(value)));
            }
            Err(reason) => *self.missing.entry(reason.name()).or_default() += 1,
        }
    }
}
