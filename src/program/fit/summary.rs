//! What a fit found, on standard output: what is met, what is known of the parameters, and what a reader has
//! to know.

use super::CompletedFit;
use super::misfit::{print_misfit, print_nuisances};
use crate::fit::information::ParameterCombination;
use crate::fit::misfit::{far_from_priors, unexplained_headline};
use crate::fit::result::{FeatureResult, FitResult, ParameterResult};
use crate::text::{self, format_digits, to_ascii};

/// Digits of a number that is shown.
const DIGITS: usize = 5;

/// Features, parameters and reservations.
pub fn print_summary(solved: &CompletedFit) {
    let result = &solved.result;
    if let Some(misfit) = &result.misfit {
        print_misfit(misfit);
    } else if !result.explains_recordings() {
        print_line!("{}", to_ascii(&unexplained_headline(&far_from_priors(&result.nuisances))));
    }
    print_line!("{}: {}; cost {:.4}", result.status.name(), describe_evaluations(solved), result.cost);
    print_features(result);
    print_line!("");
    print_line!("{:<36} {:>11}  {:<25} verdict", "parameter", "estimate", "95 % interval");
    for (name, p) in &result.parameters {
        print_line!(
            "{name:<36} {:>11}  {:<25} {}",
            format_value(p.estimate),
            format_interval(p),
            p.verdict.name()
        );
        p.reasons.iter().for_each(|why| print_line!("  {why}"));
    }
    print_nuisances(&result.nuisances);
    print_notes(result);
}

/// Such as `1,234 evaluations of the model in 12.3 s (100/s)`.
fn describe_evaluations(solved: &CompletedFit) -> String {
    let evaluations = &solved.result.evaluations;
    let what = match solved.result.misfit {
        Some(_) => "iterates of the search",
        None => "evaluations of the model",
    };
    let (total, made) = (evaluations.total, evaluations.total.saturating_sub(solved.replayed));
    let seconds = solved.wall.as_secs_f64();
    let rate = format!("in {seconds:.1} s ({:.1}/s)", made as f64 / seconds.max(f64::MIN_POSITIVE));
    let made = match (solved.replayed, made) {
        (0, _) => format!("{total} {what} {rate}"),
        (_, 0) => format!("{total} {what}, all from the journal"),
        (replayed, made) => {
            format!("{total} {what}, {replayed} from the journal and {made} {rate}")
        }
    };
    let failed: Vec<String> =
        evaluations.failed.iter().map(|(reason, count)| format!("{count} {reason}")).collect();
    let failed = if failed.is_empty() { String::new() } else { format!(", failed: {}", failed.join(", ")) };
    made + &failed
}

fn print_features(result: &FitResult) {
    if result.components.is_empty() && result.features.is_empty() && result.held_out.is_empty() {
        return;
    }
    print_line!("{:<36} {:>11} {:>11} {:<4} {:>8}  met", "feature", "target", "model", "unit", "error, %");
    for c in &result.components {
        print_feature_row(&c.name, (c.target_hz, c.model_hz, "Hz"), c.relative_error, c.pass);
    }
    for f in &result.features {
        print_feature(f, "");
    }
    for f in &result.held_out {
        print_feature(f, "held out: ");
    }
}

fn print_feature(f: &FeatureResult, prefix: &str) {
    print_feature_row(
        &format!("{prefix}{}", f.name),
        (f.target, f.value_seen(), &f.unit),
        f.relative_error,
        f.pass,
    );
}

fn print_feature_row(
    name: &str,
    (target, model, unit): (f64, Option<f64>, &str),
    error: Option<f64>,
    met: bool,
) {
    let model = model.map_or("none".to_owned(), format_value);
    let error = error.map_or("-".to_owned(), |error| format!("{:+.2}", 100.0 * error));
    print_line!(
        "{name:<36} {:>11} {model:>11} {unit:<4} {error:>8}  {}",
        format_value(target),
        if met { "yes" } else { "no" }
    );
}

fn format_interval(p: &ParameterResult) -> String {
    text::format_interval(p.lower_95, p.upper_95, format_value)
}

/// What was known before the search, what the features determine together, and the notes.
fn print_notes(result: &FitResult) {
    print_line!("");
    for combination in &result.combinations {
        print_line!("{}", describe_combination(combination));
    }
    for note in &result.notes {
        // those of the gate say when they were made
        print_line!("{}{note}", if result.gate.notes.contains(note) { "" } else { "note: " });
    }
}

fn describe_combination(combination: &ParameterCombination) -> String {
    let percent = 100.0 * combination.sd_relative;
    let product = combination.describe();
    match combination.determined {
        true if percent > 0.0 => format!("determined: {product} (standard deviation {percent:.2} %)"),
        true => format!("determined: {product}"),
        false => format!("left open:  {product}"),
    }
}

pub(super) fn format_value(value: f64) -> String {
    to_ascii(&format_digits(value, DIGITS))
}
