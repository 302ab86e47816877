//! The number in the title of every figure is the number that the figure shows.

use plain_charts::{Figure, Panel, Series};
use wiperlab::figures::{Drawing, FigureBlock};
use wiperlab::report::Report;

/// Largest allowed relative difference between a number of three digits in a title and the number drawn.
const DIGITS_3: f64 = 6e-3;

/// Maximum number of figures of a report.
pub const MOST_FIGURES: usize = 14;

/// Checks every title of a report that has a number against what is drawn or compared.
pub fn assert_claims(report: &Report) {
    let count = report.all_figures().count();
    assert!(count <= MOST_FIGURES, "{count} figures");
    for block in report.all_figures() {
        let Drawing::Chart(figure) = &block.drawing else { continue };
        let said = numbers(strip_name(&figure.title, report));
        match block.file.as_str() {
            "cycle.svg" => assert_cycle(block, figure, &said),
            "stick-slip.svg" => assert_velocities(figure, &said),
            "spectrogram.svg" => assert_ridges(figure, &said),
            "evidence.svg" | "history.svg" => assert_residual(report, block, figure),
            _ => {}
        }
    }
}

/// The title without the name of its condition.
fn strip_name<'a>(title: &'a str, report: &Report) -> &'a str {
    let named = report.comparison.iter().find_map(|c| title.strip_prefix(&format!("{}: ", c.condition)));
    named.unwrap_or(title)
}

/// The decimal numbers of a text, in order.
fn numbers(text: &str) -> Vec<f64> {
    let is_part = |c: char| c.is_ascii_digit() || c == '.';
    text.split(|c: char| !is_part(c)).filter_map(|word| word.trim_matches('.').parse().ok()).collect()
}

fn is_near(said: f64, drawn: f64) -> bool {
    (said / drawn - 1.0).abs() < DIGITS_3
}

/// Least and greatest value of some points along one axis.
fn range<'a>(series: impl Iterator<Item = &'a Series>, value: fn((f64, f64)) -> f64) -> Option<(f64, f64)> {
    let all: Vec<f64> = series.flat_map(|s| s.points.iter().flatten().map(|p| value(*p))).collect();
    all.iter().copied().reduce(f64::min).zip(all.iter().copied().reduce(f64::max))
}

/// The title has the range of the frequencies that are drawn.
fn assert_cycle(block: &FigureBlock, figure: &Figure, said: &[f64]) {
    let panel = &figure.panels[0];
    let of = |what: &str| panel.series.iter().filter(|s| s.label.contains(what)).collect::<Vec<_>>();
    let drawn = if of("measured").is_empty() { of("model") } else { of("measured") };
    let (low, high) = range(drawn.iter().copied(), |p| p.1).unwrap();
    let mut claimed = said[..2].to_vec();
    claimed.sort_by(f64::total_cmp);
    assert!(is_near(claimed[0], low) && is_near(claimed[1], high), "{}: {low} {high}", block.caption);
}

/// The title has the range of the model's velocity in one of the parts.
fn assert_velocities(figure: &Figure, said: &[f64]) {
    let is_velocity =
        |panel: &&Panel| panel.y.label == "tip velocity, mm/s" && panel.x.label.contains("time");
    let velocities: Vec<&Panel> = figure.panels.iter().filter(is_velocity).take(figure.columns).collect();
    let shown = |panel: &&&Panel| {
        let (low, high) = range(panel.series.iter().filter(|s| s.label == "model"), |p| p.1).unwrap();
        is_near(said[0], high - low) || is_near(1e3 * said[0], high - low)
    };
    assert!(velocities.iter().any(|panel| shown(&panel)), "{}", figure.title);
}

/// The title has the ranges of the ridges of recording and model.
fn assert_ridges(figure: &Figure, said: &[f64]) {
    let ridge = |panel: &&Panel| range(panel.series.iter().filter(|s| s.label == "ridge"), |p| p.1);
    let drawn: Vec<(f64, f64)> = figure.panels.iter().filter_map(|panel| ridge(&panel)).collect();
    for pair in said.chunks_exact(2) {
        let shown = |(low, high): &(f64, f64)| is_near(pair[0], *low) && is_near(pair[1], *high);
        assert!(drawn.iter().any(shown), "{}: {drawn:?}", figure.title);
    }
}

/// The ratio of residual to noise in title and panels is that of the comparison.
fn assert_residual(report: &Report, block: &FigureBlock, figure: &Figure) {
    let Some((_, rest)) = figure.title.split_once(" times the noise").map(|(a, b)| (b, a)) else { return };
    let ratio = *numbers(rest).last().unwrap();
    let lines = report.comparison.iter().flat_map(|c| c.residuals.iter().chain(&c.restarted));
    let found =
        lines.filter_map(|line| line.rms_over_noise).any(|compared| (ratio / compared - 1.0).abs() < 0.06);
    assert!(found, "{}: {}", block.file, figure.title);
}
