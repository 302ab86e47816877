//! Statements of a comparison of fits.

use super::{ComparedFit, IntervalPair, IntervalRelation, SharedParameter};
use crate::report::rich_text::{Sentence, Statement};
use crate::text::pluralise;

pub(super) fn comparison_statements(
    entries: &[ComparedFit],
    parameters: &[SharedParameter],
) -> Vec<Statement> {
    let met = entries.iter().filter(|entry| entry.verdict.all_components_met).count();
    let words = format!("Every component is met in {met} of {} fits", entries.len());
    let has_components = entries.iter().any(|entry| !entry.report.components.is_empty());
    let good = has_components.then_some(met == entries.len());
    let mut found = vec![Statement::with_details(words, entries.iter().map(fit_sentence).collect(), good)];
    found.extend(overlap_statements(parameters));
    found.extend(source_statements(entries));
    found
}

/// Summary of a fit in one sentence.
fn fit_sentence(entry: &ComparedFit) -> Sentence {
    let (components, parameters) = (&entry.report.components, &entry.report.parameters);
    let met = components.iter().filter(|c| c.pass).count();
    let known = parameters.iter().filter(|p| p.is_identified()).count();
    let search = if entry.verdict.search_converged { "search converged" } else { "search not converged" };
    let count = |noun: &str, of: usize| format!("{of} {}", pluralise(noun, of));
    let of = [count("component", components.len()), count("parameter", parameters.len())];
    let unexplained = "the model does not explain the recording, ";
    let explained = if entry.verdict.model_explains_recording { "" } else { unexplained };
    let counts = format!(": {explained}{met} of {} met, {known} of {} determined, {search}", of[0], of[1]);
    let line = Sentence::default().with_name(&entry.name).with_words(counts);
    let missed = components.iter().filter(|c| !c.pass).map(|c| c.name.as_str());
    if met == components.len() { line } else { line.with_words("; missed: ").with_names(missed) }
}

/// Maximum number of pairs of intervals that are listed. If there are more, only their counts by parameter
/// are stated, since the table lists all pairs.
const MOST_PAIRS: usize = 12;

type SharedPair<'a> = (&'a SharedParameter, &'a IntervalPair);

/// Statements on the intervals of shared parameters that overlap and those that do not.
fn overlap_statements(parameters: &[SharedParameter]) -> Vec<Statement> {
    let pairs = || parameters.iter().flat_map(|p| p.pairs.iter().map(move |pair| (p, pair)));
    let of = |relation: IntervalRelation| {
        pairs().filter(|(_, pair)| pair.relation == relation).collect::<Vec<_>>()
    };
    let detail = |(p, pair): &SharedPair| {
        let names = pair.fits.iter().map(String::as_str);
        Sentence::default().with_name(&p.name).with_words(": ").with_names(names)
    };
    let counted = |list: &[SharedPair]| {
        let number = |p: &SharedParameter| list.iter().filter(|(of, _)| of.name == p.name).count();
        let counts = parameters.iter().map(|p| (p, number(p))).filter(|(_, pairs)| *pairs > 0);
        let line = |(p, pairs): (&SharedParameter, usize)| {
            let words = format!(": {pairs} {}", pluralise("pair", pairs));
            Sentence::default().with_name(&p.name).with_words(words)
        };
        counts.map(line).collect()
    };
    let stated = |words: String, list: &[SharedPair]| {
        let details = if list.len() > MOST_PAIRS { counted(list) } else { list.iter().map(detail).collect() };
        Statement::with_details(words, details, None)
    };
    let total = pairs().count();
    if total == 0 {
        return vec![Statement::new("No two of the fits have a free parameter in common.")];
    }
    let [disjoint, overlap, unknown] =
        [IntervalRelation::Disjoint, IntervalRelation::Overlap, IntervalRelation::NotComparable].map(of);
    let comparable = total - unknown.len();
    let mut found = Vec::new();
    if comparable > 0 {
        let apart = disjoint.len();
        let words = format!(
            "95 % intervals do not overlap in {apart} of {comparable} pairs of estimates that can be compared"
        );
        found.push(stated(words, &disjoint));
    }
    if !overlap.is_empty() {
        let count = overlap.len();
        let words = format!("They overlap in {count}, which does not show that the values are equal");
        found.push(stated(words, &overlap));
    }
    if !unknown.is_empty() {
        let why = "because one of the two is not identified or lies at a bound";
        let words = format!("{} of {total} pairs of estimates cannot be compared, {why}", unknown.len());
        found.push(stated(words, &unknown));
    }
    let knows = "An interval does not include errors in the numbers of a scene that were not fitted: where \
                 scenes differ, so may the estimates.";
    found.push(Statement::new(knows));
    found
}

/// Statements that name the fits to synthetic and to published data.
fn source_statements(entries: &[ComparedFit]) -> Vec<Statement> {
    let of = |words: &str, is: fn(&ComparedFit) -> bool| {
        let names: Vec<&str> = entries.iter().filter(|e| is(e)).map(|e| e.name.as_str()).collect();
        (!names.is_empty()).then(|| Statement::new(Sentence::new(words).with_names(names).with_words(".")))
    };
    let synthetic = of("Fitted to synthetic data, which no camera took: ", |e| e.verdict.synthetic);
    let published = of("Fitted to published numbers, without a recording: ", |e| e.verdict.published_only);
    synthetic.into_iter().chain(published).collect()
}
