//! The verdict on a fit, built once and used for the page, the JSON and the terminal.

use super::rich_text::{Sentence, Statement};
use super::{Report, summary};
use crate::compare::{ParameterLine, RunSummary, TargetComparison, TrueValue};
use crate::figures::OPPOSED;
use crate::fit::misfit::far_from_priors;
use crate::fit::uncertainty::ParameterVerdict as Knowledge;
use crate::model::parameters::describe_parameters;
use crate::simulate::RunStatus;
use crate::text::{
    self, capitalise, format_interval, format_number, format_percent, format_signed_percent, format_with_sd,
    make_printable, pluralise,
};
use serde::Serialize;

/// The verdict on a fit.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[allow(clippy::struct_excessive_bools)] // one for each question that a script may have
pub struct ReportVerdict {
    /// Whether the model explains the traces that were fitted. In a fit without traces: whether the estimated
    /// errors of the cameras are compatible with their priors.
    pub model_explains_recording: bool,
    /// Whether the frequency of every component is within its tolerance; true without components.
    pub all_components_met: bool,
    /// Whether the model lies in the 95 % interval of the target of every other feature.
    pub all_features_met: bool,
    /// Whether the model predicts everything that was held out.
    pub all_held_out_met: bool,
    /// Whether the data determine every parameter.
    pub all_parameters_identified: bool,
    /// Whether the search had converged.
    pub search_converged: bool,
    /// Whether the best model's run reached its stop time in every condition.
    pub all_runs_completed: bool,
    /// Whether any recording is synthetic.
    pub synthetic: bool,
    /// Whether there is no recording, and only published numbers were fitted.
    pub published_only: bool,
    /// The verdict in words, most important first.
    #[serde(skip)]
    pub statements: Vec<Statement>,
}

impl ReportVerdict {
    /// The verdict on the contents of a report.
    pub(crate) fn from_report(report: &Report) -> Self {
        let met = |list: &[TargetComparison]| list.iter().all(|c| c.pass);
        Self {
            model_explains_recording: match &report.misfit {
                Some(misfit) => misfit.explained && report.search.has_ended(),
                None => far_from_priors(&report.nuisances).is_empty(),
            },
            all_components_met: met(&report.components),
            all_features_met: met(&report.features),
            all_held_out_met: met(&report.held_out),
            all_parameters_identified: report.parameters.iter().all(ParameterLine::is_identified),
            search_converged: report.search.converged,
            all_runs_completed: report.runs.iter().all(|run| run.status == RunStatus::Completed),
            synthetic: report.is_synthetic(),
            published_only: report.recordings.is_empty(),
            statements: verdict_statements(report),
        }
    }

    /// Whether the model explains the traces and meets every component.
    pub(crate) fn passes(&self) -> bool {
        self.model_explains_recording && self.all_components_met
    }

    /// The statements as lines of text.
    pub(crate) fn summary(&self) -> Vec<String> {
        self.statements.iter().map(Statement::plain_text).collect()
    }
}

fn verdict_statements(report: &Report) -> Vec<Statement> {
    let mut found = Vec::new();
    let how = " within 1.96 standard deviations of the target";
    found.extend(met_statement("component", "", &report.components, |_| true));
    found.extend(met_statement("feature", how, &report.features, |c| !c.pass));
    found.extend(met_statement("value that was held out of the fit", "", &report.held_out, |_| true));
    let all_known = report.parameters.iter().all(ParameterLine::is_identified);
    let certainty = summary::certainty_sentence(report);
    let each = report.parameters.iter().map(parameter_sentence).collect();
    found.push(Statement::with_details(
        certainty,
        each,
        (!report.parameters.is_empty()).then_some(all_known),
    ));
    found.extend(truth_statement(&report.parameters));
    found.extend(report.law.as_ref().map(|_| Statement::new(summary::law_sentence(report))));
    found.extend(report.chatter.as_ref().map(|_| Statement::new(summary::chatter_sentences(report))));
    found.extend(ending_statements(report));
    // bad news comes first, after the headline
    found.sort_by_key(|statement| statement.good != Some(false));
    found.insert(0, summary::report_headline(report));
    if let Some(diagnosis) = diagnosis_statement(report) {
        found.insert(1, diagnosis);
    }
    let next = Sentence::new("Next: ").with_sentence(summary::next_step_sentence(report));
    let more = report
        .advice
        .iter()
        .skip(1)
        .map(|advice| Sentence::new(capitalise(&make_printable(advice))))
        .collect();
    found.push(Statement::with_details(next, more, None));
    found
}

/// Statement with what would explain the traces, if the fit found anything.
fn diagnosis_statement(report: &Report) -> Option<Statement> {
    let added = report.findings.iter().filter(|finding| finding.adds_to_misfit());
    let details: Vec<Sentence> =
        added.map(|finding| Sentence::new(make_printable(&finding.sentence))).collect();
    (!details.is_empty())
        .then(|| Statement::with_details("What may explain the recording", details, Some(false)))
}

/// Singular and plural of the nouns that are counted in statements.
const NOUNS: [[&str; 2]; 3] =
    [["value that was", "values that were"], ["component", "components"], ["feature", "features"]];

/// Statement such as "2 of 2 components are met", with details on the entries for which `listed` is true.
fn met_statement(
    noun: &str,
    how: &str,
    list: &[TargetComparison],
    listed: impl Fn(&&TargetComparison) -> bool,
) -> Option<Statement> {
    let (count, total) = (list.iter().filter(|c| c.pass).count(), list.len());
    let plural = || NOUNS.iter().fold(noun.to_owned(), |noun, [one, many]| noun.replacen(one, many, 1));
    let noun = if total == 1 { noun.to_owned() } else { plural() };
    let verb = if count == 1 { "is" } else { "are" };
    let words = format!("{count} of {total} {noun} {verb} met{how}");
    let details = list.iter().filter(listed).map(comparison_sentence).collect();
    (total > 0).then(|| Statement::with_details(words, details, Some(count == total)))
}

/// Sentence with name, model, target with its standard deviation, error and tolerance.
pub(super) fn comparison_sentence(c: &TargetComparison) -> Sentence {
    let (unit, factor) = text::choose_prefix(&c.unit, [c.target]);
    let unit = if unit.is_empty() { unit } else { format!(" {unit}") };
    let target = format!("{}{unit}", format_with_sd(c.target * factor, c.target_sd.map(|sd| sd * factor)));
    let given = if c.given { " as given in the job" } else { "" };
    let mut named = Sentence::default().with_name(&c.name);
    if let Some(condition) = &c.condition {
        named = named.with_words(" (").with_name(condition).with_words(")");
    }
    let Some(model) = c.model else {
        let why = c.missing.as_ref().map_or_else(String::new, |why| format!(" ({why})"));
        return named.with_words(format!(" does not appear in the model{why}; target {target}{given}"));
    };
    let off = |error| format!(", off by {}", format_signed_percent(error));
    let error = c.relative_error.map_or_else(String::new, off);
    let within = if c.pass { "within" } else { "beyond" };
    let tolerance = match c.tolerance_relative {
        Some(tolerance) => format!(", {within} the tolerance of {}", format_percent(tolerance)),
        None => format!(", {within} the 95 % interval of the target"),
    };
    let model = format_number(model * factor);
    named.with_words(format!(": model {model}{unit}, target {target}{given}{error}{tolerance}"))
}

fn parameter_sentence(p: &ParameterLine) -> Sentence {
    let (unit, factor) = text::choose_prefix(&p.unit, [p.estimate]);
    let unit = if unit.is_empty() { unit } else { format!(" {unit}") };
    let number = |value: f64| format_number(value * factor);
    let why = p.why.as_ref().map_or_else(String::new, |why| format!("; {why}"));
    let range = format_interval(p.lower_95, p.upper_95, number);
    let at = if p.lower_95.is_some() && p.upper_95.is_some() { "from " } else { "" };
    let range = match p.verdict == Knowledge::NotIdentified {
        true if !p.is_bounded() => "no end of a 95 % interval is known".to_owned(),
        true => format!("equally good fits lie {at}{range}"),
        false => format!("95 % interval {range}"),
    };
    let words = format!(" = {}{unit}, {range}{why}", number(p.estimate));
    Sentence::default().with_name(&describe_parameters([p.name.as_str()])).with_words(words)
}

/// Statement on the number of intervals that contain the true values of synthetic data.
fn truth_statement(parameters: &[ParameterLine]) -> Option<Statement> {
    let (known, open): (Vec<_>, Vec<_>) =
        parameters.iter().filter_map(|p| p.truth.map(|truth| (p, truth))).partition(|(p, _)| p.is_bounded());
    if known.is_empty() {
        let all = "No 95 % interval has an end, so none can be compared with the values behind the synthetic \
                   data";
        return (!open.is_empty()).then(|| Statement::new(all));
    }
    let inside = known.iter().filter(|(_, truth)| truth.inside_95).count();
    let without_end = match open.len() {
        0 => String::new(),
        n => format!("; {n} {} no end", if n == 1 { "more has" } else { "more have" }),
    };
    let (all, noun) = (known.len(), pluralise("parameter", known.len()));
    let words = format!(
        "The value behind the synthetic data lies inside the 95 % interval of {inside} of {all} {noun}{without_end}"
    );
    let outside = known.iter().filter(|(_, truth)| !truth.inside_95);
    let detail = |(p, truth): &(&ParameterLine, TrueValue)| {
        let interval = format_interval(p.lower_95, p.upper_95, format_number);
        let words = format!(" is {} in truth, outside {interval}", format_number(truth.value));
        Sentence::default().with_name(&describe_parameters([p.name.as_str()])).with_words(words)
    };
    Some(Statement::with_details(words, outside.map(detail).collect(), Some(inside == all)))
}

/// Statements on how the search and the best run ended.
fn ending_statements(report: &Report) -> Vec<Statement> {
    let search = &report.search;
    let mut found = Vec::new();
    if let Some(status) = search.status {
        let how = if search.converged {
            "The search converged".to_owned()
        } else {
            format!("The search ended before it had converged ({})", status.name())
        };
        let failed: usize = search.failed.iter().map(|f| f.count).sum();
        let failed = if failed == 0 { "none failed".to_owned() } else { format!("{failed} failed") };
        let (made, starts) = (search.evaluations, search.local_searches);
        let [evaluations, iterates] = ["evaluation", "iterate"].map(|noun| pluralise(noun, made));
        let words = match report.misfit {
            None => format!("{how}, after {made} {evaluations} of the model, of which {failed}."),
            Some(_) => format!("{how}, after {made} {iterates} from {starts} starts."),
        };
        found.push(Statement::new(words).with_verdict(search.converged));
    }
    let (completed, early): (Vec<&RunSummary>, Vec<_>) =
        report.runs.iter().partition(|run| run.status == RunStatus::Completed);
    found.extend(completed.into_iter().filter_map(hard_event_statement));
    let about = |before: &str, run: &RunSummary, words: String| {
        Statement::new(Sentence::new(before).with_name(&run.name).with_words(words)).with_verdict(false)
    };
    for run in report.runs.iter().filter(|run| run.opposite_turn) {
        found.push(about("In ", run, format!(": {}{}.", OPPOSED[..1].to_lowercase(), &OPPOSED[1..])));
    }
    for run in early {
        let (at, status) = (format_number(run.stopped_at_s), run.status);
        let words = format!(" ended early, at {at} s as {}: {}.", status.name(), status.meaning());
        found.push(about("The best model's run in ", run, words));
    }
    found
}

/// Statement on how often the tip lost contact or jammed in a run; `None` if it never did.
fn hard_event_statement(run: &RunSummary) -> Option<Statement> {
    let counts = [(run.contact_losses, "leaves the glass"), (run.jams, "jams")];
    let happened = counts.into_iter().filter(|(count, _)| *count > 0);
    let events: Vec<String> =
        happened.map(|(count, what)| format!("{what} {count} {}", pluralise("time", count))).collect();
    let words = format!(" the best model's tip {}.", events.join(" and "));
    (!events.is_empty()).then(|| Statement::new(Sentence::new("In ").with_name(&run.name).with_words(words)))
}

#[cfg(test)]
mod tests {
    use super::super::SearchLine;
    use super::*;
    use crate::fit::misfit::{ChannelMisfit, StageMisfit, TraceMisfit, WorstSegment};
    use crate::fit::result;

    fn comparison(name: &str, model: Option<f64>, pass: bool) -> TargetComparison {
        let relative_error = model.map(|m| m / 100.0 - 1.0);
        let (unit, target_sd) = ("Hz".to_owned(), Some(0.5));
        TargetComparison {
            name: name.to_owned(),
            unit,
            target: 100.0,
            target_sd,
            model,
            relative_error,
            pass,
            tolerance_relative: Some(0.02),
            ..TargetComparison::default()
        }
    }

    fn parameter(name: &str, verdict: Knowledge, upper_95: Option<f64>) -> ParameterLine {
        ParameterLine {
            name: name.to_owned(),
            verdict,
            estimate: 0.5,
            lower_95: Some(0.4),
            upper_95,
            ..ParameterLine::default()
        }
    }

    #[test]
    fn the_verdict_says_what_is_met_with_error_and_tolerance() {
        let report = Report {
            components: vec![
                comparison("low", Some(101.0), true),
                comparison("high", Some(80.0), false),
                comparison("third", None, false),
            ],
            recordings: Vec::new(),
            ..Report::default()
        };
        let verdict = ReportVerdict::from_report(&report);
        let expected = "1 of 3 components is met: low: model 101.0 Hz, target 100.0(5) Hz, off by +1.00 %, \
                        within the tolerance of 2 %; \
            high: model 80.00 Hz, target 100.0(5) Hz, off by \u{2212}20.00 %, beyond the tolerance of 2 %; \
            third does not appear in the model; target 100.0(5) Hz.";
        assert!(verdict.summary().contains(&expected.to_owned()), "{:?}", verdict.summary());
        assert!(
            !verdict.all_components_met
                && verdict.all_features_met
                && verdict.published_only
                && !verdict.synthetic
        );
    }

    #[test]
    fn the_verdict_says_what_is_known_what_is_not_and_whether_the_truth_is_held() {
        let mut wide = parameter("friction.c", Knowledge::OpenAbove, None);
        wide.why = Some("only a lower limit is known".to_owned());
        wide.truth = Some(TrueValue { value: 0.3, inside_95: wide.holds(0.3) });
        let mut known = parameter("friction.a", Knowledge::Identified, Some(0.6));
        known.truth = Some(TrueValue { value: 0.55, inside_95: known.holds(0.55) });
        let advice = vec!["measure the release".to_owned(), "measure another".to_owned()];
        let verdict = ReportVerdict::from_report(&Report {
            components: vec![comparison("low", Some(100.5), true)],
            parameters: vec![known, wide],
            advice,
            ..Report::default()
        });
        let expected = [
            "The model meets its one target from publications or assumptions, which leave 1 of 2 parameters open. \
             No recording was compared.",
            "The data determine 1 of 2 fitted parameters, and not C of the friction law: only a lower limit is \
             known. Masses, dampings and every other constant are taken as exact. A of the friction law = 0.5000, \
             95 % interval 0.4000 to 0.6000; C of the friction law = 0.5000, 95 % interval above 0.4000; only a \
             lower limit is known.",
            "The value behind the synthetic data lies inside the 95 % interval of 1 of 2 parameters: C of the \
             friction law is 0.3000 in truth, outside above 0.4000.",
            "1 of 1 component is met: low: model 100.5 Hz, target 100.0(5) Hz, off by +0.50 %, within the \
             tolerance of 2 %.",
            "Next: Measure the release. Measure another.",
        ];
        assert_eq!(verdict.summary(), expected);
        assert!(!verdict.all_parameters_identified);
    }

    #[test]
    fn a_model_that_does_not_explain_the_recording_fails_first() {
        let stage = StageMisfit {
            segments: 40,
            bad_segments: 3,
            dof: 900,
            chi2_per_dof: 1.0,
            ..StageMisfit::default()
        };
        let channel = ChannelMisfit {
            recording: "film".to_owned(),
            channel: "tip-x".to_owned(),
            frames: 400,
            residual_rms_m: 3e-6,
            noise_m: 2e-6,
            worst: vec![WorstSegment { start_s: 0.25, end_s: 0.266, chi2_per_dof: 9.0 }],
            ..ChannelMisfit::default()
        };
        let report = |stage| Report {
            misfit: Some(TraceMisfit::judge(vec![channel.clone()], vec![stage], &[])),
            components: vec![comparison("low", Some(100.5), true)],
            ..Report::default()
        };
        let wrong = ReportVerdict::from_report(&report(stage.clone()));
        assert!(!wrong.model_explains_recording && wrong.all_components_met && !wrong.passes());
        assert_eq!(
            wrong.summary()[0],
            "The model does not explain the recording: it misses the tip by 3.0 \u{b5}m rms, 1.5 times the noise \
             of 2.0 \u{b5}m. What was fitted need not be the blade\u{2019}s. 3 of 40 segments fit worse than noise \
             ever does."
        );
        assert!(ReportVerdict::from_report(&report(StageMisfit { bad_segments: 0, ..stage })).passes());
    }

    #[test]
    fn an_interval_without_an_end_does_not_hold_the_truth() {
        let open = |value| {
            let line =
                ParameterLine { lower_95: None, ..parameter("friction.a", Knowledge::NotIdentified, None) };
            ParameterLine { truth: Some(TrueValue { value, inside_95: line.holds(value) }), ..line }
        };
        let known = ParameterLine {
            truth: Some(TrueValue { value: 0.5, inside_95: true }),
            ..parameter("friction.c", Knowledge::Identified, Some(0.6))
        };
        let of = |parameters: Vec<ParameterLine>| {
            ReportVerdict::from_report(&Report { parameters, ..Report::default() }).statements
        };
        let alone = of(vec![open(9.0)]);
        let said = alone.iter().find(|s| s.plain_text().contains("behind the synthetic data")).unwrap();
        assert!(
            said.plain_text().starts_with("No 95 % interval has an end") && said.good.is_none(),
            "{said:?}"
        );
        assert!(
            alone.iter().any(|s| s
                .plain_text()
                .contains("A of the friction law = 0.5000, no end of a 95 % interval is known")),
            "{alone:?}"
        );
        let both = of(vec![known, open(9.0)]);
        assert!(
            both.iter().any(|s| s.plain_text().ends_with("interval of 1 of 1 parameter; 1 more has no end")),
            "{both:?}"
        );
    }

    #[test]
    fn a_head_that_turns_the_other_way_is_said_and_is_not_good() {
        let runs = vec![RunSummary { name: "r".to_owned(), opposite_turn: true, ..Default::default() }];
        let statements = ReportVerdict::from_report(&Report { runs, ..Report::default() }).statements;
        let turned = "In r: the recorded head turns the other way than the model's";
        let said = statements.iter().find(|s| s.plain_text().starts_with(turned)).unwrap();
        assert_eq!(said.good, Some(false));
    }

    #[test]
    fn a_tip_that_leaves_the_glass_and_comes_back_is_said_to() {
        let run = |contact_losses, jams| RunSummary {
            name: "r".to_owned(),
            contact_losses,
            jams,
            ..RunSummary::default()
        };
        let said =
            |run| ReportVerdict::from_report(&Report { runs: vec![run], ..Report::default() }).summary();
        assert!(
            said(run(10, 1))
                .contains(&"In r the best model's tip leaves the glass 10 times and jams 1 time.".to_owned()),
            "{:?}",
            said(run(10, 1))
        );
        assert!(!said(run(0, 0)).iter().any(|line| line.contains("the best model's tip")));
    }

    #[test]
    fn where_nothing_is_known_that_is_said_once() {
        let summary = ReportVerdict::from_report(&Report {
            parameters: vec![parameter("friction.c", Knowledge::OpenAbove, None)],
            ..Report::default()
        })
        .summary();
        assert!(!summary.iter().any(|line| line.starts_with("The data determine 0")), "{summary:?}");
        let said = "The data do not determine C of the friction law: other values fit as well.";
        assert!(summary.iter().any(|line| line.starts_with(said)), "{summary:?}");
    }

    #[test]
    fn several_held_out_values_are_met_in_the_plural_and_a_name_breaks_no_line() {
        let held_out = vec![comparison("a", Some(100.0), true), comparison("b", Some(100.0), true)];
        let advice = vec!["measure the damping of `a\nb\u{202e}c`".to_owned()];
        let summary = ReportVerdict::from_report(&Report { held_out, advice, ..Report::default() }).summary();
        let said = "2 of 2 values that were held out of the fit are met";
        assert!(summary.iter().any(|line| line.starts_with(said)), "{summary:?}");
        assert!(summary.iter().all(|line| !line.contains(['\n', '\u{202e}'])), "{summary:?}");
    }

    #[test]
    fn a_search_that_did_not_converge_is_said() {
        let search = SearchLine {
            status: Some(result::FitStatus::BudgetExhausted),
            evaluations: 1,
            ..SearchLine::default()
        };
        let verdict = ReportVerdict::from_report(&Report { search, ..Report::default() });
        // (bad news comes after the headline)
        assert_eq!(
            verdict.summary()[1],
            "The search ended before it had converged (budget-exhausted), after 1 evaluation of the model, \
             of which none failed."
        );
    }
}
