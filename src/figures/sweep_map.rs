//! Maps of a parameter study: a quantity against two parameters as colours, or against one parameter as a
//! curve. Points without a value are hatched.

mod claim;

use crate::feature::FeatureUnit;
use crate::model::parameters::ModelParameter;
use crate::simulate::scene::Scene;
use crate::sweep::{AxisSpacing, MissingReason, PointOutcome, Study, SweepAxis, SweepMap};
pub(super) use claim::{MapClaim, map_values};
use plain_charts::{
    AxisScale, COLUMN_WIDTH_MM, ChartAxis, Colour, Figure, Hatch, HatchPattern, HeatMap, Mark, MarkerShape,
    Panel, Series, VerticalLine, cell_edges,
};
use std::collections::BTreeMap;

/// Height of a map, mm.
const MAP_MM: f64 = 56.0;
/// Height of a curve, mm.
const CURVE_MM: f64 = 46.0;

/// Draws the map with index `at`; the figure has no panels if there is no such map.
#[must_use]
pub fn draw_figure(study: &Study, scene: &Scene, outcomes: &[PointOutcome], at: usize) -> Figure {
    let Some(map) = study.maps.get(at) else { return Figure::default() };
    let drawn = SweepMapValues::new(study, map, outcomes, at);
    let Some(mut panel) = drawn.draw_panel(study, scene, &ReasonPatterns::from_outcomes(outcomes)) else {
        return Figure::default();
    };
    for hatch in &mut panel.hatches {
        hatch.label = format!("{}: {}", hatch.label, hatch.cells.len());
    }
    Figure {
        title: MapClaim::new(study, map, &drawn.values).title(),
        subtitle: format!("{}; synthetic: a simulation, no camera took it", study.title),
        watermarked: true,
        description: format!(
            "{} over {}, from the scene \"{}\"; grey or hatched where a run has no value.",
            map_label(map),
            describe_axes(study),
            scene.title()
        ),
        width_mm: COLUMN_WIDTH_MM,
        panels: vec![panel],
        ..Figure::default()
    }
}

/// Labels of the axes of a study, as text.
pub(super) fn describe_axes(study: &Study) -> String {
    study.axes.iter().map(axis_label).collect::<Vec<_>>().join(" and ")
}

/// Values of a map at all points of the grid, in the unit of the figure, and the reasons for missing values.
pub(super) struct SweepMapValues<'a> {
    map: &'a SweepMap,
    pub values: Vec<Option<f64>>,
    reasons: Vec<Option<MissingReason>>,
}

impl<'a> SweepMapValues<'a> {
    /// The values of the map with index `at`.
    pub(crate) fn new(study: &Study, map: &'a SweepMap, outcomes: &[PointOutcome], at: usize) -> Self {
        let reason = |outcome: &PointOutcome| outcome.values.get(at)?.err();
        let reasons = outcomes.iter().map(reason).collect();
        Self { map, values: map_values(study, outcomes, at), reasons }
    }

    /// The panel of the map; `None` for a study without axes.
    pub(crate) fn draw_panel(
        &self,
        study: &Study,
        scene: &Scene,
        patterns: &ReasonPatterns,
    ) -> Option<Panel> {
        match study.axes.as_slice() {
            [x] => Some(self.draw_curve(x, scene, patterns)),
            [x, y, ..] => Some(self.draw_heat_map([x, y], scene, patterns)),
            [] => None,
        }
    }

    fn draw_heat_map(&self, [x, y]: [&SweepAxis; 2], scene: &Scene, patterns: &ReasonPatterns) -> Panel {
        let (across, up) = (DisplayAxis::new(x), DisplayAxis::new(y));
        let rows = up.middles.len().max(1);
        let heat = HeatMap {
            label: map_label(self.map),
            x: across.middles.clone(),
            y: up.middles.clone(),
            values: self.values.chunks(rows).map(<[_]>::to_vec).collect(),
            range: map_range(self.map).or_else(|| colour_limits(&self.values)),
            contours: true,
            ..HeatMap::default()
        };
        let cell = |index: usize| {
            let (column, row) = (index / rows, index % rows);
            let (left, right) = (across.edges.get(column)?, across.edges.get(column + 1)?);
            Some([*left, *right, *up.edges.get(row)?, *up.edges.get(row + 1)?])
        };
        let marker = across
            .scene_value(scene)
            .zip(up.scene_value(scene))
            .map(|at| Series::new(SCENE_LABEL, Colour::Vermilion, Mark::Hollow(MarkerShape::Diamond), [at]));
        Panel {
            heat_map: Some(heat),
            hatches: patterns.reason_hatches(&self.reasons, cell),
            ..Panel::new(across.chart_axis(), up.chart_axis(), MAP_MM, marker)
        }
    }

    fn draw_curve(&self, x: &SweepAxis, scene: &Scene, patterns: &ReasonPatterns) -> Panel {
        let across = DisplayAxis::new(x);
        let points = across.middles.iter().zip(&self.values).map(|(x, value)| value.map(|y| (*x, y)));
        let line = Series::new("", Colour::Blue, Mark::Joined(MarkerShape::Disc), points);
        let cell = |index: usize| {
            let (from, to) = (*across.edges.get(index)?, *across.edges.get(index + 1)?);
            Some([from, to, f64::NEG_INFINITY, f64::INFINITY])
        };
        let rule = |at| VerticalLine::new(SCENE_LABEL, Colour::Grey, Mark::Dashed, at);
        let y = ChartAxis::linear(map_label(self.map)).with_ends(map_range(self.map));
        Panel {
            vertical_lines: across.scene_value(scene).map(rule).into_iter().collect(),
            hatches: patterns.reason_hatches(&self.reasons, cell),
            ..Panel::new(across.chart_axis(), y, CURVE_MM, [line])
        }
    }
}

/// Label of the scene from which the study starts.
const SCENE_LABEL: &str = "the scene as written";

/// An axis of a study, in the unit of the figures.
struct DisplayAxis<'a> {
    axis: &'a SweepAxis,
    middles: Vec<f64>,
    edges: Vec<f64>,
}

impl<'a> DisplayAxis<'a> {
    fn new(axis: &'a SweepAxis) -> Self {
        let factor = display_unit(axis.parameter).1;
        let middles: Vec<f64> = axis.values.iter().map(|value| value * factor).collect();
        let edges = cell_edges(&middles, axis_scale(axis));
        Self { axis, middles, edges }
    }

    /// Axis of a chart, from the start of the first cell to the end of the last cell.
    fn chart_axis(&self) -> ChartAxis {
        let range = self.edges.first().copied().zip(self.edges.last().copied());
        let (label, scale) = (axis_label(self.axis), axis_scale(self.axis));
        ChartAxis { label, scale, range, ..ChartAxis::default() }
    }

    /// Value of the parameter in the scene itself; `None` if it lies outside the axis.
    fn scene_value(&self, scene: &Scene) -> Option<f64> {
        let value = scene.value(self.axis.parameter.name)? * display_unit(self.axis.parameter).1;
        let within = value >= *self.edges.first()? && value <= *self.edges.last()?;
        within.then_some(value)
    }
}

// Hatch patterns for missing values.

/// Hatch patterns, in order of preference, for reasons whose own pattern is already in use for another
/// reason.
const FALLBACK_PATTERNS: [HatchPattern; 9] = [
    HatchPattern::Dotted,
    HatchPattern::DashedUpright,
    HatchPattern::Dashed,
    HatchPattern::Upright,
    HatchPattern::Level,
    HatchPattern::Falling,
    HatchPattern::Rising,
    HatchPattern::Checked,
    HatchPattern::Crossed,
];

/// The hatch pattern of each reason for missing values in a study; two reasons share a pattern only if no
/// pattern is free.
#[derive(Debug, Clone, Default, PartialEq)]
pub(in crate::figures) struct ReasonPatterns(BTreeMap<MissingReason, HatchPattern>);

impl ReasonPatterns {
    pub(crate) fn from_outcomes(outcomes: &[PointOutcome]) -> Self {
        let values = outcomes.iter().flat_map(|outcome| &outcome.values);
        let mut found: Vec<MissingReason> = values.filter_map(|value| value.err()).collect();
        found.sort_unstable();
        found.dedup();
        Self::for_reasons(&found)
    }

    fn for_reasons(reasons: &[MissingReason]) -> Self {
        let mut given: BTreeMap<MissingReason, HatchPattern> = BTreeMap::new();
        let mut late = Vec::new();
        for reason in reasons {
            let own = default_pattern(*reason);
            if given.values().any(|taken| *taken == own) {
                late.push(*reason);
            } else {
                given.insert(*reason, own);
            }
        }
        for reason in late {
            let free =
                FALLBACK_PATTERNS.into_iter().find(|pattern| given.values().all(|taken| taken != pattern));
            given.insert(reason, free.unwrap_or(default_pattern(reason)));
        }
        Self(given)
    }

    /// One hatch for each reason for missing values in a map, in the order of the table of reasons; `cell`
    /// returns the rectangle of a point.
    pub(crate) fn reason_hatches(
        &self,
        reasons: &[Option<MissingReason>],
        cell: impl Fn(usize) -> Option<[f64; 4]>,
    ) -> Vec<Hatch> {
        let hatch = |reason: MissingReason| {
            let points = reasons.iter().enumerate().filter(|(_, found)| **found == Some(reason));
            let cells: Vec<[f64; 4]> = points.filter_map(|(index, _)| cell(index)).collect();
            let pattern = self.0.get(&reason).copied().unwrap_or(default_pattern(reason));
            Hatch { label: reason.meaning().to_owned(), pattern, cells }
        };
        MissingReason::all().map(hatch).filter(|hatch| !hatch.cells.is_empty()).collect()
    }
}

/// The hatch pattern of a reason for missing values, if no other reason of the study uses it. No pattern is
/// plain grey, which would look like a value in a print without colours.
fn default_pattern(reason: MissingReason) -> HatchPattern {
    match reason {
        MissingReason::ContactLost => HatchPattern::Rising,
        MissingReason::Jammed => HatchPattern::Falling,
        MissingReason::Indeterminate => HatchPattern::Upright,
        MissingReason::NoStart => HatchPattern::Level,
        MissingReason::Chattering | MissingReason::Diverged | MissingReason::WorkLimit => {
            HatchPattern::Crossed
        }
        MissingReason::NoComponent
        | MissingReason::Never
        | MissingReason::NoDecay
        | MissingReason::Faded
        | MissingReason::FewCycles => HatchPattern::Dotted,
        _ => HatchPattern::Checked,
    }
}

// Names, units and scales of the axes and maps of a study in figures.

pub(in crate::figures) fn axis_scale(axis: &SweepAxis) -> AxisScale {
    match axis.spacing {
        AxisSpacing::Linear => AxisScale::Linear,
        AxisSpacing::Log => AxisScale::Log,
    }
}

/// The range that a study sets for the colours or the y axis, in the display unit.
pub(in crate::figures) fn map_range(map: &SweepMap) -> Option<(f64, f64)> {
    let factor = map.reading.unit().factor;
    map.range.map(|(low, high)| (low * factor, high * factor))
}

/// Name and unit of a map.
pub(in crate::figures) fn map_label(map: &SweepMap) -> String {
    let FeatureUnit { shown, .. } = map.reading.unit();
    if shown.is_empty() { map.name.clone() } else { format!("{}, {shown}", map.name) }
}

/// Display unit of a parameter, and the factor from SI to that unit.
pub(in crate::figures) fn display_unit(parameter: &ModelParameter) -> (&'static str, f64) {
    match parameter.unit {
        "m" => ("mm", 1e3),
        "kg" => ("g", 1e3),
        "N m/rad" => ("mN m/rad", 1e3),
        unit => (unit, 1.0),
    }
}

/// Name of a parameter in words: "drive amplitude" for `drive.amplitude_m`.
pub(in crate::figures) fn parameter_words(axis: &SweepAxis) -> String {
    let ModelParameter { name, symbol, unit, .. } = axis.parameter;
    let (table, key) = name.split_once('.').unwrap_or(("", name));
    let suffix = format!("_{}", unit.to_lowercase().replace('/', " per ").replace(' ', "_"));
    let key = key.strip_suffix(&suffix).unwrap_or(key).replace('_', " ");
    // a key that equals the symbol is written like the symbol
    let key = if key.eq_ignore_ascii_case(symbol) { (*symbol).to_owned() } else { key };
    if table == "blade" { key } else { format!("{table} {key}") }
}

/// Label of an axis: "drive amplitude a, mm" for `drive.amplitude_m`.
pub(in crate::figures) fn axis_label(axis: &SweepAxis) -> String {
    let (words, symbol) = (parameter_words(axis), axis.parameter.symbol);
    let named = if words.ends_with(&format!(" {symbol}")) { words } else { format!("{words} {symbol}") };
    match display_unit(axis.parameter).0 {
        "1" => named,
        unit => format!("{named}, {unit}"),
    }
}

// Colour limits of a map.

/// Quantiles of the values that set the first and the last colour if values outside them are outliers.
const COLOUR_QUANTILES: [f64; 2] = [0.02, 0.98];
/// The smallest or largest value counts as an outlier if its distance from the nearer quantile exceeds this
/// fraction of the distance between the two quantiles.
const OUTLIER_DISTANCE: f64 = 0.25;
/// Minimum number of values that a map needs before any of them can count as an outlier.
const MIN_OUTLIER_SAMPLES: usize = 8;

/// Values of the first and the last colour. `None` means the full range: there are too few values, or nearly
/// all are equal.
pub(super) fn colour_limits(values: &[Option<f64>]) -> Option<(f64, f64)> {
    let mut sorted: Vec<f64> = values.iter().flatten().copied().filter(|v| v.is_finite()).collect();
    if sorted.len() < MIN_OUTLIER_SAMPLES {
        return None;
    }
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len() - 1;
    let [low, high] = COLOUR_QUANTILES.map(|share| share * last as f64);
    // the indices of the quantiles are rounded inwards; otherwise the extreme of a few values would be its
    // own quantile and could not be an outlier
    let (low, high) = (sorted[low.ceil() as usize], sorted[high.floor() as usize]);
    let between = high - low;
    let end = |share: f64, extreme: f64| {
        if (extreme - share).abs() > OUTLIER_DISTANCE * between { share } else { extreme }
    };
    (between > 0.0).then(|| (end(low, sorted[0]), end(high, sorted[last])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::parameters::{PARAMETERS, find_parameter};

    #[test]
    fn reasons_of_one_study_differ_and_keep_their_usual_pattern_where_it_is_free() {
        let reasons = [
            MissingReason::ContactLost,
            MissingReason::Diverged,
            MissingReason::NoComponent,
            MissingReason::NoDecay,
        ];
        let patterns = ReasonPatterns::for_reasons(&reasons);
        let given: Vec<HatchPattern> = reasons.iter().map(|reason| patterns.0[reason]).collect();
        assert_eq!(given[..3], [HatchPattern::Rising, HatchPattern::Crossed, HatchPattern::Dotted]);
        assert!(!given[..3].contains(&given[3]));
        let nine: Vec<MissingReason> = MissingReason::all().take(9).collect();
        let patterns = ReasonPatterns::for_reasons(&nine);
        let mut given: Vec<String> = patterns.0.values().map(|pattern| format!("{pattern:?}")).collect();
        given.sort_unstable();
        given.dedup();
        assert_eq!(given.len(), 9);
    }

    fn axis(name: &str) -> SweepAxis {
        SweepAxis {
            parameter: find_parameter(name).unwrap(),
            values: vec![1.0, 2.0],
            spacing: AxisSpacing::Linear,
        }
    }

    #[test]
    fn axes_are_named_in_words_with_symbol_and_unit() {
        let label = |name: &str| axis_label(&axis(name));
        assert_eq!(label("friction.a"), "friction A");
        assert_eq!(label("friction.b_s_per_m"), "friction B, s/m");
        assert_eq!(label("drive.amplitude_m"), "drive amplitude a, mm");
        assert_eq!(label("blade.neck_stiffness_n_m_per_rad"), "neck stiffness k1, mN m/rad");
        assert_eq!(label("blade.preload_force_n"), "preload force k0 hd, N");
        assert_eq!(parameter_words(&axis("blade.preload_force_n")), "preload force");
        let longest = PARAMETERS.iter().map(|p| label(p.name).chars().count()).max().unwrap();
        assert!(longest <= 45, "{longest} letters do not fit next to an axis of a narrow figure");
    }

    fn of(values: &[f64]) -> Option<(f64, f64)> {
        colour_limits(&values.iter().copied().map(Some).collect::<Vec<_>>())
    }

    #[test]
    fn one_outlier_does_not_stretch_the_colours_and_a_smooth_map_keeps_its_ends() {
        let smooth: Vec<f64> = (0..50).map(f64::from).collect();
        assert_eq!(of(&smooth), Some((0.0, 49.0)));
        let outlier: Vec<f64> = smooth.iter().copied().chain([5000.0]).collect();
        assert_eq!(of(&outlier), Some((0.0, 49.0)));
        let below: Vec<f64> = smooth.iter().copied().chain([-5000.0]).collect();
        assert_eq!(of(&below), Some((0.0, 49.0)));
        assert_eq!(of(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 900.0]), Some((1.0, 8.0)));
    }

    #[test]
    fn few_values_and_constants_have_the_colours_of_their_ends() {
        assert_eq!(of(&[1.0, 2.0, 300.0]), None);
        assert_eq!(of(&[3.0; 20]), None);
        assert_eq!(colour_limits(&[None, Some(f64::NAN)]), None);
    }
}
