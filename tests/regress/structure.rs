//! The order of the rooms in `src`: who may use whom, no circles between them, and how long a file may be.

mod circles;
mod code;
mod files;

use circles::circles;
use files::{SourceFile, all_files, edges};
use std::collections::{BTreeMap, BTreeSet};

/// Which rooms each room may use. A room that is not listed is new: it gets a line here.
const ROOMS: [(&str, &[&str]); 24] = [
    ("math", &[]),
    ("text", &["math"]),
    ("toml_file", &["text"]),
    ("ode", &["math"]),
    ("camera", &["math"]),
    ("spectrum", &["camera", "math"]), // a component may be one above half the frame rate, folded
    ("chart", &["math", "text"]),
    ("blade", &["math"]),
    ("plausibility", &["blade", "text"]), // the ranges are of parameters of the blade
    ("recording", &["camera", "math", "text", "toml_file"]),
    ("import", &["camera", "math", "recording", "text", "toml_file"]),
    ("simulate", &["blade", "math", "ode", "plausibility", "recording", "toml_file"]), // a recorded head may drive a scene
    ("section", &["blade", "math", "plausibility", "simulate", "text", "toml_file"]), // and back from a scene
    ("twin", &["blade", "camera", "math", "recording", "simulate", "toml_file"]),
    ("accuracy", &["blade", "ode", "recording", "simulate", "spectrum"]),
    ("feature", &["math", "recording", "simulate", "spectrum", "toml_file"]),
    ("journal", &["text"]),
    (
        "fit",
        &[
            "blade",
            "camera",
            "feature",
            "journal",
            "math",
            "recording",
            "simulate",
            "spectrum",
            "text",
            "toml_file",
            "twin",
        ],
    ),
    (
        "compare",
        &["blade", "camera", "feature", "fit", "math", "recording", "simulate", "spectrum", "text", "twin"],
    ),
    (
        "sweep",
        &[
            "blade",
            "camera",
            "feature",
            "journal",
            "math",
            "recording",
            "simulate",
            "spectrum",
            "text",
            "toml_file",
            "twin",
        ],
    ),
    (
        "figures",
        &[
            "blade",
            "chart",
            "compare",
            "feature",
            "fit",
            "math",
            "recording",
            "simulate",
            "spectrum",
            "sweep",
            "text",
        ],
    ),
    (
        "report",
        &[
            "blade",
            "chart",
            "compare",
            "feature",
            "figures",
            "fit",
            "math",
            "recording",
            "simulate",
            "spectrum",
            "text",
        ],
    ),
    ("draft", &["blade", "fit", "math", "recording", "simulate", "spectrum", "text"]),
    (
        "program",
        &[
            "accuracy",
            "blade",
            "camera",
            "chart",
            "compare",
            "draft",
            "feature",
            "figures",
            "fit",
            "import",
            "journal",
            "math",
            "ode",
            "plausibility",
            "recording",
            "report",
            "section",
            "simulate",
            "spectrum",
            "sweep",
            "text",
            "toml_file",
            "twin",
        ],
    ),
];

/// Most files that may use each other in a circle, and all of one room.
const MOST_IN_CIRCLE: usize = 4;
/// Most lines of a file before its tests.
const MOST_LINES: usize = 450;
/// Most columns of a line; tables and the inside of texts do not count.
const MOST_COLUMNS: usize = 110;

#[test]
fn rooms_use_each_other_one_way() {
    let files = all_files();
    let mut wrong = BTreeMap::new();
    for (from, to) in edges(&files) {
        let (Some(room), Some(used)) = (files[from].room(), files[to].room()) else { continue };
        let allowed = ROOMS.iter().find(|(name, _)| *name == room).map_or(&[][..], |(_, rooms)| rooms);
        if room != used && !allowed.contains(&used) {
            wrong.insert(format!("{room} uses {used}"), &files[from].path);
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    for (i, (name, rooms)) in ROOMS.iter().enumerate() {
        assert!(rooms.iter().all(|used| ROOMS[..i].iter().any(|(before, _)| before == used)), "{name}");
    }
}

#[test]
fn no_circle_leads_through_two_rooms_or_many_files() {
    let files = all_files();
    let found = circles(files.len(), &edges(&files));
    let paths = |circle: &Vec<usize>| circle.iter().map(|&i| files[i].path.clone()).collect::<Vec<_>>();
    let modules =
        |circle: &Vec<usize>| circle.iter().map(|&i| files[i].top_module()).collect::<BTreeSet<_>>();
    let wrong: Vec<_> = found
        .iter()
        .filter(|circle| circle.len() > MOST_IN_CIRCLE || modules(circle).len() > 1)
        .map(paths)
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn files_are_short_enough_to_be_read() {
    let long = |file: &SourceFile| file.lines_before_tests > MOST_LINES;
    let wrong: Vec<_> =
        all_files().into_iter().filter(long).map(|f| (f.lines_before_tests, f.path)).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn lines_are_short_enough_to_be_read() {
    let is_table = |line: &str| line.starts_with("//! |") || line.trim_start().starts_with("/// |");
    let is_wide = |line: &str| line.chars().count() > MOST_COLUMNS && !is_table(line);
    let wide = |file: &SourceFile| {
        let lines = file.without_texts.lines().enumerate();
        let wide: Vec<usize> = lines.filter(|(_, line)| is_wide(line)).map(|(i, _)| i + 1).collect();
        (!wide.is_empty()).then(|| (file.path.clone(), wide))
    };
    let files = all_files();
    let wrong: Vec<_> = files.iter().filter_map(wide).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}
