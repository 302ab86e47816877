//! What a comparison says, in words.

use super::fitted::Entry;
use super::shared::{Pair, Relation, SharedParameter};
use crate::report::statement::{Sentence, Statement};

pub(super) fn statements(entries: &[Entry], parameters: &[SharedParameter]) -> Vec<Statement> {
    let met = entries.iter().filter(|entry| entry.verdict.all_components_met).count();
    let first = Statement {
        statement: Sentence::of(format!("Every component is met in {met} of {} fits", entries.len())),
        details: entries.iter().map(each).collect(),
        good: entries.iter().any(|entry| !entry.report.components.is_empty()).then_some(met == entries.len()),
    };
    let mut found = vec![first];
    found.extend(apart(parameters));
    found.extend(sources(entries));
    found
}

/// A fit in a line.
fn each(entry: &Entry) -> Sentence {
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
    let line = Sentence::default().name(&entry.name).words(counts);
    if met == entry.report.components.len() { line } else { line.words("; missed: ").names(missed) }
}

/// Of more pairs than this only the number is given, parameter by parameter: the table has them all.
const MOST_PAIRS: usize = 12;

/// Which intervals of shared parameters overlap, and which do not.
fn apart(parameters: &[SharedParameter]) -> Vec<Statement> {
    let pairs = || parameters.iter().flat_map(|p| p.pairs.iter().map(move |pair| (p, pair)));
    let of = |relation: Relation| pairs().filter(|(_, pair)| pair.relation == relation).collect::<Vec<_>>();
    let detail = |(p, pair): &(&SharedParameter, &Pair)| {
        Sentence::default().name(&p.name).words(": ").names(pair.fits.iter().map(String::as_str))
    };
    let number = |p: &SharedParameter, list: &[(&SharedParameter, &Pair)]| {
        list.iter().filter(|(of, _)| of.name == p.name).count()
    };
    let counted = |list: &[(&SharedParameter, &Pair)]| {
        let counts = parameters.iter().map(|p| (p, number(p, list))).filter(|(_, pairs)| *pairs > 0);
        counts
            .map(|(p, pairs)| {
                Sentence::default()
                    .name(&p.name)
                    .words(format!(": {pairs} pair{}", if pairs == 1 { "" } else { "s" }))
            })
            .collect()
    };
    let stated = |words: String, list: &[(&SharedParameter, &Pair)]| Statement {
        statement: Sentence::of(words),
        details: if list.len() > MOST_PAIRS { counted(list) } else { list.iter().map(detail).collect() },
        good: None,
    };
    let (total, disjoint, overlap, unknown) =
        (pairs().count(), of(Relation::Disjoint), of(Relation::Overlap), of(Relation::NotComparable));
    if total == 0 {
        return vec![Statement::alone(Sentence::of("No two of the fits have a free parameter in common."))];
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
    found.push(Statement::alone(Sentence::of(knows)));
    found
}

/// What fits can be made to other than a film: in words, and whether one was.
type Kind = (&'static str, fn(&Entry) -> bool);

const KINDS: [Kind; 2] = [
    ("Fitted to synthetic data, which no camera took: ", |e| e.verdict.synthetic),
    ("Fitted to published numbers, without a recording: ", |e| e.verdict.published_only),
];

/// What the fits were made to.
fn sources(entries: &[Entry]) -> Vec<Statement> {
    let of = |(words, is): &Kind| {
        let names: Vec<&str> = entries.iter().filter(|e| is(e)).map(|e| e.name.as_str()).collect();
        (!names.is_empty()).then(|| Statement::alone(Sentence::of(*words).names(names).words(".")))
    };
    KINDS.iter().filter_map(of).collect()
}
