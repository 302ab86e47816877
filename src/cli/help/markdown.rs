//! Renders pages of the documentation for a terminal; supports the part of Markdown that these pages use.

use crate::text::wrap_words;

/// The section with the given heading and its subsections; for an empty heading, the text before the first
/// section.
pub(crate) fn find_section<'a>(page: &'a str, heading: &str) -> &'a str {
    let level = |line: &str| line.bytes().take_while(|byte| *byte == b'#').count();
    let mut places = page.split_inclusive('\n').scan(0, |at, line| {
        let start = *at;
        *at += line.len();
        Some((start, line))
    });
    let of = |line: &str| {
        level(line) > 0 && (heading.is_empty() || line.trim_start_matches('#').trim() == heading)
    };
    let Some((start, first)) = places.find(|(_, line)| of(line)) else { return page };
    let end = places.find(|(_, line)| (1..=level(first).max(2)).contains(&level(line)));
    &page[start..end.map_or(page.len(), |(end, _)| end)]
}

/// A page with lines of at most `width` characters. Links are replaced by their text, each row of a table
/// becomes a list, and code is unchanged.
pub(crate) fn render_for_terminal(page: &str, width: usize) -> String {
    let mut out = String::new();
    let mut paragraph = String::new();
    let mut columns: Option<Vec<String>> = None;
    let mut code = false;
    for line in page.lines().chain([""]) {
        let fence = line.starts_with("```");
        let row = !code && line.starts_with('|');
        let begins =
            fence || code || row || line.trim().is_empty() || line.starts_with('#') || starts_item(line);
        if begins {
            flush_paragraph(&mut out, &mut paragraph, width);
        }
        if !row {
            columns = None;
        }
        if fence {
            code = !code;
        } else if code {
            push_line(&mut out, &format!("    {line}"));
        } else if row {
            push_table_row(&mut out, line, &mut columns, width);
        } else if line.trim().is_empty() {
            push_line(&mut out, "");
        } else if line.starts_with('#') {
            push_line(&mut out, line.trim_start_matches('#').trim());
        } else {
            paragraph.push_str(line);
            paragraph.push('\n');
        }
    }
    out.trim_end().replace("\n\n\n", "\n\n")
}

fn push_line(out: &mut String, line: &str) {
    out.push_str(line.trim_end());
    out.push('\n');
}

/// Whether a line begins an item of a list.
fn starts_item(line: &str) -> bool {
    let line = line.trim_start();
    line.starts_with("- ") || line.split_once(". ").is_some_and(|(number, _)| number.parse::<u8>().is_ok())
}

/// Appends a paragraph or a list item with its indentation.
fn flush_paragraph(out: &mut String, paragraph: &mut String, width: usize) {
    let indent = paragraph.len() - paragraph.trim_start_matches(' ').len();
    let hanging = if starts_item(paragraph) { indent + 2 } else { indent };
    for (at, line) in wrap_words(&strip_markup(paragraph), width - hanging).iter().enumerate() {
        let margin = if at == 0 { indent } else { hanging };
        push_line(out, &format!("{}{line}", " ".repeat(margin)));
    }
    paragraph.clear();
}

/// Appends a row of a table as a list: first its first cell, then each further cell with the name of its
/// column.
fn push_table_row(out: &mut String, line: &str, columns: &mut Option<Vec<String>>, width: usize) {
    let cells = line.replace("\\|", "\u{1}");
    let cells: Vec<String> =
        cells.trim().trim_matches('|').split('|').map(|cell| strip_markup(cell.trim())).collect();
    let cells: Vec<String> = cells.into_iter().map(|cell| cell.replace('\u{1}', "|")).collect();
    let Some(names) = columns else {
        *columns = Some(cells);
        return;
    };
    if cells.iter().all(|cell| cell.bytes().all(|byte| matches!(byte, b'-' | b':'))) {
        return;
    }
    push_line(out, &format!("  {}", cells[0]));
    for (name, cell) in names.iter().zip(&cells).skip(1).filter(|(_, cell)| !cell.is_empty()) {
        let words = if name.is_empty() { cell.clone() } else { format!("{name}: {cell}") };
        wrap_words(&words, width - 6).iter().for_each(|line| push_line(out, &format!("      {line}")));
    }
}

/// The text without links and emphasis.
fn strip_markup(words: &str) -> String {
    let mut plain = String::new();
    let mut rest = words;
    while let Some((before, after)) = rest.split_once('[') {
        plain.push_str(before);
        let link = after.split_once("](").and_then(|(name, tail)| Some((name, tail.split_once(')')?.1)));
        match link.filter(|(name, _)| !name.contains(['[', '`', ']'])) {
            Some((name, tail)) => {
                plain.push_str(name);
                rest = tail;
            }
            None => {
                plain.push('[');
                rest = after;
            }
        }
    }
    plain.push_str(rest);
    plain.replace("**", "").replace("&nbsp;", " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = "# Top\n\nFirst.\n\n## One\n\nTakes [a link](x.md#y) and `a[1]`, **bold**\nover two \
        lines.\n\n- an item\n  that goes on\n\n| key | unit | means |\n|---|---|---|\n| `a` | m | one \\| two \
        |\n\n```sh\nwiperlab   fit\n```\n\n### Below\n\nDeep.\n\n## Two\n\nLast.\n";

    #[test]
    fn a_section_ends_where_the_next_of_its_level_begins() {
        let one = find_section(PAGE, "One");
        assert!(one.starts_with("## One\n") && one.ends_with("Deep.\n\n"), "{one}");
        assert_eq!(find_section(PAGE, ""), "# Top\n\nFirst.\n\n");
    }

    #[test]
    fn paragraphs_items_tables_and_code_are_laid_out() {
        let expected = "One\n\nTakes a link and `a[1]`, bold\nover two lines.\n\n- an item that goes on\n\n  `a`\n      unit: m\n      means: one | two\n\n    wiperlab   fit\n\nBelow\n\nDeep.";
        assert_eq!(render_for_terminal(find_section(PAGE, "One"), 30), expected);
    }
}
