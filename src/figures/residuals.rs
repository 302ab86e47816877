//! What a model leaves of a recording against white noise: how large, how alike from frame to frame, at which
//! frequencies, and how it grows with the length of a run.

pub(crate) mod caption;

use crate::chart::{ChartAxis, Colour, FULL_WIDTH_MM, Figure, Mark, MarkerShape, Panel, Ribbon, Series};
use crate::figures::subtitle;
use crate::math;

/// What the figure shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ResidualDiagnostics {
    /// Heading: the claim with its number.
    pub title: String,
    /// More to say; empty for none.
    pub note: String,
    /// Whether the recording is one that no camera took.
    pub synthetic: bool,
    /// Bins of the residual in deviations of the noise, from and to, with the density of the frames in each.
    pub histogram: Vec<(f64, f64, f64)>,
    /// Lags, s, and the correlation of the residual with itself so much later.
    pub correlation: Vec<(f64, f64)>,
    /// Correlation that white noise stays under in 95 % of the lags.
    pub white_95: f64,
    /// Frequencies, Hz, and the power density over that of the noise.
    pub spectrum: Vec<(f64, f64)>,
    /// Lengths of segments, s, and chi2 per degree of freedom; empty where none were fitted.
    pub growth: Vec<(f64, f64)>,
}

/// Height of a panel, mm.
const HEIGHT_MM: f64 = 40.0;
const MILLISECONDS: f64 = 1e3;
/// Points of the curve of the noise.
const POINTS: u32 = 60;

/// The figure.
#[must_use]
pub fn draw_figure(shown: &ResidualDiagnostics) -> Figure {
    let panels = [draw_histogram(shown), draw_correlation(shown), draw_spectrum(shown), draw_growth(shown)];
    Figure {
        title: shown.title.clone(),
        subtitle: subtitle(shown.synthetic, &shown.note),
        watermarked: shown.synthetic,
        description: "Residual in units of the noise: histogram, autocorrelation and spectrum against white \
                      noise, and chi2 over the length of the segments."
            .to_owned(),
        width_mm: FULL_WIDTH_MM,
        columns: 2,
        panels: panels.into_iter().flatten().collect(),
    }
}

fn residual_line(label: &str, colour: Colour, mark: Mark, points: Vec<Option<(f64, f64)>>) -> Series {
    Series { label: label.to_owned(), colour, mark, points, ..Series::default() }
}

const RESIDUAL: &str = "residual";
const WHITE: &str = "white noise";

fn draw_histogram(shown: &ResidualDiagnostics) -> Option<Panel> {
    let (first, last) = (shown.histogram.first()?, shown.histogram.last()?);
    let steps =
        shown.histogram.iter().flat_map(|(from, to, share)| [Some((*from, *share)), Some((*to, *share))]);
    let bars = shown
        .histogram
        .iter()
        .flat_map(|(from, to, share)| [Some((*from, 0.0, *share)), Some((*to, 0.0, *share))]);
    let at = |k: u32| first.0 + (last.1 - first.0) * f64::from(k) / f64::from(POINTS);
    let normal = |x: f64| math::exp(-0.5 * x * x) / std::f64::consts::TAU.sqrt();
    Some(Panel {
        title: "size".to_owned(),
        x: ChartAxis::linear("residual / noise").with_range(first.0, last.1),
        y: ChartAxis::linear("density"),
        height_mm: HEIGHT_MM,
        series: vec![
            residual_line(RESIDUAL, Colour::Green, Mark::Line, steps.collect()),
            residual_line(
                WHITE,
                Colour::Black,
                Mark::Dashed,
                (0..=POINTS).map(|k| Some((at(k), normal(at(k))))).collect(),
            ),
        ],
        ribbons: vec![Ribbon { label: String::new(), colour: Colour::Green, points: bars.collect() }],
        ..Panel::default()
    })
}

fn draw_correlation(shown: &ResidualDiagnostics) -> Option<Panel> {
    let (first, last) =
        (shown.correlation.first()?.0 * MILLISECONDS, shown.correlation.last()?.0 * MILLISECONDS);
    let points = shown.correlation.iter().map(|(lag, r)| Some((lag * MILLISECONDS, *r)));
    Some(Panel {
        title: "memory".to_owned(),
        x: ChartAxis::linear("lag, ms").with_range(0.0, last.max(first + f64::MIN_POSITIVE)),
        y: ChartAxis::linear("autocorrelation").with_range(-1.0, 1.0),
        height_mm: HEIGHT_MM,
        series: vec![residual_line("", Colour::Green, Mark::Joined(MarkerShape::Disc), points.collect())],
        ribbons: vec![Ribbon {
            label: "95 % of white noise".to_owned(),
            colour: Colour::SkyBlue,
            points: [0.0, last].map(|t| Some((t, -shown.white_95, shown.white_95))).to_vec(),
        }],
        ..Panel::default()
    })
}

fn draw_spectrum(shown: &ResidualDiagnostics) -> Option<Panel> {
    let (first, last) = (shown.spectrum.first()?.0, shown.spectrum.last()?.0);
    Some(Panel {
        title: "frequencies".to_owned(),
        x: ChartAxis::linear("frequency, Hz").with_range(0.0, last),
        y: ChartAxis::log("power / that of the noise"),
        height_mm: HEIGHT_MM,
        series: vec![
            residual_line("", Colour::Green, Mark::Thin, shown.spectrum.iter().copied().map(Some).collect()),
            residual_line(WHITE, Colour::Black, Mark::Dashed, vec![Some((first, 1.0)), Some((last, 1.0))]),
        ],
        ..Panel::default()
    })
}

fn draw_growth(shown: &ResidualDiagnostics) -> Option<Panel> {
    let points: Vec<_> = shown.growth.iter().map(|(s, chi2)| Some((s * MILLISECONDS, *chi2))).collect();
    let ends = shown.growth.first().zip(shown.growth.last())?;
    let ends = [ends.0.0 * MILLISECONDS / 1.2, ends.1.0 * MILLISECONDS * 1.2];
    Some(Panel {
        title: "growth".to_owned(),
        x: ChartAxis::log("length of a segment, ms").with_range(ends[0], ends[1]),
        y: ChartAxis::log("chi2 per degree of freedom"),
        height_mm: HEIGHT_MM,
        series: vec![
            residual_line("segments of the fit", Colour::Blue, Mark::Joined(MarkerShape::Square), points),
            residual_line(WHITE, Colour::Black, Mark::Dashed, ends.map(|x| Some((x, 1.0))).to_vec()),
        ],
        ..Panel::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panel_without_data_is_left_out() {
        let shown = ResidualDiagnostics {
            histogram: vec![(-1.0, 0.0, 0.5), (0.0, 1.0, 0.5)],
            correlation: vec![(2e-4, 0.3), (4e-4, 0.1)],
            white_95: 0.05,
            ..ResidualDiagnostics::default()
        };
        let titles: Vec<String> = draw_figure(&shown).panels.iter().map(|p| p.title.clone()).collect();
        assert_eq!(titles, ["size", "memory"]);
        assert_eq!(draw_figure(&shown).panels[1].series[0].points[0], Some((0.2, 0.3)));
        assert!(draw_figure(&ResidualDiagnostics::default()).panels.is_empty());
    }
}
