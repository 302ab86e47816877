//! Growth of small vibrations about steady sliding, against speed or over speed and preload, and the
//! stick-slip cycle against speed.

use super::sweep_map::colour_limits;
use crate::stability::cycle_branch::CycleBranch;
use crate::stability::shooting::PeriodicMotion;
use crate::stability::speed_intervals::{SlidingState, unstable_range};
use crate::stability::steady_sliding::NoSliding;
use crate::stability::study::{StabilityStudy, StudyPoint};
use crate::text::format_digits;
use plain_charts::{
    AxisScale, COLUMN_WIDTH_MM, ChartAxis, Colour, ColourMap, Figure, Hatch, HatchPattern, HeatMap, Mark,
    Panel, Series, cell_edges,
};

/// Height of the panel, mm.
const PANEL_MM: f64 = 56.0;

/// The map of the growth over speed and preload, or its curves against speed if the study has only the
/// preload of the scene. The title gives the unstable speeds at the preload of the scene in both cases.
#[must_use]
pub fn draw_figure(title: &str, study: &StabilityStudy) -> Figure {
    let panels = match &study.by_preload[..] {
        [] => std::iter::once(draw_curves(study)).chain(draw_cycle(study)).collect(),
        _ => vec![draw_map(study)],
    };
    Figure {
        title: claim_sentence(study),
        subtitle: match panels.len() {
            1 => format!("{title}; small vibrations about steady sliding, without stick-slip"),
            _ => format!("{title}; small vibrations about steady sliding (top) and the stick-slip cycle"),
        },
        watermarked: false,
        description: format!(
            "Growth of small vibrations about steady sliding from {} to {} m/s; curves have gaps and maps are \
             hatched where the blade cannot slide steadily. Amplitude and frequency of the stick-slip cycle, where \
             one is found.",
            study.range.speeds_m_per_s[0], study.range.speeds_m_per_s[1]
        ),
        width_mm: COLUMN_WIDTH_MM,
        panels,
        ..Figure::default()
    }
}

fn claim_sentence(study: &StabilityStudy) -> String {
    let Some([onset, end]) = study.unstable_range() else {
        return "Steady sliding is stable at all these speeds where it is possible".to_owned();
    };
    let intervals = study.own.iter().flat_map(|survey| &survey.intervals);
    let modes = intervals.filter_map(|interval| Some(interval.modes?[0]));
    let band = modes
        .reduce(|a, b| if b.growth_per_s > a.growth_per_s { b } else { a })
        .and_then(|mode| mode.band)
        .map(|band| format!(" ({})", band.name()));
    let [onset, end] = [onset, end].map(|speed| format_digits(speed, 3));
    let sentence =
        format!("Steady sliding is unstable between {onset} and {end} m/s{}", band.unwrap_or_default());
    match study.leading_branch().and_then(CycleBranch::fold_m_per_s) {
        Some(fold) if study.by_preload.is_empty() => {
            format!("{sentence}; a stick-slip cycle goes on up to {} m/s", format_digits(fold, 3))
        }
        _ => sentence,
    }
}

fn speed_axis(study: &StabilityStudy) -> ChartAxis {
    let [from, to] = study.range.speeds_m_per_s;
    ChartAxis::linear("speed of the head, m/s").with_range(from, to)
}

/// One curve for each mode, in rising order of frequency.
fn draw_curves(study: &StabilityStudy) -> Panel {
    const STYLES: [(Colour, Mark); 4] = [
        (Colour::Blue, Mark::Line),
        (Colour::Vermilion, Mark::Line),
        (Colour::Green, Mark::Dashed),
        (Colour::Orange, Mark::Dotted),
    ];
    // the first survey is that towards +v
    let points = study.own.first().map_or(&[][..], |survey| &survey.points);
    let modes = |point: &StudyPoint| point.slide.as_ref().map_or(Vec::new(), |slide| slide.modes.clone());
    let count = points.iter().map(|point| modes(point).len()).max().unwrap_or(0);
    let curves = STYLES.iter().enumerate().take(count).map(|(i, (colour, mark))| {
        let found: Vec<_> =
            points.iter().map(|point| (point.speed_m_per_s, modes(point).get(i).copied())).collect();
        let named = found.iter().find_map(|(_, mode)| *mode).map_or(0.0, |mode| mode.frequency_hz);
        let label = format!("mode {}, {} Hz", i + 1, format_digits(named, 3));
        let curve = found.into_iter().map(|(speed, mode)| mode.map(|mode| (speed, mode.growth_per_s)));
        Series::new(label, *colour, *mark, curve)
    });
    let [from, to] = study.range.speeds_m_per_s;
    let zero = Series::new("", Colour::Grey, Mark::Line, [(from, 0.0), (to, 0.0)]);
    let series: Vec<Series> = std::iter::once(zero).chain(curves).collect();
    Panel::new(speed_axis(study), ChartAxis::linear("growth, 1/s"), PANEL_MM, series)
}

/// Whether a motion belongs to a curve.
type IsKind = fn(&PeriodicMotion) -> bool;

/// Amplitude and frequency of the cycle along its branch: stable and unstable cycles, and vibrations without
/// stick; with steady sliding at amplitude zero. Empty without a cycle.
fn draw_cycle(study: &StabilityStudy) -> Vec<Panel> {
    /// Height of each panel, mm.
    const HEIGHT_MM: f64 = 38.0;
    const MICROMETRES: f64 = 1e6;
    let Some(branch) = study.leading_branch() else { return Vec::new() };
    let kinds: [(&str, Colour, Mark, IsKind); 4] = [
        ("stable cycle", Colour::Vermilion, Mark::Line, |m| m.is_stable() && !m.sticks_s.is_empty()),
        ("unstable cycle", Colour::Vermilion, Mark::Dashed, |m| !m.is_stable() && !m.sticks_s.is_empty()),
        ("stable vibration without stick", Colour::Blue, Mark::Line, |m| {
            m.is_stable() && m.sticks_s.is_empty()
        }),
        ("unstable vibration without stick", Colour::Blue, Mark::Dashed, |m| {
            !m.is_stable() && m.sticks_s.is_empty()
        }),
    ];
    let curves = |value: fn(&PeriodicMotion) -> f64| -> Vec<Series> {
        let all = kinds.into_iter().filter(|(.., is_kind)| branch.motions.iter().any(is_kind));
        all.map(|(label, colour, mark, is_kind)| {
            let motions = branch.motions.iter().enumerate();
            let points = motions.map(|(i, motion)| {
                // a curve goes on to the first motion of the next kind, so that the branch has no gap
                let joins = i > 0 && is_kind(&branch.motions[i - 1]);
                (is_kind(motion) || joins).then_some((motion.speed_m_per_s, value(motion)))
            });
            Series::new(label, colour, mark, points)
        })
        .collect()
    };
    let survey = study.own.iter().find(|survey| survey.direction == branch.direction);
    let rest = survey.into_iter().flat_map(|survey| &survey.intervals).filter_map(|interval| {
        let [from, to] = interval.speeds_m_per_s;
        let (label, mark) = match interval.state {
            SlidingState::Stable => ("stable steady sliding", Mark::Line),
            SlidingState::Unstable => ("unstable steady sliding", Mark::Dashed),
            SlidingState::Impossible(_) => return None,
        };
        Some(Series::new(label, Colour::Grey, mark, [(from, 0.0), (to, 0.0)]))
    });
    let amplitude: Vec<Series> = rest.chain(curves(|motion| MICROMETRES * motion.amplitude_m)).collect();
    let frequency = curves(PeriodicMotion::frequency_hz);
    let axes = [("amplitude of the tip, µm", amplitude), ("frequency, Hz", frequency)];
    axes.into_iter()
        .map(|(label, series)| Panel::new(speed_axis(study), ChartAxis::linear(label), HEIGHT_MM, series))
        .collect()
}

/// Growth of the mode that grows fastest as colours, with the highest unstable speed of each preload as a
/// line.
fn draw_map(study: &StabilityStudy) -> Panel {
    let rows = study.range.points;
    // the first surveys are those towards +v
    let surveys = &study.by_preload[..rows];
    let growth = |point: &StudyPoint| Some(point.slide.as_ref().ok()?.leading_mode().growth_per_s);
    let at = |speed: usize, preload: usize| &surveys[preload].points[speed];
    let all: Vec<Option<f64>> = surveys.iter().flat_map(|survey| survey.points.iter().map(growth)).collect();
    let largest = all.iter().flatten().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    // the colour range is symmetric about zero, so the hue changes where the growth changes sign
    let limit = colour_limits(&all).map_or(largest, |(low, high)| low.abs().max(high.abs()));
    let preloads: Vec<f64> = surveys.iter().map(|survey| survey.preload_n).collect();
    let speeds: Vec<f64> = (0..rows).map(|column| at(column, 0).speed_m_per_s).collect();
    let values = (0..rows).map(|column| (0..rows).map(|row| growth(at(column, row))).collect());
    let heat = HeatMap {
        label: "growth, 1/s".to_owned(),
        x: speeds.clone(),
        y: preloads.clone(),
        values: values.collect(),
        range: Some((-limit, limit)),
        colour_map: ColourMap::Diverging,
        ..HeatMap::default()
    };
    let [x, y] = [&speeds, &preloads].map(|middles| cell_edges(middles, AxisScale::Linear));
    let cells = |reason: NoSliding| -> Vec<[f64; 4]> {
        let all = (0..rows).flat_map(|column| (0..rows).map(move |row| (column, row)));
        let missing = all.filter(|(column, row)| at(*column, *row).slide.as_ref().err() == Some(&reason));
        missing.map(|(column, row)| [x[column], x[column + 1], y[row], y[row + 1]]).collect()
    };
    let reasons = [
        (NoSliding::NoEquilibrium, "no equilibrium", HatchPattern::Level),
        (NoSliding::ContactLost, "contact lost", HatchPattern::Rising),
        (NoSliding::Jammed, "jammed", HatchPattern::Falling),
    ];
    let hatches = reasons
        .into_iter()
        .map(|(reason, label, pattern)| Hatch { label: label.to_owned(), pattern, cells: cells(reason) })
        .filter(|hatch| !hatch.cells.is_empty());
    let [_, top] = study.range.speeds_m_per_s;
    let ends = surveys.iter().map(|survey| {
        let [_, end] = unstable_range(&survey.intervals)?;
        (end < top).then_some((end, survey.preload_n))
    });
    let boundary = Series::new("end of the instability", Colour::Black, Mark::Line, ends);
    let preload_axis = ChartAxis::linear("preload, N").with_range(y[0], y[rows]);
    let speed_axis = speed_axis(study).with_range(x[0], x[rows]);
    Panel {
        heat_map: Some(heat),
        hatches: hatches.collect(),
        ..Panel::new(speed_axis, preload_axis, PANEL_MM, [boundary])
    }
}
