//! Where the numbers come from and how they are made again.

use super::html::{Set, Table, about, facts, name, text};
use crate::report::{Provenance, SourceFile};
use crate::text::DASH;

pub(in crate::report) fn provenance(p: &Provenance) -> String {
    let mut list = vec![("wiperlab", p.version.clone())];
    list.extend(p.seed.map(|seed| ("seed", seed.to_string())));
    list.push(("fingerprint of problem, data and program", p.fingerprint.clone()));
    let list: Vec<(String, String)> = list
        .into_iter()
        .filter(|(_, value)| !value.is_empty())
        .map(|(name, value)| (text(name), text(&value)))
        .collect();
    [facts(&list), files(&p.files), commands(p)].concat()
}

fn files(list: &[SourceFile]) -> String {
    let row = |f: &SourceFile| {
        let synthetic =
            if f.synthetic { ("synthetic".to_owned(), Set::Bad) } else { (DASH.to_owned(), Set::Words) };
        vec![
            (name(&f.name), Set::Words),
            (text(&f.kind), Set::Words),
            synthetic,
            (format!("<code class=\"hash\">{}</code>", text(&f.sha256)), Set::Words),
        ]
    };
    let head =
        [("file", Set::Words), ("what it is", Set::Words), ("data", Set::Words), ("SHA-256", Set::Words)];
    Table {
        caption: "Files behind this report",
        head: Table::heads(&head),
        rows: list.iter().map(row).collect(),
    }
    .html()
}

fn commands(p: &Provenance) -> String {
    if p.commands.is_empty() {
        return String::new();
    }
    let imported = if p.files.iter().any(|f| f.kind == EXPORT) {
        about(
            "The command that imported a recording is not kept: its trace.csv and recording.toml were made \
             by wiperlab import from the exports above, with the rate and scale that recording.toml holds.",
        )
    } else {
        String::new()
    };
    let lines = p.commands.iter().map(|command| text(command)).collect::<Vec<_>>().join("\n");
    format!(
        "<p>To make it again:</p>\n<pre tabindex=\"0\" role=\"region\" \
         aria-label=\"Commands\">{lines}</pre>\n{imported}"
    )
}

/// Kind of a file that a tracking program wrote.
const EXPORT: &str = "export";
