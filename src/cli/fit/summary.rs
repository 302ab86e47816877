//! Prints the result of a fit to standard output: targets, parameters and notes.

use super::CompletedFit;
use crate::fit::linear_model::ParameterCombination;
use crate::fit::misfit::{ChannelMisfit, TraceMisfit};
use crate::fit::result::{FitResult, NuisanceResult};
use crate::text::{self, format_digits, to_ascii};

/// Number of significant digits of printed numbers.
const DIGITS: usize = 5;

/// Prints misfit, features, parameters and notes.
pub(crate) fn print_summary(solved: &CompletedFit) {
    let result = &solved.result;
    let (headline, reasons) = result.describe_verdict();
    print_line!("{}", to_ascii(&headline));
    reasons.iter().for_each(|reason| print_line!("  {}", to_ascii(reason)));
    if let Some(misfit) = &result.misfit {
        let added = result.findings.iter().filter(|finding| finding.adds_to_misfit());
        added.for_each(|finding| print_line!("{}", to_ascii(&finding.sentence)));
        print_misfit(misfit);
        let words = match result.constants_word() {
            "free" => "free within their priors",
            _ => "taken as exact: the intervals do not include their errors",
        };
        print_line!("constants: {words}");
    }
    print_line!("{}: {}; cost {:.4}", result.status.name(), describe_evaluations(solved), result.cost);
    print_features(result);
    if result.has_estimates() {
        print_parameters(result);
        print_nuisances(&result.nuisances);
    }
    if let Some(law) = &result.law {
        print_line!("");
        print_line!("{}", to_ascii(&law.sentence));
    }
    if let Some(chatter) = &result.chatter {
        print_line!("");
        chatter.sentences.iter().for_each(|sentence| print_line!("{}", to_ascii(sentence)));
    }
    print_notes(result);
}

fn print_parameters(result: &FitResult) {
    print_line!("");
    print_line!("parameter                               estimate  95 % interval             verdict");
    for (name, p) in &result.parameters {
        let interval = text::format_interval(p.lower_95, p.upper_95, format_value);
        print_line!("{name:<36} {:>11}  {interval:<25} {}", format_value(p.estimate), p.verdict.name());
        p.reasons.iter().for_each(|why| print_line!("  {why}"));
    }
}

/// Sentence such as `1,234 evaluations of the model in 12.3 s (100/s)`.
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
        (replayed, made) => format!("{total} {what}, {replayed} from the journal and {made} {rate}"),
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
    print_line!("feature                                   target       model unit error, %  met");
    for c in &result.components {
        print_feature_row(&c.name, (c.target_hz, c.model_hz, "Hz"), c.relative_error, c.pass);
    }
    let held_out = result.held_out.iter().map(|f| ("held out: ", f));
    for (prefix, f) in result.features.iter().map(|f| ("", f)).chain(held_out) {
        let name = format!("{prefix}{}", f.name);
        print_feature_row(&name, (f.target, f.value_seen(), &f.unit), f.relative_error, f.pass);
    }
}

fn print_feature_row(
    name: &str,
    (target, model, unit): (f64, Option<f64>, &str),
    error: Option<f64>,
    met: bool,
) {
    let model = model.map_or("none".to_owned(), format_value);
    let error = error.map_or("-".to_owned(), |error| format!("{:+.2}", 100.0 * error));
    let (target, met) = (format_value(target), if met { "yes" } else { "no" });
    print_line!("{name:<36} {target:>11} {model:>11} {unit:<4} {error:>8}  {met}");
}

/// Prints the combinations of parameters that the features determine, and the notes.
fn print_notes(result: &FitResult) {
    print_line!("");
    result.combinations.iter().for_each(|found| print_line!("{}", describe_combination(found)));
    for note in &result.notes {
        // a note of the gate (the check before the search) says itself when it was made and needs no prefix
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

/// Maximum number of segments of a channel that are listed.
const MOST_SEGMENTS: usize = 3;

/// Prints the residuals compared with the noise, and the misfit for each length of the segments.
fn print_misfit(misfit: &TraceMisfit) {
    print_line!("recording                channel     residual, um  noise, um  chi2/dof   neighbours");
    misfit.channels.iter().for_each(print_channel_misfit);
    print_line!("");
    print_line!("segments                      number     bad ones  chi2/dof");
    for stage in &misfit.stages {
        let length = format!("of {} ms", format_value(1e3 * stage.segment_s));
        let (count, bad, chi2) = (stage.segments, stage.bad_segments, format_value(stage.chi2_per_dof));
        print_line!("{length:<24} {count:>11} {bad:>12} {chi2:>9}");
    }
    misfit.channels.iter().for_each(print_worst_segments);
    print_line!("");
}

fn print_channel_misfit(c: &ChannelMisfit) {
    let [residual, noise, chi2] = [1e6 * c.residual_rms_m, 1e6 * c.noise_m, c.chi2_per_dof].map(format_value);
    let next = c.autocorrelation_1.map_or_else(|| "-".to_owned(), |r| format!("{r:+.2}"));
    let (recording, channel) = (&c.recording, &c.channel);
    print_line!("{recording:<24} {channel:<11} {residual:>12} {noise:>10} {chi2:>9} {next:>12}");
}

fn print_worst_segments(c: &ChannelMisfit) {
    let segment = |w: &crate::fit::misfit::WorstSegment| {
        let [from, to, chi2] = [w.start_s, w.end_s, w.chi2_per_dof].map(format_value);
        format!("{from} to {to} s (chi2/dof {chi2})")
    };
    let named: Vec<String> = c.worst.iter().take(MOST_SEGMENTS).map(segment).collect();
    if !named.is_empty() {
        print_line!("worst in {}, {}: {}", c.recording, c.channel, named.join(", "));
    }
}

/// Prints the quantities that were estimated in addition to the parameters.
fn print_nuisances(list: &[NuisanceResult]) {
    if list.is_empty() {
        return;
    }
    print_line!("");
    print_line!(
        "camera and constants                    estimate  95 % interval             known beforehand"
    );
    for n in list {
        let name = n.recording.as_ref().map_or_else(|| n.name.clone(), |of| format!("{of}: {}", n.name));
        let interval = text::format_interval(n.lower_95, n.upper_95, format_value);
        let known = n.prior.zip(n.prior_sd).map_or_else(
            || "nothing".to_owned(),
            |(prior, sd)| format!("{} +- {}", format_value(prior), format_value(sd)),
        );
        print_line!("{name:<36} {:>11}  {interval:<25} {known}", format_value(n.estimate));
    }
}
