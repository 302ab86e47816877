//! Result of a map in words: its range, and the parameters with which it rises or falls.

use super::parameter_words;
use crate::feature::FeatureUnit;
use crate::sweep::rank_correlation::spearman_correlation;
use crate::sweep::{PointOutcome, Study, SweepAxis, SweepMap};
use crate::text::{capitalise, format_decimals, format_trimmed};
use portable_math as math;

/// A trend is clear if the absolute value of its rank correlation is at least this.
const CLEAR: f64 = 0.5;
/// Trends are stated only if at least this fraction of the points has a value.
const MOSTLY_KNOWN: f64 = 0.5;
/// Number of significant digits with which the larger end (by absolute value) of a range is written.
const DIGITS: i32 = 3;
/// Powers of ten of the larger end (by absolute value) of a range for which both ends are written with the
/// same number of decimals.
const PLAIN: std::ops::RangeInclusive<i32> = -3..=4;

/// Range and trends of a map.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::figures) struct MapClaim {
    /// The quantity, such as "High component".
    pub name: String,
    /// Its range, such as "222 to 637 Hz".
    range: String,
    /// All clear trends, such as "falls with preload force", in words and by symbols; empty if no trend is
    /// clear.
    trend: String,
    short_trend: String,
    /// The strongest trend only, by its symbol.
    strongest: String,
}

impl MapClaim {
    pub(crate) fn new(study: &Study, map: &SweepMap, values: &[Option<f64>]) -> Self {
        let trends = clear_trends(study, values);
        let said = |trends: &[(f64, &SweepAxis)], name: &dyn Fn(&SweepAxis) -> String| {
            let one = |(r, axis): &(f64, &SweepAxis)| {
                format!("{} with {}", if *r > 0.0 { "rises" } else { "falls" }, name(axis))
            };
            trends.iter().map(one).collect::<Vec<_>>().join(", ")
        };
        let symbol = |axis: &SweepAxis| axis.parameter.symbol.to_owned();
        Self {
            name: capitalise(&map.name),
            range: value_range(map, values),
            trend: said(&trends, &parameter_words),
            short_trend: said(&trends, &symbol),
            strongest: said(trends.get(..1).unwrap_or_default(), &symbol),
        }
    }

    /// Name, range and trend in one line.
    pub(crate) fn title(&self) -> String {
        format!("{}: {}", self.name, join_trend(&self.range, &self.trend))
    }

    /// Range and trends in at most `letters` letters. The first version that fits is returned: all trends in
    /// words, all trends by symbols, only the strongest trend, or no trend.
    pub(crate) fn fit_in_letters(&self, letters: usize) -> String {
        let ways =
            [&self.trend, &self.short_trend, &self.strongest].map(|trend| join_trend(&self.range, trend));
        let fits = ways.iter().find(|way| way.chars().count() <= letters);
        fits.unwrap_or(&self.range).clone()
    }
}

fn join_trend(range: &str, trend: &str) -> String {
    if trend.is_empty() { range.to_owned() } else { format!("{range}, {trend}") }
}

/// Values at every point of the map with index `at`, in the unit of the figure; `None` at a point without a
/// value.
pub(in crate::figures) fn map_values(
    study: &Study,
    outcomes: &[PointOutcome],
    at: usize,
) -> Vec<Option<f64>> {
    let factor = study.maps.get(at).map_or(1.0, |map| map.reading.unit().factor);
    let value = |outcome: &PointOutcome| Some(outcome.values.get(at)?.ok()? * factor);
    outcomes.iter().map(value).collect()
}

fn value_range(map: &SweepMap, values: &[Option<f64>]) -> String {
    let finite = || values.iter().flatten().copied().filter(|value| value.is_finite());
    let Some((low, high)) = finite().reduce(f64::min).zip(finite().reduce(f64::max)) else {
        return "no value".to_owned();
    };
    let largest = low.abs().max(high.abs());
    let power = if largest > 0.0 { math::log10(largest).floor() as i32 } else { 0 };
    let written = |value| match usize::try_from(DIGITS - 1 - power) {
        _ if value == 0.0 => "0".to_owned(),
        _ if !PLAIN.contains(&power) => format_trimmed(value, DIGITS as usize),
        Ok(places) => format_decimals(value, places),
        Err(_) => format_decimals(value, 0),
    };
    let FeatureUnit { shown, .. } = map.reading.unit();
    let unit = if shown.is_empty() { String::new() } else { format!(" {shown}") };
    let [low, high] = [low, high].map(written);
    if low == high { format!("{low}{unit}") } else { format!("{low} to {high}{unit}") }
}

/// The clear trends, the strongest first.
fn clear_trends<'a>(study: &'a Study, values: &[Option<f64>]) -> Vec<(f64, &'a SweepAxis)> {
    let known: Vec<(usize, f64)> =
        values.iter().enumerate().filter_map(|(index, value)| Some((index, (*value)?))).collect();
    if (known.len() as f64) < MOSTLY_KNOWN * values.len() as f64 {
        return Vec::new();
    }
    let y: Vec<f64> = known.iter().map(|(_, value)| *value).collect();
    let places: Vec<Vec<f64>> = known.iter().map(|(index, _)| study.point_values(*index)).collect();
    let of = |(at, axis)| {
        let x: Option<Vec<f64>> = places.iter().map(|place| place.get(at).copied()).collect();
        Some((spearman_correlation(&x?, &y)?, axis))
    };
    let mut clear: Vec<_> = study.axes.iter().enumerate().filter_map(of).collect();
    clear.retain(|(r, _)| r.abs() >= CLEAR);
    math::sort_by_number(&mut clear, |a| -a.0.abs());
    clear
}

#[cfg(test)]
mod tests {
    use super::*;

    fn study() -> Study {
        let axes = "[[axis]]\nname = \"drive.amplitude_m\"\nfrom = 0.01\nto = 0.06\npoints = 6\n\
                    [[axis]]\nname = \"blade.preload_force_n\"\nfrom = 0.1\nto = 0.6\npoints = 6\n";
        let maps = "[[map]]\nname = \"flip\"\nkind = \"flip-duration\"\n";
        let text = format!(
            "format = 1\ntitle = \"t\"\nscene = \"s\"\n[camera]\nframe_rate_hz = 1e4\nexposure_s = 0.0\n{axes}{maps}"
        );
        Study::parse("study", &text).unwrap()
    }

    fn claim(value: impl Fn(f64, f64) -> Option<f64>) -> MapClaim {
        let study = study();
        let values: Vec<Option<f64>> = (0..36)
            .map(|index| (f64::from(index / 6), f64::from(index % 6)))
            .map(|(x, y)| value(x, y))
            .collect();
        MapClaim::new(&study, &study.maps[0], &values)
    }

    #[test]
    fn a_title_says_from_where_to_where_and_with_what() {
        let falls = claim(|x, y| Some(80.0 - 5.0 * y - 0.1 * x));
        assert_eq!(falls.title(), "Flip: 54.5 to 80.0 ms, falls with preload force");
        assert_eq!(falls.fit_in_letters(34), "54.5 to 80.0 ms, falls with k0 hd");
        let both = claim(|x, y| Some(y - x));
        assert_eq!(both.fit_in_letters(60), "\u{2212}5.00 to 5.00 ms, falls with a, rises with k0 hd");
        assert_eq!(claim(|x, y| Some((x - 2.5).abs() + (y - 2.5).abs())).title(), "Flip: 1.00 to 5.00 ms");
    }

    #[test]
    fn nothing_is_said_of_the_trend_of_few_values() {
        assert_eq!(claim(|x, y| Some(y).filter(|_| x < 2.0)).title(), "Flip: 0 to 5.00 ms");
        assert_eq!(claim(|_, _| None).title(), "Flip: no value");
        assert_eq!(claim(|_, _| Some(0.0)).title(), "Flip: 0 ms");
        assert_eq!(
            claim(|_, y| Some(2e-7 * (y + 1.0))).title(),
            "Flip: 2.00\u{b7}10\u{207b}\u{2077} to 1.20\u{b7}10\u{207b}\u{2076} ms, rises with preload force"
        );
    }
}
