//! Spectrograms of recording and model on one colour scale, with both ridges against time and against tip
//! speed.

use super::{
    Figure, SpectrogramPlot, colour_range_db, decibel_map, draw_map, full_figure, ridge_points, time_span,
};
use crate::figures::spectrogram;
use plain_charts::{ChartAxis, Colour, HeatMap, Mark, MarkerShape, Panel, Series};

/// The source of a spectrogram.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpectrogramSide {
    /// The recording.
    Measured,
    /// The model.
    Model,
}

/// Data of the figure.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SpectrogramComparison {
    /// Heading.
    pub title: String,
    /// Note on the settings of the spectrograms; empty for none.
    pub note: String,
    /// Whether the measured motion is synthetic.
    pub synthetic: bool,
    /// The spectrograms of recording, model or both, with the same frequencies; the first one sets the colour
    /// scale.
    pub sides: Vec<(SpectrogramSide, SpectrogramPlot)>,
}

/// Height of a map, mm.
const HEIGHT_MM: f64 = 56.0;
/// Height of a panel of ridges, mm.
const RIDGE_HEIGHT_MM: f64 = 40.0;
/// Maximum number of columns of a map, which keeps files small; a cell is still narrower than a millimetre.
const MOST_COLUMNS: usize = 64;
/// Maximum number of rows of a map, which keeps files small.
const MOST_ROWS: usize = 48;

impl SpectrogramSide {
    /// Name, colour, symbol of the points and line style of the ridge.
    fn look(self) -> (&'static str, Colour, MarkerShape, Mark) {
        match self {
            Self::Measured => ("measured", Colour::Black, MarkerShape::Disc, Mark::Thin),
            Self::Model => ("model", Colour::Vermilion, MarkerShape::Square, Mark::Thick),
        }
    }
}

/// Draws the figure.
#[must_use]
pub fn draw_comparison(shown: &SpectrogramComparison) -> Figure {
    let sides: Vec<(SpectrogramSide, SpectrogramPlot)> =
        shown.sides.iter().map(|(of, s)| (*of, coarsen_spectrogram(s))).collect();
    let range = sides.first().and_then(|(_, s)| colour_range_db(&decibel_map(&s.amplitude_m)));
    // stacked panels with equal time axes share their tick labels
    let spans = sides.iter().filter_map(|(_, s)| time_span(&s.time_s));
    let span_s = spans.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    let time = ChartAxis::time().with_ends(span_s);
    let mut panels: Vec<Panel> = sides
        .iter()
        .map(|(of, s)| {
            let panel = draw_map(s);
            let heat_map = panel.heat_map.map(|heat| HeatMap {
                range,
                without_bar: shown.sides.len() > 1 && *of == SpectrogramSide::Measured,
                label: "amplitude, dB re 1 \u{b5}m".to_owned(),
                ..heat
            });
            Panel { title: of.look().0.to_owned(), heat_map, height_mm: HEIGHT_MM, x: time.clone(), ..panel }
        })
        .collect();
    panels.extend(draw_ridges_over_time(&shown.sides, time));
    panels.extend(draw_ridges_over_speed(&shown.sides));
    Figure {
        columns: sides.len(),
        ..full_figure(
            &shown.title,
            shown.synthetic,
            &shown.note,
            "Spectrograms: amplitude of a sine over time and frequency, in dB re 1 \u{b5}m, with \
        the ridges that were followed."
                .to_owned(),
            panels,
        )
    }
}

/// Merges neighbouring columns and rows of a spectrogram. A merged cell has the largest amplitude of its
/// cells, which preserves thin lines. Frequencies that are not shown are dropped.
fn coarsen_spectrogram(shown: &SpectrogramPlot) -> SpectrogramPlot {
    let (low, high) = shown.shown_hz.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
    let from = shown.frequency_hz.partition_point(|f| *f < low);
    let to = shown.frequency_hz.partition_point(|f| *f <= high).max(from);
    let (columns, rows) =
        (shown.time_s.len().div_ceil(MOST_COLUMNS).max(1), (to - from).div_ceil(MOST_ROWS).max(1));
    // every n-th point of the ridge, and all its gaps
    let every = shown.ridge.len().div_ceil(MOST_COLUMNS).max(1);
    let ridge = shown.ridge.iter().enumerate().filter(|(i, p)| p.frequency_hz.is_none() || i % every == 0);
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
        ridge: ridge.map(|(_, p)| *p).collect(),
        ..shown.clone()
    }
}

/// Both ridges against time.
fn draw_ridges_over_time(sides: &[(SpectrogramSide, SpectrogramPlot)], time: ChartAxis) -> Option<Panel> {
    let line = |(of, shown): &(SpectrogramSide, SpectrogramPlot)| {
        let (name, colour, _, mark) = of.look();
        Series::new(format!("ridge, {name}"), colour, mark, ridge_points(&shown.ridge))
    };
    // the model is drawn below the recording
    let ridges: Vec<Series> =
        sides.iter().rev().map(line).filter(|s| s.points.iter().any(Option::is_some)).collect();
    let targets = sides.first().map_or(&[][..], |(_, first)| &first.targets);
    let series = spectrogram::target_lines_over_ridges(targets).chain(ridges.iter().cloned());
    (!ridges.is_empty()).then(|| Panel {
        title: "ridge over time".to_owned(),
        ..Panel::new(time, ChartAxis::linear("frequency, Hz"), RIDGE_HEIGHT_MM, series)
    })
}

/// Both ridges against the speed of the tip.
fn draw_ridges_over_speed(sides: &[(SpectrogramSide, SpectrogramPlot)]) -> Option<Panel> {
    let symbols = |(of, shown): &(SpectrogramSide, SpectrogramPlot)| {
        let (name, colour, shape, _) = of.look();
        spectrogram::speed_series(name, colour, shape, &shown.over_speed)
    };
    let series: Vec<Series> = sides.iter().rev().map(symbols).filter(|s| !s.points.is_empty()).collect();
    let (x, y) = (ChartAxis::linear("tip speed, mm/s"), ChartAxis::linear("frequency, Hz"));
    (!series.is_empty()).then(|| Panel {
        title: "ridge over tip speed".to_owned(),
        ..Panel::new(x, y, RIDGE_HEIGHT_MM, series)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figures::spectrogram::{SpectrogramRidgePoint, SpeedPoint};
    use plain_charts::Medium;

    fn example_spectrogram(columns: usize, scale: f64) -> SpectrogramPlot {
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
                    speed_m_per_s: i as f64 * 1e-3,
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
                (SpectrogramSide::Measured, example_spectrogram(200, 1.0)),
                (SpectrogramSide::Model, example_spectrogram(200, 0.1)),
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
        let small = coarsen_spectrogram(&example_spectrogram(200, 1.0));
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
                    (SpectrogramSide::Measured, example_spectrogram(400, 1.0)),
                    (SpectrogramSide::Model, example_spectrogram(400, 0.1)),
                ],
                ..both()
            })
            .to_svg(medium)
            .len();
            assert!(bytes < 210_000, "{medium:?}: {bytes} bytes");
        }
    }
}
