//! Comparison of the residual of a model with white noise: size, autocorrelation, spectrum, and growth with
//! the length of the segments in which the model is run.

use super::{FigureBlock, FigureText};
use crate::compare::ConditionComparison;
use crate::figures::full_figure;
use crate::text::{format_decimals, format_digits};
use plain_charts::{ChartAxis, Colour, Figure, Mark, MarkerShape, Panel, Ribbon, Series};
use portable_math as math;
use short_spectra::Multitaper;

/// Data of the figure.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ResidualDiagnostics {
    /// Heading: the main result with its number.
    pub title: String,
    /// Further text for the line under the heading; empty for none.
    pub note: String,
    /// Whether the recording is synthetic.
    pub synthetic: bool,
    /// Bins of the histogram of residual divided by noise: lower edge, upper edge, and fraction of the frames
    /// per unit of the ratio.
    pub histogram: Vec<(f64, f64, f64)>,
    /// Lags, s, and the autocorrelation of the residual.
    pub correlation: Vec<(f64, f64)>,
    /// Value that the absolute autocorrelation of white noise exceeds at 5 % of the lags on average.
    pub white_95: f64,
    /// Frequencies, Hz, each with the ratio of the power density of the residual to that of the noise.
    pub spectrum: Vec<(f64, f64)>,
    /// Lengths of segments, s, each with chi2 per degree of freedom; empty if no segments were fitted.
    pub growth: Vec<(f64, f64)>,
}

/// Height of a panel, mm.
const HEIGHT_MM: f64 = 40.0;
const MILLISECONDS: f64 = 1e3;
/// Number of intervals into which the drawn density of the noise is divided.
const POINTS: u32 = 60;

/// Draws the figure.
#[must_use]
pub fn draw_figure(shown: &ResidualDiagnostics) -> Figure {
    let panels = [draw_histogram(shown), draw_correlation(shown), draw_spectrum(shown), draw_growth(shown)];
    Figure {
        columns: 2,
        ..full_figure(
            &shown.title,
            shown.synthetic,
            &shown.note,
            "Residual in units of the noise: histogram, autocorrelation and spectrum against white \
                      noise, and chi2 over the length of the segments."
                .to_owned(),
            panels.into_iter().flatten(),
        )
    }
}

const WHITE: &str = "white noise";

fn draw_histogram(shown: &ResidualDiagnostics) -> Option<Panel> {
    let (first, last) = (shown.histogram.first()?, shown.histogram.last()?);
    let steps = shown.histogram.iter().flat_map(|(from, to, share)| [(*from, *share), (*to, *share)]);
    let bars = steps.clone().map(|(x, share)| (x, 0.0, share));
    let at = |k: u32| first.0 + (last.1 - first.0) * f64::from(k) / f64::from(POINTS);
    let normal = |x: f64| math::exp(-0.5 * x * x) / std::f64::consts::TAU.sqrt();
    let white = (0..=POINTS).map(|k| (at(k), normal(at(k))));
    let series = [
        Series::new("residual", Colour::Green, Mark::Line, steps),
        Series::new(WHITE, Colour::Black, Mark::Dashed, white),
    ];
    let x = ChartAxis::linear("residual / noise").with_range(first.0, last.1);
    Some(Panel {
        title: "size".to_owned(),
        ribbons: vec![Ribbon::new("", Colour::Green, bars)],
        ..Panel::new(x, ChartAxis::linear("density"), HEIGHT_MM, series)
    })
}

fn draw_correlation(shown: &ResidualDiagnostics) -> Option<Panel> {
    let lag_ms = |(lag_s, _): &(f64, f64)| lag_s * MILLISECONDS;
    let (first, last) = (lag_ms(shown.correlation.first()?), lag_ms(shown.correlation.last()?));
    let points = shown.correlation.iter().map(|p| (lag_ms(p), p.1));
    let white = [0.0, last].map(|t| (t, -shown.white_95, shown.white_95));
    let x = ChartAxis::linear("lag, ms").with_range(0.0, last.max(first + f64::MIN_POSITIVE));
    let y = ChartAxis::linear("autocorrelation").with_range(-1.0, 1.0);
    let series = Series::new("", Colour::Green, Mark::Joined(MarkerShape::Disc), points);
    Some(Panel {
        title: "memory".to_owned(),
        ribbons: vec![Ribbon::new("95 % of white noise", Colour::SkyBlue, white)],
        ..Panel::new(x, y, HEIGHT_MM, [series])
    })
}

fn draw_spectrum(shown: &ResidualDiagnostics) -> Option<Panel> {
    let (first, last) = (shown.spectrum.first()?.0, shown.spectrum.last()?.0);
    let series = [
        Series::new("", Colour::Green, Mark::Thin, shown.spectrum.iter().copied()),
        Series::new(WHITE, Colour::Black, Mark::Dashed, [(first, 1.0), (last, 1.0)]),
    ];
    let x = ChartAxis::linear("frequency, Hz").with_range(0.0, last);
    let panel = Panel::new(x, ChartAxis::log("power / that of the noise"), HEIGHT_MM, series);
    Some(Panel { title: "frequencies".to_owned(), ..panel })
}

fn draw_growth(shown: &ResidualDiagnostics) -> Option<Panel> {
    let points = shown.growth.iter().map(|(s, chi2)| (s * MILLISECONDS, *chi2));
    let ends = shown.growth.first().zip(shown.growth.last())?;
    let ends = [ends.0.0 * MILLISECONDS / 1.2, ends.1.0 * MILLISECONDS * 1.2];
    let series = [
        Series::new("segments of the fit", Colour::Blue, Mark::Joined(MarkerShape::Square), points),
        Series::new(WHITE, Colour::Black, Mark::Dashed, ends.map(|x| (x, 1.0))),
    ];
    let x = ChartAxis::log("length of a segment, ms").with_range(ends[0], ends[1]);
    let panel = Panel::new(x, ChartAxis::log("chi2 per degree of freedom"), HEIGHT_MM, series);
    Some(Panel { title: "growth".to_owned(), ..panel })
}

// Comparison of the residual of a condition with white noise.

/// Number of bins of the histogram.
const HISTOGRAM_BINS: usize = 40;
/// Minimum half width of the range of the histogram, in standard deviations of the noise.
const MIN_HISTOGRAM_RANGE: f64 = 4.0;
/// Maximum lag of the autocorrelation in frames; [`MAX_LAG_FRACTION`] may limit it further.
const MAX_LAGS: usize = 60;
/// Maximum lag of the autocorrelation, as a fraction of the length of the recording.
const MAX_LAG_FRACTION: f64 = 0.25;
/// Minimum number of frames that a figure needs.
const MIN_FRAMES: usize = 50;
/// Maximum number of points of the spectrum; neighbouring frequencies are averaged.
const MAX_SPECTRUM_POINTS: usize = 300;
/// Number of tapers of the multitaper spectrum.
const TAPERS: usize = 9;
/// Half width of a two-sided 95 % interval, in standard deviations.
const Z_95: f64 = 1.96;
/// A residual counts as white noise if two conditions are met: the ratio of its root mean square to that of
/// the noise is below 1 plus this value, and the absolute correlation of neighbouring frames is below this
/// value.
const WHITE_NOISE_TOLERANCE: f64 = 0.1;

/// The figure of a condition; `None` without a recording, with too few frames, or if recording and model move
/// in opposite directions.
pub(crate) fn figure_block(case: &ConditionComparison) -> Option<FigureBlock> {
    let residual = case.judged_residual()?;
    let (channel, noise_m) = case.judged_channel()?;
    let left: Vec<Option<f64>> = residual.column(channel).iter().map(|x| x.map(|x| x / noise_m)).collect();
    let values: Vec<f64> = left.iter().flatten().copied().collect();
    if values.len() < MIN_FRAMES {
        return None;
    }
    let rate_hz = case.recording()?.grid().frame_rate_hz;
    let rms = (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt();
    let correlation = autocorrelation(&left, rate_hz);
    let neighbours = correlation.first()?.1;
    let run = match case.restarted {
        Some(_) => "the segments of the fit",
        None => "one run of the model",
    };
    let stages = case.result.misfit.iter().flat_map(|misfit| &misfit.stages);
    let growth = stages.map(|stage| (stage.segment_s, stage.chi2_per_dof));
    let shown = ResidualDiagnostics {
        title: claim_sentence(rms, neighbours),
        note: format!("residual of the {} in {run}", channel.label()),
        synthetic: case.is_synthetic(),
        histogram: histogram_bins(&values),
        correlation,
        white_95: Z_95 / (values.len() as f64).sqrt(),
        spectrum: power_density(&left, rate_hz),
        growth: growth.filter(|(_, chi2)| chi2.is_finite()).collect(),
    };
    let white_95 = format_decimals(shown.white_95, 2);
    let caption = format!("{}; that of white noise lies within \u{b1}{white_95}.", shown.title);
    let details = String::new();
    Some(case.figure_block("residuals", FigureText { caption, details }, draw_figure(&shown)))
}

/// The main result in one sentence, with its numbers.
fn claim_sentence(rms: f64, neighbours: f64) -> String {
    let white = rms < 1.0 + WHITE_NOISE_TOLERANCE && neighbours.abs() < WHITE_NOISE_TOLERANCE;
    let is = if white { "like white" } else { "more than" };
    let (size, r) = (format_digits(rms, 2), format_decimals(neighbours, 2));
    format!("The residual is {is} noise: {size} times its size, correlation {r}")
}

/// Histogram of the values over a range symmetric about zero: lower edge, upper edge and density of each bin.
fn histogram_bins(values: &[f64]) -> Vec<(f64, f64, f64)> {
    let end = values.iter().map(|x| x.abs()).filter(|x| x.is_finite()).fold(MIN_HISTOGRAM_RANGE, f64::max);
    let width = 2.0 * end / HISTOGRAM_BINS as f64;
    let mut counts = vec![0usize; HISTOGRAM_BINS];
    for value in values.iter().filter(|x| x.is_finite()) {
        let bin = (((value + end) / width) as usize).min(HISTOGRAM_BINS - 1);
        counts[bin] += 1;
    }
    let bin = |(i, count): (usize, usize)| {
        let from = -end + i as f64 * width;
        (from, from + width, count as f64 / values.len() as f64 / width)
    };
    counts.into_iter().enumerate().map(bin).collect()
}

/// Lags, s, from one frame upwards, each with the autocorrelation of the residual at that lag, computed from
/// the pairs of frames that both have a value.
fn autocorrelation(left: &[Option<f64>], rate_hz: f64) -> Vec<(f64, f64)> {
    let values = || left.iter().flatten();
    let count = values().count().max(1) as f64;
    let mean = values().sum::<f64>() / count;
    let variance = values().map(|x| (x - mean) * (x - mean)).sum::<f64>() / count;
    let longest = MAX_LAGS.min((MAX_LAG_FRACTION * left.len() as f64) as usize);
    let at = |lag: usize| {
        let both = left.iter().zip(left.get(lag..)?);
        let pairs: Vec<f64> = both.filter_map(|(a, b)| Some(((*a)? - mean) * ((*b)? - mean))).collect();
        let r = pairs.iter().sum::<f64>() / pairs.len() as f64 / variance;
        Some((lag as f64 / rate_hz, r)).filter(|(_, r)| r.is_finite())
    };
    (1..=longest).filter_map(at).collect()
}

/// Frequencies, Hz, and the ratio of the power density to that of white noise of unit variance; neighbouring
/// frequencies are averaged if there are too many.
fn power_density(left: &[Option<f64>], rate_hz: f64) -> Vec<(f64, f64)> {
    let Ok(found) = Multitaper::new(left, rate_hz, left.len(), TAPERS) else { return Vec::new() };
    let white = 2.0 / rate_hz;
    let bins = found.frequency_hz.iter().zip(&found.density_m2_per_hz).skip(1);
    let bins: Vec<(f64, f64)> = bins.map(|(f, d)| (*f, d / white)).collect();
    let mean = |group: &[(f64, f64)]| {
        let count = group.len() as f64;
        (group.iter().map(|p| p.0).sum::<f64>() / count, group.iter().map(|p| p.1).sum::<f64>() / count)
    };
    bins.chunks(bins.len().div_ceil(MAX_SPECTRUM_POINTS).max(1)).map(mean).collect()
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

    fn noise(count: usize) -> Vec<Option<f64>> {
        let mut seed = 7_u64;
        let mut draw = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * 12.0_f64.sqrt()
        };
        (0..count).map(|i| Some(draw()).filter(|_| i % 50 != 7)).collect()
    }

    #[test]
    fn white_noise_looks_like_white_noise() {
        let left = noise(6000);
        let values: Vec<f64> = left.iter().flatten().copied().collect();
        let total: f64 =
            histogram_bins(&values).iter().map(|(from, to, density)| (to - from) * density).sum();
        assert!((total - 1.0).abs() < 1e-9, "{total}");
        let inside = |(_, r): &&(f64, f64)| r.abs() < Z_95 / (values.len() as f64).sqrt();
        let found = autocorrelation(&left, 5000.0);
        assert!(found.len() == MAX_LAGS && found.iter().filter(inside).count() >= 53, "{found:?}");
        let powers = power_density(&left, 5000.0);
        let mean = powers.iter().map(|p| p.1).sum::<f64>() / powers.len() as f64;
        assert!((mean - 1.0).abs() < 0.06, "{mean}");
    }

    #[test]
    fn a_swing_is_found_with_its_memory_and_its_frequency() {
        let left: Vec<Option<f64>> = (0..4000).map(|i| Some(3.0 * (0.9 * f64::from(i)).sin())).collect();
        assert!((autocorrelation(&left, 5000.0)[0].1 - 0.9_f64.cos()).abs() < 0.01);
        let top = power_density(&left, 5000.0).into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        assert!((top.0 - 0.9 * 5000.0 / std::f64::consts::TAU).abs() < 20.0 && top.1 > 50.0, "{top:?}");
        assert!(claim_sentence(2.1, 0.6).contains("more than noise: 2.1 times its size, correlation 0.60"));
    }
}
