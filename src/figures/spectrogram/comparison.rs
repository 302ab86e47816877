//! Spectrograms of a recording and of the model side by side on one scale, with both ridges over time and
//! over speed.

use super::{
    FULL_WIDTH_MM, Figure, SpectrogramPlot, SpectrogramRidgePoint, SpeedPoint, colour_range_db, decibel_map,
    draw_map, limit_axis, subtitle, time_span,
};
use crate::chart::{ChartAxis, Colour, ErrorBar, Mark, MarkerShape, Panel, Series};
use crate::figures::spectrogram;

/// Whose spectrogram it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpectrogramSide {
    /// Of the recording.
    Measured,
    /// Of the model.
    Model,
}

/// What the figure shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SpectrogramComparison {
    /// Heading.
    pub title: String,
    /// How they were made; empty for none.
    pub note: String,
    /// Whether the measured motion is one that no camera took.
    pub synthetic: bool,
    /// One or both, over the same frequencies; the first sets the colours.
    pub sides: Vec<(SpectrogramSide, SpectrogramPlot)>,
}

/// Heights of the maps and of the ridges under them, mm.
const HEIGHT_MM: f64 = 56.0;
const RIDGE_HEIGHT_MM: f64 = 40.0;
/// Most columns and rows of a map: two of them stay small, and a cell is no wider than a millimetre.
const MOST_COLUMNS: usize = 64;
const MOST_ROWS: usize = 48;
const MILLIMETRES: f64 = 1e3;

impl SpectrogramSide {
    fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Model => "model",
        }
    }

    fn colour(self) -> Colour {
        match self {
            Self::Measured => Colour::Black,
            Self::Model => Colour::Vermilion,
        }
    }

    fn shape(self) -> MarkerShape {
        match self {
            Self::Measured => MarkerShape::Disc,
            Self::Model => MarkerShape::Square,
        }
    }
}

/// The figure.
#[must_use]
pub fn draw_comparison(shown: &SpectrogramComparison) -> Figure {
    let sides: Vec<(SpectrogramSide, SpectrogramPlot)> =
        shown.sides.iter().map(|(of, s)| (*of, coarsen_spectrogram(s))).collect();
    let range = sides.first().and_then(|(_, s)| colour_range_db(&decibel_map(&s.amplitude_m)));
    let time = limit_axis(ChartAxis::time(), common_span_s(&sides));
    let mut panels: Vec<Panel> = sides
        .iter()
        .map(|(of, s)| {
            title_panel(draw_map(s), *of, range, shown.sides.len() > 1 && *of == SpectrogramSide::Measured)
        })
        .collect();
    panels.iter_mut().for_each(|panel| panel.x = time.clone());
    panels.extend(
        [draw_ridges_over_time(&shown.sides, time), draw_ridges_over_speed(&shown.sides)]
            .into_iter()
            .flatten(),
    );
    Figure {
        title: shown.title.clone(),
        subtitle: subtitle(shown.synthetic, &shown.note),
        watermarked: shown.synthetic,
        description: "Spectrograms: amplitude of a sine over time and frequency, in dB re 1 \u{b5}m, with \
        the ridges that were followed."
            .to_owned(),
        width_mm: FULL_WIDTH_MM,
        columns: sides.len(),
        panels,
    }
}

/// From the first column of either side to the last: with one axis of time, panels one below the other are
/// numbered once.
fn common_span_s(sides: &[(SpectrogramSide, SpectrogramPlot)]) -> Option<(f64, f64)> {
    sides.iter().filter_map(|(_, s)| time_span(&s.time_s)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

fn title_panel(panel: Panel, of: SpectrogramSide, range: Option<(f64, f64)>, without_bar: bool) -> Panel {
    let heat = panel.heat_map.map(|heat| super::HeatMap {
        range,
        without_bar,
        label: "amplitude, dB re 1 \u{b5}m".to_owned(),
        ..heat
    });
    Panel { title: of.name().to_owned(), heat_map: heat, height_mm: HEIGHT_MM, ..panel }
}

/// Neighbouring columns and rows as one, with the largest of their amplitudes, so that a thin line stays; the
/// frequencies outside what is shown are left out.
fn coarsen_spectrogram(shown: &SpectrogramPlot) -> SpectrogramPlot {
    let (low, high) = shown.shown_hz.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
    let from = shown.frequency_hz.partition_point(|f| *f < low);
    let to = shown.frequency_hz.partition_point(|f| *f <= high).max(from);
    let (columns, rows) =
        (shown.time_s.len().div_ceil(MOST_COLUMNS).max(1), (to - from).div_ceil(MOST_ROWS).max(1));
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let block = |columns: &[Vec<Option<f64>>]| -> Vec<Option<f64>> {
        let row = |start: usize| {
            let cells = columns
                .iter()
                .flat_map(|column| column.get(start..(start + rows).min(to)).unwrap_or_default());
            cells.flatten().copied().reduce(f64::max)
        };
        (from..to).step_by(rows).map(row).collect()
    };
    SpectrogramPlot {
        time_s: shown.time_s.chunks(columns).map(mean).collect(),
        frequency_hz: shown.frequency_hz.get(from..to).unwrap_or_default().chunks(rows).map(mean).collect(),
        amplitude_m: shown.amplitude_m.chunks(columns).map(block).collect(),
        ridge: thin_ridge(&shown.ridge),
        ..shown.clone()
    }
}

/// Points of a ridge that stand apart on a map, with its interruptions.
fn thin_ridge(ridge: &[SpectrogramRidgePoint]) -> Vec<SpectrogramRidgePoint> {
    let every = ridge.len().div_ceil(MOST_COLUMNS).max(1);
    ridge
        .iter()
        .enumerate()
        .filter(|(i, p)| p.frequency_hz.is_none() || i % every == 0)
        .map(|(_, p)| *p)
        .collect()
}

/// Both ridges over time.
fn draw_ridges_over_time(sides: &[(SpectrogramSide, SpectrogramPlot)], time: ChartAxis) -> Option<Panel> {
    let place = |p: &SpectrogramRidgePoint| p.frequency_hz.map(|f| (p.time_s, f));
    let line = |(of, shown): &(SpectrogramSide, SpectrogramPlot)| Series {
        label: format!("ridge, {}", of.name()),
        colour: of.colour(),
        mark: if *of == SpectrogramSide::Measured { Mark::Thin } else { Mark::Thick },
        points: shown.ridge.iter().map(place).collect(),
        ..Series::default()
    };
    // the model lies under the recording
    let ridges: Vec<Series> =
        sides.iter().rev().map(line).filter(|s| s.points.iter().any(Option::is_some)).collect();
    let targets = sides.first().map_or(&[][..], |(_, first)| &first.targets);
    (!ridges.is_empty()).then(|| Panel {
        title: "ridge over time".to_owned(),
        x: time,
        y: ChartAxis::linear("frequency, Hz"),
        height_mm: RIDGE_HEIGHT_MM,
        series: spectrogram::target_lines_over_ridges(targets).chain(ridges).collect(),
        ..Panel::default()
    })
}

/// Both ridges over the speed of the tip.
fn draw_ridges_over_speed(sides: &[(SpectrogramSide, SpectrogramPlot)]) -> Option<Panel> {
    let place = |p: &SpeedPoint| (p.tip_speed_m_per_s * MILLIMETRES, p.frequency_hz);
    let bar = |p: &SpeedPoint| {
        let ((x, f), sd) = (place(p), p.frequency_sd_hz?);
        Some(ErrorBar::Vertical { x, from: f - 2.0 * sd, to: f + 2.0 * sd })
    };
    let symbols = |(of, shown): &(SpectrogramSide, SpectrogramPlot)| Series {
        label: format!("{} \u{b1} 2 sd", of.name()),
        colour: of.colour(),
        mark: Mark::Hollow(of.shape()),
        points: shown.over_speed.iter().map(|p| Some(place(p))).collect(),
        error_bars: shown.over_speed.iter().filter_map(bar).collect(),
    };
    let series: Vec<Series> = sides.iter().rev().map(symbols).filter(|s| !s.points.is_empty()).collect();
    (!series.is_empty()).then(|| Panel {
        title: "ridge over tip speed".to_owned(),
        x: ChartAxis::linear("tip speed, mm/s"),
        y: ChartAxis::linear("frequency, Hz"),
        height_mm: RIDGE_HEIGHT_MM,
        series,
        ..Panel::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::Medium;

    fn shown(columns: usize, scale: f64) -> SpectrogramPlot {
        let column = |i: usize| {
            (0..1000)
                .map(|j| {
                    Some(
                        scale
                            * if j == 400 + i % 20 {
                                1e-5
                            } else {
                                1e-8 * (1.0 + ((i * 37 + j * 11) % 97) as f64)
                            },
                    )
                })
                .collect()
        };
        SpectrogramPlot {
            time_s: (0..columns).map(|i| i as f64 * 0.01).collect(),
            frequency_hz: (0..1000).map(|j| f64::from(j) * 2.5).collect(),
            amplitude_m: (0..columns).map(column).collect(),
            shown_hz: Some((0.0, 2000.0)),
            ridge: (0..columns)
                .map(|i| SpectrogramRidgePoint { time_s: i as f64 * 0.01, frequency_hz: Some(1000.0) })
                .collect(),
            over_speed: (0..columns)
                .map(|i| SpeedPoint {
                    tip_speed_m_per_s: i as f64 * 1e-3,
                    frequency_hz: 1000.0,
                    frequency_sd_hz: Some(5.0),
                })
                .collect(),
            ..SpectrogramPlot::default()
        }
    }

    fn both() -> SpectrogramComparison {
        SpectrogramComparison {
            sides: vec![
                (SpectrogramSide::Measured, shown(200, 1.0)),
                (SpectrogramSide::Model, shown(200, 0.1)),
            ],
            ..SpectrogramComparison::default()
        }
    }

    #[test]
    fn both_maps_have_one_scale_and_one_bar() {
        let drawn = draw_comparison(&both());
        let heats: Vec<_> = drawn.panels.iter().filter_map(|p| p.heat_map.as_ref()).collect();
        assert_eq!(heats.iter().map(|h| h.without_bar).collect::<Vec<_>>(), [true, false]);
        assert!(heats[0].range.is_some() && heats[0].range == heats[1].range);
        assert_eq!(
            drawn.panels.iter().map(|p| p.title.as_str()).collect::<Vec<_>>(),
            ["measured", "model", "ridge over time", "ridge over tip speed"]
        );
    }

    #[test]
    fn the_model_alone_has_its_own_bar() {
        let drawn = draw_comparison(&SpectrogramComparison {
            sides: both().sides.split_off(1),
            ..SpectrogramComparison::default()
        });
        assert_eq!(
            drawn
                .panels
                .iter()
                .filter_map(|p| p.heat_map.as_ref())
                .map(|h| h.without_bar)
                .collect::<Vec<_>>(),
            [false]
        );
        assert_eq!(drawn.panels.len(), 3);
    }

    #[test]
    fn coarse_maps_keep_thin_lines_within_what_is_shown() {
        let small = coarsen_spectrogram(&shown(200, 1.0));
        assert!(small.time_s.len() <= MOST_COLUMNS && small.frequency_hz.len() <= MOST_ROWS);
        assert!(small.frequency_hz.iter().all(|f| *f <= 2000.0));
        assert!(
            small
                .amplitude_m
                .iter()
                .all(|column| column.len() == small.frequency_hz.len() && column.contains(&Some(1e-5)))
        );
    }

    #[test]
    fn the_figure_is_small_in_every_medium() {
        for medium in [Medium::Screen, Medium::Column, Medium::Page] {
            let bytes = draw_comparison(&SpectrogramComparison {
                sides: vec![
                    (SpectrogramSide::Measured, shown(400, 1.0)),
                    (SpectrogramSide::Model, shown(400, 0.1)),
                ],
                ..both()
            })
            .to_svg(medium)
            .len();
            assert!(bytes < 210_000, "{medium:?}: {bytes} bytes");
        }
    }
}
