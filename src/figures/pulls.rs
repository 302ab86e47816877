//! Pulls: deviation of the model from each target of a fit, in standard deviations of the target.

use crate::compare::TargetComparison;
use crate::figures::{Drawing, FigureBlock, about, full_figure, subtitle};
use crate::text::{format_digits, pluralise, truncate_text};
use plain_charts::{ChartAxis, Colour, Figure, Mark, MarkerShape, Panel, Series, ShadedSpan, VerticalLine};

/// Deviation of the model from one feature.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pull {
    /// Name of the feature.
    pub name: String,
    /// Model minus target, in standard deviations of the target.
    pub deviations: f64,
    /// Whether the feature was held out of the fit, and so is predicted.
    pub held_out: bool,
}

/// Data of the figure.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PullPlot {
    /// Title of the fit.
    pub title: String,
    /// Whether a target was measured on a synthetic recording.
    pub synthetic: bool,
    /// The features in the order of the job.
    pub pulls: Vec<Pull>,
    /// Names of features without a model value, or without a standard deviation of the target.
    pub without: Vec<String>,
}

/// Height of the row of a feature, mm.
const ROW_MM: f64 = 5.0;
/// Minimum height of the axes, mm.
const LEAST_MM: f64 = 14.0;
/// Half width of the interval that contains 95 % of the pulls of a correct model, in standard deviations.
const WITHIN_95: f64 = 1.96;
/// Number of letters after which a name is cut in the heading.
const LETTERS: usize = 16;
/// The axis extends at least to this value, in standard deviations of the target.
const LEAST_END: f64 = 3.0;

impl PullPlot {
    /// The pulls of the compared targets of a report.
    pub(crate) fn from_comparisons(
        title: &str,
        fitted: &[&[TargetComparison]],
        held_out: &[TargetComparison],
    ) -> Self {
        let deviations = |row: &TargetComparison| {
            let sd = row.target_sd.filter(|sd| *sd > 0.0)?;
            Some((row.model? - row.target) / sd).filter(|deviations| deviations.is_finite())
        };
        let fitted = fitted.iter().copied().flatten().map(|row| (row, false));
        let rows: Vec<(&TargetComparison, bool)> =
            fitted.chain(held_out.iter().map(|row| (row, true))).collect();
        let pull = |(row, held_out): &(&TargetComparison, bool)| {
            deviations(row).map(|deviations| Pull { name: row.name.clone(), deviations, held_out: *held_out })
        };
        let without = rows.iter().filter(|(row, _)| deviations(row).is_none());
        Self {
            title: title.to_owned(),
            synthetic: rows.iter().any(|(row, _)| row.synthetic),
            pulls: rows.iter().filter_map(pull).collect(),
            without: without.map(|(row, _)| row.name.clone()).collect(),
        }
    }

    /// The figure with its caption; `None` without a feature.
    pub(crate) fn figure_block(&self) -> Option<FigureBlock> {
        (!self.pulls.is_empty()).then(|| FigureBlock {
            condition: None,
            file: "pulls.svg".to_owned(),
            caption: figure_caption(self),
            details: String::new(),
            drawing: Drawing::Chart(draw_figure(self)),
        })
    }

    fn largest_pull(&self) -> Option<&Pull> {
        self.pulls.iter().max_by(|a, b| a.deviations.abs().total_cmp(&b.deviations.abs()))
    }
}

/// Draws the figure.
#[must_use]
pub fn draw_figure(shown: &PullPlot) -> Figure {
    let count = shown.pulls.len();
    let most = shown.largest_pull().map_or(0.0, |pull| pull.deviations.abs());
    let end = LEAST_END.max(1.1 * most);
    let of = |held_out: bool| {
        let places = shown.pulls.iter().enumerate().filter(move |(_, pull)| pull.held_out == held_out);
        places.map(|(i, pull)| (pull.deviations, (count - 1 - i) as f64))
    };
    let predicted = Mark::Hollow(MarkerShape::Diamond);
    let series = [
        Series::new("fitted", Colour::Blue, Mark::Hollow(MarkerShape::Disc), of(false)),
        Series::new("predicted, not fitted", Colour::Vermilion, predicted, of(true)),
    ];
    let drawn = series.into_iter().filter(|s| !s.points.is_empty());
    let x = ChartAxis::linear("deviations from the target").with_range(-end, end);
    let y = ChartAxis::categorical("", shown.pulls.iter().rev().map(|pull| pull.name.clone()));
    let panel = Panel {
        shaded_spans: vec![ShadedSpan::new("95 % of a right model", Colour::SkyBlue, -WITHIN_95, WITHIN_95)],
        vertical_lines: vec![VerticalLine::new("", Colour::Grey, Mark::Thin, 0.0)],
        ..Panel::new(x, y, LEAST_MM.max(ROW_MM * count as f64), drawn)
    };
    Figure {
        subtitle: about(&shown.title, &subtitle(shown.synthetic, "")),
        ..full_figure(
            &claim_sentence(shown),
            shown.synthetic,
            "",
            "Model minus target of every feature, in deviations of the target.",
            [panel],
        )
    }
}

/// The main result in one sentence, with its number.
fn claim_sentence(shown: &PullPlot) -> String {
    let Some(worst) = shown.largest_pull() else { return "No feature has a deviation".to_owned() };
    let most = format_digits(worst.deviations.abs(), 2);
    let missed = shown.pulls.iter().filter(|pull| pull.deviations.abs() > WITHIN_95).count();
    let all = shown.pulls.len();
    match missed {
        0 => format!("The model meets {all} {} within {most} deviations", pluralise("feature", all)),
        _ => format!(
            "{missed} of {all} {} {} more than 1.96 deviations off, {} by {most}",
            pluralise("feature", all),
            if missed == 1 { "is" } else { "are" },
            truncate_text(&worst.name, LETTERS)
        ),
    }
}

/// Caption: contents of the figure, and its main number.
pub(crate) fn figure_caption(shown: &PullPlot) -> String {
    let without = match shown.without.len() {
        0 => String::new(),
        count => format!("; {count} not drawn, as model or deviation is missing"),
    };
    format!("{}{without}.", claim_sentence(shown))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(name: &str, target: f64, target_sd: Option<f64>, model: Option<f64>) -> TargetComparison {
        TargetComparison { name: name.to_owned(), target, target_sd, model, ..TargetComparison::default() }
    }

    #[test]
    fn a_pull_is_model_minus_target_over_its_deviation() {
        let fitted = [row("low", 78.4, Some(0.4), Some(79.4)), row("high", 900.0, None, Some(900.0))];
        let held_out = [row("release", 0.066, Some(0.001), Some(0.0655))];
        let shown = PullPlot::from_comparisons("t", &[&fitted], &held_out);
        let found: Vec<f64> = shown.pulls.iter().map(|pull| pull.deviations).collect();
        assert!((found[0] - 2.5).abs() < 1e-9 && (found[1] + 0.5).abs() < 1e-9, "{found:?}");
        assert_eq!(shown.without, ["high"]);
        assert_eq!(claim_sentence(&shown), "1 of 2 features is more than 1.96 deviations off, low by 2.5");
        assert!(
            figure_caption(&shown).ends_with("low by 2.5; 1 not drawn, as model or deviation is missing.")
        );
        let drawn = draw_figure(&shown);
        assert_eq!(drawn.panels[0].series[1].points, [Some((shown.pulls[1].deviations, 0.0))]);
    }

    #[test]
    fn without_a_feature_there_is_no_figure() {
        assert!(PullPlot::default().figure_block().is_none());
    }
}
