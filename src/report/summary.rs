//! The answer at the top of a report: whether the model explains the recording, the numbers of the blade,
//! their certainty, and what to do next.

use super::Report;
use super::rich_text::{Sentence, Statement};
use super::verdict::comparison_sentence;
use crate::compare::summary::{ResidualSummary, describe_drift};
use crate::compare::{ComparisonSummary, ParameterLine, TargetComparison};
use crate::figures::evidence::NOTHING_LEFT;
use crate::figures::friction::FrictionLine;
use crate::fit::misfit::{TraceMisfit, WorstSegment, far_from_priors, unexplained_headline};
use crate::fit::result::describe_met_targets;
use crate::model::parameters::{self, describe_parameters};
use crate::text::{
    capitalise, format_decimals, format_digits, format_length, format_speed, make_printable, pluralise,
};
use serde::Serialize;

/// Ratio of the residual of a run to the noise above which the run deviates visibly from the recording.
const SEEN: f64 = 3.0;
/// Drift of a run, in cycles, above which it is mentioned.
const SEEN_DRIFT: f64 = 0.01;
/// The deviation of the model from a met target is mentioned if it exceeds this number of standard deviations
/// of the target.
const FAR_SD: f64 = 1.96;

/// The answer of a report.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct ReportSummary {
    /// Whether the model explains the measurements, with residual and noise.
    pub headline: Statement,
    /// The numbers of the blade: friction at rest and at speed, then all other parameters.
    pub quantities: Vec<SummaryQuantity>,
    /// Certainty of these numbers.
    pub certainty: Sentence,
    /// Which law of friction the traces support; empty if it is not known.
    pub law: Sentence,
    /// Where and why the blade chatters; empty if it is not known.
    pub chatter: Sentence,
    /// Recommended next step.
    pub next: Sentence,
}

/// A number of the blade, in SI units.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct SummaryQuantity {
    /// Meaning of the number.
    pub name: String,
    /// Keys of the scene on which the number depends.
    pub keys: Vec<&'static str>,
    /// Unit; empty for a plain number.
    pub unit: String,
    pub value: f64,
    /// Lower end of the 95 % interval; `None` if it is open.
    pub lower_95: Option<f64>,
    /// Upper end of the 95 % interval; `None` if it is open.
    pub upper_95: Option<f64>,
    /// Whether the data determine the number.
    pub identified: bool,
    /// Whether a parameter on which the number depends was fitted.
    pub fitted: bool,
}

impl ReportSummary {
    /// The answer of a report.
    pub(crate) fn from_report(report: &Report) -> Self {
        Self {
            headline: report_headline(report),
            quantities: blade_quantities(report),
            certainty: certainty_sentence(report),
            law: law_sentence(report),
            chatter: chatter_sentences(report),
            next: next_step_sentence(report),
        }
    }
}

/// Whether a parameter is a coefficient of the friction law. Instead of these, the summary states the
/// friction at rest and at speed.
fn is_friction_coefficient(name: &str) -> bool {
    name.starts_with("friction.")
}

fn blade_quantities(report: &Report) -> Vec<SummaryQuantity> {
    let of_law: Vec<&ParameterLine> =
        report.parameters.iter().filter(|p| is_friction_coefficient(&p.name)).collect();
    let keys: Vec<&'static str> =
        of_law.iter().filter_map(|p| parameters::find_parameter(&p.name)).map(|p| p.name).collect();
    let friction = |line: &FrictionLine| SummaryQuantity {
        name: if line.speed_m_per_s > 0.0 {
            format!("friction coefficient at {}, the tip's greatest speed", format_speed(line.speed_m_per_s))
        } else {
            "friction coefficient at rest".to_owned()
        },
        keys: keys.clone(),
        unit: String::new(),
        value: line.coefficient,
        lower_95: line.half_95.map(|half| line.coefficient - half),
        upper_95: line.half_95.map(|half| line.coefficient + half),
        identified: line.half_95.is_some() && of_law.iter().all(|p| p.is_identified()),
        fitted: !of_law.is_empty(),
    };
    let parameter = |p: &ParameterLine| {
        let row = parameters::find_parameter(&p.name)?;
        Some(SummaryQuantity {
            name: describe_parameters([row.name]),
            keys: vec![row.name],
            unit: p.unit.clone(),
            value: p.estimate,
            lower_95: p.lower_95,
            upper_95: p.upper_95,
            identified: p.is_identified(),
            fitted: true,
        })
    };
    let others = report.parameters.iter().filter(|p| !is_friction_coefficient(&p.name)).filter_map(parameter);
    report.friction.iter().map(friction).chain(others).collect()
}

/// Whether the model explains the measurements, with the reasons.
pub(in crate::report) fn report_headline(report: &Report) -> Statement {
    let far = far_from_priors(&report.nuisances);
    match (&report.misfit, report.recordings.is_empty()) {
        (Some(misfit), _) => trace_headline(report, misfit),
        (None, _) if !far.is_empty() => {
            let details = missed_target_sentences(report);
            Statement::with_details(format!("{}.", unexplained_headline(&far)), details, Some(false))
        }
        (None, false) => feature_headline(report),
        (None, true) => published_headline(report),
    }
}

fn trace_headline(report: &Report, misfit: &TraceMisfit) -> Statement {
    let ended = report.search.has_ended();
    let (words, reasons) = misfit.describe_verdict(ended);
    if !ended {
        return Statement::new(format!("{words}."));
    }
    let doubt = if misfit.explained { "" } else { " What was fitted need not be the blade\u{2019}s." };
    let why = reasons.iter().map(|reason| Sentence::new(format!("{}.", capitalise(reason))));
    let details = why.chain(missed_target_sentences(report)).chain(single_run_sentence(report)).collect();
    Statement::with_details(format!("{words}.{doubt}"), details, Some(misfit.explained))
}

/// Sentence on the residual of a single run of the model over the whole recording; the fit itself uses
/// shorter segments.
fn single_run_sentence(report: &Report) -> Option<Sentence> {
    let (condition, r) = farthest_residual(report)?;
    let ratio = r.rms_over_noise.filter(|ratio| *ratio > NOTHING_LEFT)?;
    let of = if report.comparison.len() > 1 {
        Sentence::new("In ").with_name(condition).with_words(", run")
    } else {
        Sentence::new("Run")
    };
    let drift = report.comparison.iter().find(|line| line.condition == condition);
    let drift = drift.and_then(|line| line.drift_cycles).filter(|cycles| cycles.abs() > SEEN_DRIFT);
    let why = drift.map_or_else(|| ".".to_owned(), |cycles| format!(", {}.", describe_drift(cycles)));
    let (rms, channel, ratio) = (format_length(r.rms_m), r.channel, format_digits(ratio, 2));
    Some(of.with_words(format!(
        " once from its start, the model lies {rms} rms off the {channel}, {ratio} times the noise{why}"
    )))
}

/// Index of the condition with the largest ratio of residual to noise in a single run of the model, and that
/// residual.
pub(in crate::report) fn farthest_condition(
    conditions: &[ComparisonSummary],
) -> Option<(usize, &ResidualSummary)> {
    let ratio = |line: &ResidualSummary| line.rms_over_noise.unwrap_or(0.0);
    let left =
        conditions.iter().enumerate().filter_map(|(i, condition)| Some((i, condition.judged_residual()?)));
    left.max_by(|(i, a), (j, b)| ratio(a).total_cmp(&ratio(b)).then(j.cmp(i)))
}

/// Name of the condition of [`farthest_condition`], with its residual.
fn farthest_residual(report: &Report) -> Option<(&str, &ResidualSummary)> {
    let (condition, line) = farthest_condition(&report.comparison)?;
    Some((report.comparison.get(condition)?.condition.as_str(), line))
}

/// All targets that were fitted.
fn fitted_targets(report: &Report) -> impl Iterator<Item = &TargetComparison> {
    report.components.iter().chain(&report.features)
}

/// Whether all targets are met, and the sentence on their number.
fn count_met_targets(report: &Report) -> (bool, String) {
    let met = || fitted_targets(report).map(|c| c.pass);
    (met().all(|met| met), describe_met_targets(met()))
}

/// Sentences on the missed targets. After them come sentences on met targets from which the model deviates by
/// more than [`FAR_SD`] standard deviations.
fn missed_target_sentences(report: &Report) -> Vec<Sentence> {
    let apart = |c: &TargetComparison| c.model.zip(c.target_sd).map(|(m, sd)| (m - c.target).abs() / sd);
    let far = |c: &&TargetComparison| c.pass && apart(c).is_some_and(|sds| sds > FAR_SD);
    let missed = fitted_targets(report).filter(|c| !c.pass).map(comparison_sentence);
    let met = fitted_targets(report).filter(far).map(|c| {
        let sds = format_digits(apart(c).unwrap_or(0.0), 2);
        comparison_sentence(c).with_words(format!(", yet {sds} standard deviations off"))
    });
    missed.chain(met).collect()
}

fn feature_headline(report: &Report) -> Statement {
    let (all_met, met) = count_met_targets(report);
    let (followed, good) = match farthest_residual(report) {
        Some((_, r)) => {
            let (channel, ratio) = (r.channel, r.rms_over_noise.unwrap_or(f64::INFINITY));
            let rms = format_length(r.rms_m);
            let (joint, times) =
                (if ratio > SEEN && all_met { ", but" } else { ";" }, format_digits(ratio, 2));
            if ratio <= NOTHING_LEFT {
                (format!("; one run of it follows the {channel} to within its noise"), Some(all_met))
            } else {
                let words = format!(
                    "{joint} one run of it misses the {channel} by {rms} rms, {times} times its noise"
                );
                (words, (ratio > SEEN || !all_met).then_some(false))
            }
        }
        None => (String::new(), Some(all_met)),
    };
    let words = format!("{met}{followed}.");
    Statement::with_details(words, missed_target_sentences(report), good)
}

fn published_headline(report: &Report) -> Statement {
    let (all_met, met) = count_met_targets(report);
    let open = report.parameters.iter().filter(|p| !p.is_identified()).count();
    let all = report.parameters.len();
    let (open, good) = match (all_met, open) {
        (true, 0) => (String::new(), Some(true)),
        (true, open) => (format!(", which leave {open} of {all} {} open", pluralise("parameter", all)), None),
        (false, _) => (String::new(), Some(false)),
    };
    let words = format!("{met} from publications or assumptions{open}. No recording was compared.");
    Statement::with_details(words, missed_target_sentences(report), good)
}

pub(in crate::report) fn certainty_sentence(report: &Report) -> Sentence {
    let all = report.parameters.len();
    let (known, open): (Vec<_>, Vec<_>) = report.parameters.iter().partition(|p| p.is_identified());
    let open_names = describe_parameters(open.iter().map(|p| p.name.as_str()));
    if all == 0 {
        return Sentence::new("No parameter was fitted.");
    }
    if !report.search.has_ended() {
        return Sentence::new("No parameter counts as determined before the search has ended.");
    }
    if report.misfit.as_ref().is_some_and(|misfit| !misfit.explained) {
        return Sentence::new(
            "No parameter counts as determined, as a model that does not explain the recording has narrow \
             intervals too.",
        );
    }
    let why = shared_reason(&open).unwrap_or("other values fit as well");
    let known_words = match (known.len(), all) {
        (1, 1) => "The data determine the one parameter that was fitted.".to_owned(),
        (n, all) if n == all => format!("The data determine all {all} fitted parameters."),
        (0, 1) => format!("The data do not determine {open_names}: {why}."),
        (0, all) => format!("The data determine none of the {all} fitted parameters alone: {why}."),
        (n, all) => {
            format!("The data determine {n} of {all} fitted parameters, and not {open_names}: {why}.")
        }
    };
    let constants = if report.nuisances.iter().any(|n| n.recording.is_none()) {
        " Constants that were not set free are taken as exact."
    } else {
        " Masses, dampings and every other constant are taken as exact."
    };
    Sentence::new(known_words + constants)
}

/// Which law of friction the traces support; empty if it is not known.
pub(in crate::report) fn law_sentence(report: &Report) -> Sentence {
    Sentence::new(report.law.as_ref().map_or_else(String::new, |law| make_printable(&law.sentence)))
}

/// Where and why the blade chatters; empty if it is not known.
pub(in crate::report) fn chatter_sentences(report: &Report) -> Sentence {
    Sentence::new(
        report.chatter.as_ref().map_or_else(String::new, |found| make_printable(&found.sentences.join(" "))),
    )
}

/// The reason why parameters are not identified, if it is the same for all.
fn shared_reason<'a>(open: &[&'a ParameterLine]) -> Option<&'a str> {
    let (first, rest) = open.split_first()?;
    let why = first.why.as_deref()?;
    rest.iter().all(|p| p.why.as_deref() == Some(why)).then_some(why)
}

/// Sentence on the most urgent next step.
pub(in crate::report) fn next_step_sentence(report: &Report) -> Sentence {
    let all_known = report.parameters.iter().all(ParameterLine::is_identified);
    if let Some(run) = report.runs.iter().find(|run| run.opposite_turn) {
        return Sentence::new("Start the scene of ")
            .with_name(&run.name)
            .with_words(" half a period of its drive later: the recorded head turns the other way.");
    }
    if !report.search.converged && report.search.status.is_some() {
        return Sentence::new(
            "Give the search a larger budget and fit again: it ended before it had converged.",
        );
    }
    if let Some(p) = report.parameters.iter().find(|p| is_at_bound(p)) {
        return Sentence::new("Widen the bounds of ")
            .with_name(&describe_parameters([p.name.as_str()]))
            .with_words(" in the job: its best value lies at one.");
    }
    if let Some(misfit) = report.misfit.as_ref().filter(|misfit| !misfit.explained) {
        return describe_unexplained(report, misfit);
    }
    if !all_known {
        return match report.advice.first() {
            Some(advice) => Sentence::new(format!("{}.", capitalise(advice).trim_end_matches('.'))),
            None => measure_alone_sentence(report),
        };
    }
    if farthest_residual(report).is_some_and(|(_, r)| r.rms_over_noise.is_some_and(|ratio| ratio > SEEN))
        && report.misfit.is_none()
    {
        return Sentence::new("Fit the traces themselves, which hold what the features leave out.");
    }
    if fitted_targets(report).any(|c| !c.pass) || report.held_out.iter().any(|c| !c.pass) {
        return Sentence::new("Look at the targets that are missed, in the table below.");
    }
    if report.recordings.is_empty() {
        return Sentence::new("Film the blade and fit the recording: published numbers alone prove little.");
    }
    Sentence::new("Test the model on a recording that was not fitted, at another speed or preload.")
}

/// Sentence on how to measure one parameter by itself: of the parameters that the data do not determine, the
/// one whose interval is widest in relation to its estimate.
fn measure_alone_sentence(report: &Report) -> Sentence {
    let width = |p: &&ParameterLine| match (p.lower_95, p.upper_95) {
        (Some(lower), Some(upper)) => (upper - lower) / p.estimate.abs(),
        _ => f64::INFINITY,
    };
    let open = report.parameters.iter().filter(|p| !p.is_identified());
    let widest = open.rev().max_by(|a, b| width(a).total_cmp(&width(b)));
    match widest.and_then(|p| parameters::find_parameter(&p.name)) {
        Some(row) => {
            let (what, how) = (describe_parameters([row.name]), row.quantity.measurement_method());
            Sentence::new(format!("Measure {what} by itself: {how}."))
        }
        None => {
            Sentence::new("Film the blade at another speed or preload, and fit both recordings together.")
        }
    }
}

/// An estimate counts as being at a bound if its distance from the bound is below this fraction of the range
/// between the bounds.
const AT_BOUND: f64 = 1e-3;

/// Whether the estimate of a parameter is at a bound; a better value may then exist beyond the bound.
fn is_at_bound(p: &ParameterLine) -> bool {
    let [lower, upper] = p.bounds;
    let near = AT_BOUND * (upper - lower);
    upper > lower && (p.estimate - lower < near || upper - p.estimate < near)
}

fn describe_unexplained(report: &Report, misfit: &TraceMisfit) -> Sentence {
    if let [far, ..] = far_from_priors(&report.nuisances).as_slice() {
        return Sentence::new(format!("Check the calibration or the constant first: {far}."));
    }
    let worst = misfit.channels.iter().flat_map(|c| c.worst.iter().map(move |w| (c, w)));
    let worst = worst.max_by(|(_, a): &(_, &WorstSegment), (_, b)| a.chi2_per_dof.total_cmp(&b.chi2_per_dof));
    match worst.filter(|_| misfit.stages.last().is_some_and(|stage| stage.bad_segments > 0)) {
        Some((c, w)) => {
            let [from, to] = [w.start_s, w.end_s].map(|s| format_decimals(s, 4));
            let why = "a point that the tracker lost, or a motion that the model does not have?";
            Sentence::new(format!("Look at {from} to {to} s of "))
                .with_name(&c.recording)
                .with_words(format!(", where it fits worst: {why}"))
        }
        None => Sentence::new(
            "Check what the fit holds fixed \u{2013} masses, dampings, preload, the drive \u{2013} or set it \
             free within what is known of it, and fit again.",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::misfit::{ChannelMisfit, StageMisfit};
    use crate::fit::result::FitStatus;
    use crate::fit::uncertainty::ParameterVerdict as Knowledge;
    use crate::report::{RunSummary, SearchLine};

    fn target(model: f64, sd: f64, pass: bool) -> TargetComparison {
        TargetComparison {
            name: "low".to_owned(),
            unit: "Hz".to_owned(),
            target: 100.0,
            target_sd: Some(sd),
            model: Some(model),
            pass,
            tolerance_relative: Some(0.02),
            ..TargetComparison::default()
        }
    }

    fn left_of(ratio: f64) -> ComparisonSummary {
        let line = |channel, rms_over_noise: Option<f64>| ResidualSummary {
            channel,
            rms_m: 2e-6 * rms_over_noise.unwrap_or(9.0),
            noise_m: Some(2e-6),
            rms_over_noise,
        };
        ComparisonSummary {
            residuals: vec![line("tip-x", None), line("head-x", Some(99.0)), line("deflection", Some(ratio))],
            judged: Some("deflection"),
            ..ComparisonSummary::default()
        }
    }

    fn line(name: &str, verdict: Knowledge) -> ParameterLine {
        let (lower_95, upper_95) = (Some(0.4), Some(0.6));
        ParameterLine {
            name: name.to_owned(),
            estimate: 0.5,
            lower_95,
            upper_95,
            verdict,
            ..ParameterLine::default()
        }
    }

    fn filmed(ratio: f64, targets: Vec<TargetComparison>) -> Report {
        Report {
            recordings: vec![crate::report::page::tests::recording("film", false)],
            comparison: vec![left_of(ratio)],
            components: targets,
            ..Report::default()
        }
    }

    #[test]
    fn met_targets_beside_a_run_that_is_far_off_are_no_good_answer() {
        let near = report_headline(&filmed(1.02, vec![target(100.1, 1.0, true)]));
        assert_eq!(near.good, Some(true));
        assert!(
            near.plain_text().contains("follows the deflection to within its noise"),
            "{}",
            near.plain_text()
        );
        let far = report_headline(&filmed(51.0, vec![target(100.1, 1.0, true)]));
        assert_eq!(far.good, Some(false));
        assert_eq!(
            far.plain_text(),
            "The model meets its one target, but one run of it misses the deflection by 102 \u{b5}m rms, 51 times \
             its noise."
        );
        assert!(
            next_step_sentence(&filmed(51.0, vec![target(100.1, 1.0, true)]))
                .plain_text()
                .starts_with("Fit the traces")
        );
    }

    #[test]
    fn a_target_that_is_met_and_yet_far_for_its_deviation_is_said() {
        let said = report_headline(&filmed(1.0, vec![target(101.2, 0.5, true), target(100.1, 0.5, true)]));
        assert_eq!(said.details.len(), 1);
        assert!(said.plain_text().contains("yet 2.4 standard deviations off"), "{}", said.plain_text());
    }

    #[test]
    fn a_trace_that_is_not_explained_comes_with_its_reasons_and_a_place_to_look() {
        let channel = |name: &str, residual_rms_m| ChannelMisfit {
            recording: "film".to_owned(),
            channel: name.to_owned(),
            frames: 400,
            residual_rms_m,
            noise_m: 2e-6,
            worst: vec![WorstSegment { start_s: 0.25, end_s: 0.266, chi2_per_dof: 9.0 }],
            ..ChannelMisfit::default()
        };
        let stage = StageMisfit {
            segments: 40,
            bad_segments: 3,
            dof: 900,
            chi2_per_dof: 1.0,
            ..StageMisfit::default()
        };
        let report = |stage: StageMisfit| Report {
            misfit: Some(TraceMisfit::judge(
                vec![channel("tip-x", 2e-6), channel("head-drop", 8e-6)],
                vec![stage],
                &[],
            )),
            ..Report::default()
        };
        let wrong = report(stage.clone());
        let said = report_headline(&wrong);
        assert_eq!((said.good, said.details.len()), (Some(false), 1));
        assert!(
            said.plain_text().contains("misses the head\u{2019}s drop by 8.0 \u{b5}m rms, 4.0 times"),
            "{said:?}"
        );
        assert!(
            certainty_sentence(&Report {
                parameters: vec![line("friction.a", Knowledge::Identified)],
                ..wrong.clone()
            })
            .plain_text()
            .starts_with("No parameter counts as determined")
        );
        assert!(
            next_step_sentence(&wrong).plain_text().starts_with("Look at 0.2500 to 0.2660 s of film"),
            "{:?}",
            next_step_sentence(&wrong)
        );
        let right = report_headline(&report(StageMisfit { bad_segments: 0, ..stage }));
        assert!(
            right.good == Some(true) && right.plain_text().contains("2.0 \u{b5}m rms is left of the tip")
        );
    }

    #[test]
    fn a_target_that_an_explained_trace_misses_stands_under_the_headline() {
        let channel =
            ChannelMisfit { frames: 400, residual_rms_m: 2e-6, noise_m: 2e-6, ..Default::default() };
        let stage = StageMisfit { segments: 40, dof: 900, chi2_per_dof: 1.0, ..StageMisfit::default() };
        let report = Report {
            misfit: Some(TraceMisfit::judge(vec![channel], vec![stage], &[])),
            ..filmed(1.0, vec![target(103.0, 1.0, false), target(100.1, 1.0, true)])
        };
        let said = report_headline(&report);
        assert_eq!((said.good, said.details.len()), (Some(true), 1));
        assert!(said.details[0].plain_text().contains("beyond the tolerance"), "{said:?}");
    }

    #[test]
    fn the_condition_that_is_farthest_for_its_noise_is_told() {
        let silent = ComparisonSummary { judged: None, ..left_of(80.0) };
        let conditions = [left_of(1.0), silent, left_of(7.0), left_of(7.0)];
        let (condition, line) = farthest_condition(&conditions).unwrap();
        assert_eq!((condition, line.rms_over_noise), (2, Some(7.0)));
        assert!(farthest_condition(&[ComparisonSummary::default()]).is_none());
    }

    #[test]
    fn friction_is_said_at_rest_and_at_speed_in_place_of_its_coefficients() {
        let at = |speed_m_per_s, half_95| FrictionLine { speed_m_per_s, coefficient: 0.4, half_95 };
        let report = |half, verdict| Report {
            friction: vec![at(0.0, half), at(0.3, half)],
            parameters: vec![
                line("friction.a", verdict),
                line("blade.neck_stiffness_n_m_per_rad", Knowledge::Identified),
            ],
            ..Report::default()
        };
        let known = blade_quantities(&report(Some(0.01), Knowledge::Identified));
        let names: Vec<&str> = known.iter().map(|q| q.name.as_str()).collect();
        assert_eq!(
            names,
            [
                "friction coefficient at rest",
                "friction coefficient at 300 mm/s, the tip's greatest speed",
                "stiffness of the neck off the shoulder"
            ]
        );
        assert!(known.iter().all(|q| q.identified && q.fitted));
        assert_eq!((known[0].lower_95, known[0].upper_95), (Some(0.4 - 0.01), Some(0.4 + 0.01)));
        let open = blade_quantities(&report(None, Knowledge::OpenAbove));
        assert_eq!((open[0].lower_95, open[0].identified, open[2].identified), (None, false, true));
    }

    #[test]
    fn the_next_step_is_the_most_urgent_one() {
        let turned = Report {
            runs: vec![RunSummary { name: "fast".to_owned(), opposite_turn: true, ..RunSummary::default() }],
            search: SearchLine { status: Some(FitStatus::BudgetExhausted), ..SearchLine::default() },
            ..Report::default()
        };
        assert!(
            next_step_sentence(&turned).plain_text().starts_with("Start the scene of fast half a period")
        );
        let unfinished = Report { runs: Vec::new(), ..turned };
        assert!(next_step_sentence(&unfinished).plain_text().starts_with("Give the search a larger budget"));
        let open = Report {
            parameters: vec![line("friction.a", Knowledge::OpenAbove)],
            advice: vec!["measure the release".to_owned()],
            ..Report::default()
        };
        assert_eq!(next_step_sentence(&open).plain_text(), "Measure the release.");
        let alone = next_step_sentence(&Report { advice: Vec::new(), ..open }).plain_text();
        assert!(alone.starts_with("Measure A of the friction law by itself: side force over"), "{alone}");
        assert!(next_step_sentence(&Report::default()).plain_text().starts_with("Film the blade"));
        let mut stopped = line("friction.a", Knowledge::NotIdentified);
        stopped.bounds = [0.1, 0.5];
        let stopped = Report { parameters: vec![stopped], ..Report::default() };
        assert!(
            next_step_sentence(&stopped)
                .plain_text()
                .starts_with("Widen the bounds of A of the friction law")
        );
        let good = filmed(1.0, vec![target(100.0, 1.0, true)]);
        assert!(next_step_sentence(&good).plain_text().starts_with("Test the model on a recording"));
    }
}
