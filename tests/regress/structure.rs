//! The order of the layers in `src`, what each command needs of them, and names that are unique.
//!
//! Lists of exceptions only shrink: an entry that is no exception any longer fails too.

mod code;
mod cycles;
mod files;
mod names;

use cycles::find_cycles;
use files::{SourceFile, find_edges, read_leaf_packages, read_source_files, read_workspace_files};
use names::{defined_functions, defined_types, looks_like_participle};
use std::collections::{BTreeMap, BTreeSet};

/// The layers of `src`; a layer uses only layers above it.
const LAYERS: [&str; 17] = [
    "text",
    "toml_file",
    "camera",
    "model",
    "recording",
    "import",
    "simulate",
    "checkpoint",
    "stability",
    "feature",
    "fit",
    "compare",
    "sweep",
    "figures",
    "report",
    "draft",
    "cli",
];
/// Words of the field that no package in `crates` knows.
const DOMAIN_WORDS: [&str; 14] = [
    "blade", "wiper", "wiperlab", "lip", "neck", "glass", "friction", "stick", "slip", "flip", "reversal",
    "shoulder", "rig", "tip",
];
/// Commands that need no fit, and the most files that each may reach.
const COMMANDS_WITHOUT_FIT: [(&str, usize); 5] =
    [("modes", 65), ("twin", 70), ("inspect", 82), ("simulate", 95), ("spectrum", 92)];
/// Layers that these commands reach nothing of.
const FIT_LAYERS: [&str; 2] = ["fit", "compare"];

/// Most files that may use each other in a cycle, all of one layer.
const MAX_CYCLE_FILES: usize = 4;
/// Most lines of a file before its tests.
const MAX_FILE_LINES: usize = 700;
/// Most columns of a line; tables, the inside of texts and signatures for Python do not count.
const MAX_COLUMNS: usize = 110;

/// Files that are longer.
const LONG_FILES: [&str; 0] = [];
/// Types whose name another type has.
const SHARED_TYPE_NAMES: [&str; 0] = [];
/// Functions whose name is a bare participle.
const PARTICIPLES: [&str; 0] = [];
/// Nouns, adjectives and verbs that end as participles do.
const NO_PARTICIPLES: [&str; 8] =
    ["drawing", "expecting", "len", "meaning", "open", "recording", "setting", "spacing"];

#[test]
fn layers_use_only_layers_above_them() {
    let files = read_source_files();
    let rank = |layer: &str| LAYERS.iter().position(|name| *name == layer);
    let mut wrong = BTreeMap::new();
    for (from, to) in find_edges(&files) {
        let (Some(layer), Some(used)) = (files[from].layer(), files[to].layer()) else { continue };
        let is_allowed = matches!((rank(layer), rank(used)), (Some(own), Some(above)) if above < own);
        if layer != used && !is_allowed {
            wrong.insert(format!("{layer} uses {used}"), &files[from].path);
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    let unlisted: BTreeSet<_> =
        files.iter().filter_map(|f| f.layer()).filter(|l| rank(l).is_none()).collect();
    assert!(unlisted.is_empty() || unlisted == BTreeSet::from(["prelude"]), "{unlisted:?}");
}

#[test]
fn a_leaf_package_knows_no_word_of_the_field() {
    let mut wrong = BTreeSet::new();
    for file in read_leaf_packages().into_iter().flatten() {
        let words = file.without_texts.split(|c: char| !c.is_ascii_alphabetic()).map(str::to_ascii_lowercase);
        let known = words.filter(|word| DOMAIN_WORDS.contains(&word.trim_end_matches('s')));
        wrong.extend(known.map(|word| (file.path.clone(), word)));
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn commands_without_a_fit_reach_no_fit() {
    let files = read_source_files();
    let edges = find_edges(&files);
    for (command, most) in COMMANDS_WITHOUT_FIT {
        let start = files.iter().position(|f| f.path == format!("cli/{command}.rs")).expect(command);
        let reached = reach(start, &edges);
        let of_a_fit: Vec<_> = reached
            .iter()
            .map(|&i| &files[i])
            .filter(|f| f.layer().is_some_and(|layer| FIT_LAYERS.contains(&layer)))
            .map(|f| &f.path)
            .collect();
        assert!(of_a_fit.is_empty(), "{command} reaches {of_a_fit:#?}");
        assert!(reached.len() <= most, "{command} reaches {} files, at most {most}", reached.len());
    }
}

/// A file and all that it uses, directly or through others.
fn reach(start: usize, edges: &[(usize, usize)]) -> BTreeSet<usize> {
    let mut reached = BTreeSet::from([start]);
    let mut open = vec![start];
    while let Some(file) = open.pop() {
        let used = edges.iter().filter(|(from, _)| *from == file).map(|(_, to)| *to);
        used.for_each(|to| {
            if reached.insert(to) {
                open.push(to);
            }
        });
    }
    reached
}

#[test]
fn no_cycle_leads_through_two_layers_or_many_files() {
    let mut wrong = Vec::new();
    let mut packages = read_leaf_packages();
    packages.push(read_source_files());
    for (k, files) in packages.iter().enumerate() {
        let is_leaf = k + 1 < packages.len();
        let modules =
            |cycle: &[usize]| cycle.iter().map(|&i| files[i].top_module()).collect::<BTreeSet<_>>().len();
        for cycle in find_cycles(files.len(), &find_edges(files)) {
            if cycle.len() > MAX_CYCLE_FILES || !is_leaf && modules(&cycle) > 1 {
                wrong.push(cycle.iter().map(|&i| files[i].path.clone()).collect::<Vec<_>>());
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn files_are_short_enough_to_be_read() {
    let is_long = |file: &SourceFile| file.lines_before_tests > MAX_FILE_LINES;
    let found = read_workspace_files().into_iter().filter(is_long).map(|f| f.path);
    compare_with_exceptions(found.collect(), &LONG_FILES);
}

#[test]
fn lines_are_short_enough_to_be_read() {
    let is_table =
        |line: &str| ["//! |", "/// |", "#[pyo3("].iter().any(|s| line.trim_start().starts_with(s));
    let is_wide = |line: &str| line.chars().count() > MAX_COLUMNS && !is_table(line);
    let wide = |file: &SourceFile| {
        let lines = file.without_texts.lines().enumerate();
        let wide: Vec<usize> = lines.filter(|(_, line)| is_wide(line)).map(|(i, _)| i + 1).collect();
        (!wide.is_empty()).then(|| (file.path.clone(), wide))
    };
    let files = read_workspace_files();
    let wrong: Vec<_> = files.iter().filter_map(wide).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Every package may have its own `Error`.
#[test]
fn a_type_has_a_name_of_its_own() {
    let mut places: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for file in read_workspace_files() {
        for name in defined_types(&file.code).into_iter().filter(|name| name != "Error") {
            places.entry(name).or_default().push(file.path.clone());
        }
    }
    places.retain(|_, files| files.len() > 1);
    println!("{places:#?}");
    compare_with_exceptions(places.into_keys().collect(), &SHARED_TYPE_NAMES);
}

#[test]
fn a_function_is_not_a_bare_participle() {
    let found = read_workspace_files()
        .iter()
        .flat_map(|file| defined_functions(&file.code))
        .filter(|name| looks_like_participle(name) && !NO_PARTICIPLES.contains(&&name[..]))
        .collect();
    compare_with_exceptions(found, &PARTICIPLES);
}

/// What is found and what is allowed are the same.
fn compare_with_exceptions(found: BTreeSet<String>, exceptions: &[&str]) {
    let allowed: BTreeSet<String> = exceptions.iter().map(|&name| name.to_owned()).collect();
    let new: Vec<_> = found.difference(&allowed).collect();
    assert!(new.is_empty(), "against the rule: {new:#?}");
    let gone: Vec<_> = allowed.difference(&found).collect();
    assert!(gone.is_empty(), "no exceptions any longer, so take them off the list: {gone:#?}");
}
