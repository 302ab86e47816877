//! Spectrograms of recording and model side by side, on one colour scale.

use super::{Figure, SpectrogramPlot, colour_range_db, decibel_map, draw_map, full_figure, time_span};
use plain_charts::{ChartAxis, HeatMap, Panel};

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
const HEIGHT_MM: f64 = 80.0;

impl SpectrogramSide {
    fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Model => "model",
        }
    }
}

/// Draws the figure.
#[must_use]
pub fn draw_comparison(shown: &SpectrogramComparison) -> Figure {
    let range = shown.sides.first().and_then(|(_, s)| colour_range_db(&decibel_map(&s.amplitude_m)));
    // both panels have the same time axis, so that the reader can compare them
    let spans = shown.sides.iter().filter_map(|(_, s)| time_span(&s.time_s));
    let span_s = spans.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    let map = |(of, s): &(SpectrogramSide, SpectrogramPlot)| {
        let panel = draw_map(s);
        let heat_map = panel.heat_map.map(|heat| HeatMap {
            range,
            without_bar: shown.sides.len() > 1 && *of == SpectrogramSide::Measured,
            label: "amplitude, dB re 1 \u{b5}m".to_owned(),
            ..heat
        });
        let x = ChartAxis::time().with_ends(span_s);
        Panel { title: of.name().to_owned(), heat_map, height_mm: HEIGHT_MM, x, ..panel }
    };
    Figure {
        columns: shown.sides.len(),
        ..full_figure(
            &shown.title,
            shown.synthetic,
            &shown.note,
            "Spectrograms: amplitude of a sine over time and frequency, in dB re 1 \u{b5}m, with the ridges that \
             were followed.",
            shown.sides.iter().map(map).collect::<Vec<Panel>>(),
        )
    }
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
        assert_eq!(drawn.panels.iter().map(|p| p.title.as_str()).collect::<Vec<_>>(), ["measured", "model"]);
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
        assert_eq!(drawn.panels.len(), 1);
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
            assert!(bytes < 250_000, "{medium:?}: {bytes} bytes");
        }
    }
}
