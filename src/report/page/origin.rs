//! Where the numbers come from and how they are made again.

use super::html::{CellStyle, HtmlTable, escape_text, facts_list, isolate_name, reading_hint};
use crate::report::{Provenance, SourceFile};
use crate::text::DASH;

pub(in crate::report) fn provenance_html(p: &Provenance) -> String {
    let mut list = vec![("wiperlab", p.version.clone())];
    list.extend(p.seed.map(|seed| ("seed", seed.to_string())));
    list.push(("fingerprint of problem, data and program", p.fingerprint.clone()));
    let list: Vec<(String, String)> = list
        .into_iter()
        .filter(|(_, value)| !value.is_empty())
        .map(|(name, value)| (escape_text(name), escape_text(&value)))
        .collect();
    [facts_list(&list), files_table(&p.files), commands_html(p)].concat()
}

fn files_table(list: &[SourceFile]) -> String {
    let row = |f: &SourceFile| {
        let synthetic = if f.synthetic {
            ("synthetic".to_owned(), CellStyle::Bad)
        } else {
            (DASH.to_owned(), CellStyle::Words)
        };
        vec![
            (isolate_name(&f.name), CellStyle::Words),
            (escape_text(&f.kind), CellStyle::Words),
            synthetic,
            (format!("<code class=\"hash\">{}</code>", escape_text(&f.sha256)), CellStyle::Words),
        ]
    };
    let head = [
        ("file", CellStyle::Words),
        ("what it is", CellStyle::Words),
        ("data", CellStyle::Words),
        ("SHA-256", CellStyle::Words),
    ];
    HtmlTable {
        caption: "Files behind this report",
        head: HtmlTable::column_heads(&head),
        rows: list.iter().map(row).collect(),
    }
    .render()
}

fn commands_html(p: &Provenance) -> String {
    if p.commands.is_empty() {
        return String::new();
    }
    let imported = if p.files.iter().any(|f| f.kind == EXPORT_KIND) {
        reading_hint(
            "The command that imported a recording is not kept: its trace.csv and recording.toml were made \
             by wiperlab import from the exports above, with the rate and scale that recording.toml holds.",
        )
    } else {
        String::new()
    };
    let lines = p.commands.iter().map(|command| escape_text(command)).collect::<Vec<_>>().join("\n");
    format!(
        "<p>To make it again:</p>\n<pre tabindex=\"0\" role=\"region\" \
         aria-label=\"Commands\">{lines}</pre>\n{imported}"
    )
}

/// Kind of a file that a tracking program wrote.
const EXPORT_KIND: &str = "export";
