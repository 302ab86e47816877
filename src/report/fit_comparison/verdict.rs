//! What a comparison says, in words.

use super::{ComparedFit, IntervalPair, IntervalRelation, SharedParameter};
use crate::report::rich_text::{Sentence, Statement};

pub(super) fn comparison_statements(
    entries: &[ComparedFit],
    parameters: &[SharedParameter],
) -> Vec<Statement> {
    let met = entries.iter().filter(|entry| entry.verdict.all_components_met).count();
    let first = Statement {
        statement: Sentence::new(format!("Every component is met in {met} of {} fits", entries.len())),
        details: entries.iter().map(fit_sentence).collect(),
        good: entries.iter().any(|entry| !entry.report.components.is_empty()).then_some(met == entries.len()),
    };
    let mut found = vec![first];
    found.extend(overlap_statements(parameters));
    found.extend(source_statements(entries));
    found
}

/// A fit in a line.
fn fit_sentence(entry: &ComparedFit) -> Sentence {
    let met = entry.report.components.iter().filter(|c| c.pass).count();
    let known = entry.report.parameters.iter().filter(|p| p.is_identified()).count();
    let missed = entry.report.components.iter().filter(|c| !c.pass).map(|c| c.name.as_str());
    let search = if entry.verdict.search_converged { "search converged" } else { "search not converged" };
    let count = |noun: &str, of: usize| format!("{of} {noun}{}", if of == 1 { "" } else { "s" });
    let (components, parameters) = (
        count("component", entry.report.components.len()),
        count("parameter", entry.report.parameters.len()),
    );
    let explained = match entry.verdict.model_explains_recording {
        true => "",
        false => "the model does not explain the recording, ",
    };
    let counts =
        format!(": {explained}{met} of {components} met, {known} of {parameters} determined, {search}");
    let line = Sentence::default().with_name(&entry.name).with_words(counts);
    if met == entry.report.components.len() { line } else { line.with_words("; missed: ").with_names(missed) }
}

/// Of more pairs than this only the number is given, parameter by parameter: the table has them all.
const MOST_PAIRS: usize = 12;

/// Which intervals of shared parameters overlap, and which do not.
fn overlap_statements(parameters: &[SharedParameter]) -> Vec<Statement> {
    let pairs = || parameters.iter().flat_map(|p| p.pairs.iter().map(move |pair| (p, pair)));
    let of = |relation: IntervalRelation| {
        pairs().filter(|(_, pair)| pair.relation == relation).collect::<Vec<_>>()
    };
    let detail = |(p, pair): &(&SharedParameter, &IntervalPair)| {
        Sentence::default()
            .with_name(&p.name)
            .with_words(": ")
            .with_names(pair.fits.iter().map(String::as_str))
    };
    let number = |p: &SharedParameter, list: &[(&SharedParameter, &IntervalPair)]| {
        list.iter().filter(|(of, _)| of.name == p.name).count()
    };
    let counted = |list: &[(&SharedParameter, &IntervalPair)]| {
        let counts = parameters.iter().map(|p| (p, number(p, list))).filter(|(_, pairs)| *pairs > 0);
        counts
            .map(|(p, pairs)| {
                Sentence::default()
                    .with_name(&p.name)
                    .with_words(format!(": {pairs} pair{}", if pairs == 1 { "" } else { "s" }))
            })
            .collect()
    };
    let stated = |words: String, list: &[(&SharedParameter, &IntervalPair)]| Statement {
        statement: Sentence::new(words),
        details: if list.len() > MOST_PAIRS { counted(list) } else { list.iter().map(detail).collect() },
        good: None,
    };
    let (total, disjoint, overlap, unknown) = (
        pairs().count(),
        of(IntervalRelation::Disjoint),
        of(IntervalRelation::Overlap),
        of(IntervalRelation::NotComparable),
    );
    if total == 0 {
        return vec![Statement::new(Sentence::new("No two of the fits have a free parameter in common."))];
    }
    let comparable = total - unknown.len();
    let mut found = match comparable {
        0 => Vec::new(),
        _ => vec![stated(
            format!(
                "95 % intervals do not overlap in {} of {comparable} pairs of estimates that can be compared",
                disjoint.len()
            ),
            &disjoint,
        )],
    };
    if !overlap.is_empty() {
        found.push(stated(
            format!("They overlap in {}, which does not show that the values are equal", overlap.len()),
            &overlap,
        ));
    }
    if !unknown.is_empty() {
        let why = "because one of the two is not identified or lies at a bound";
        found.push(stated(
            format!("{} of {total} pairs of estimates cannot be compared, {why}", unknown.len()),
            &unknown,
        ));
    }
    let knows = "An interval does not include errors in the numbers of a scene that were not fitted: where \
                 scenes differ, so may the estimates.";
    found.push(Statement::new(Sentence::new(knows)));
    found
}

/// What fits can be made to other than a film: in words, and whether one was.
type FitSourceKind = (&'static str, fn(&ComparedFit) -> bool);

const KINDS: [FitSourceKind; 2] = [
    ("Fitted to synthetic data, which no camera took: ", |e| e.verdict.synthetic),
    ("Fitted to published numbers, without a recording: ", |e| e.verdict.published_only),
];

/// What the fits were made to.
fn source_statements(entries: &[ComparedFit]) -> Vec<Statement> {
    let of = |(words, is): &FitSourceKind| {
        let names: Vec<&str> = entries.iter().filter(|e| is(e)).map(|e| e.name.as_str()).collect();
        (!names.is_empty()).then(|| Statement::new(Sentence::new(*words).with_names(names).with_words(".")))
    };
    KINDS.iter().filter_map(of).collect()
}
