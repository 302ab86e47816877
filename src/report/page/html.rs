//! HTML parts of a page: escaped text, tables, figures, sections, the document.

use crate::figures::FigureBlock;
use crate::model::parameters;
use crate::report::rich_text::{Sentence, SentencePart, Statement};
use crate::text::{capitalise, make_printable};
use html_escape::encode_safe;

/// A text, escaped for HTML.
pub(in crate::report) fn escape_text(raw: &str) -> String {
    encode_safe(&make_printable(raw)).into_owned()
}

/// A name that a user chose, isolated so that right-to-left names do not reorder the text around them.
pub(in crate::report) fn isolate_name(raw: &str) -> String {
    format!("<bdi>{}</bdi>", escape_text(raw))
}

/// A key such as `friction.b_s_per_m`, in which lines may break at dots and underscores.
pub(in crate::report) fn breakable_key(raw: &str) -> String {
    format!("<code>{}</code>", escape_text(raw).replace('_', "_<wbr>").replace('.', ".<wbr>"))
}

/// Keys, separated by commas.
pub(in crate::report) fn keys_html(keys: &[impl AsRef<str>]) -> String {
    keys.iter().map(|key| breakable_key(key.as_ref())).collect::<Vec<_>>().join(", ")
}

/// The meaning of a number in words, with the related keys of the scene in small print.
pub(in crate::report) fn words_with_keys(words: &str, keys: &[&str]) -> String {
    let words = escape_text(&capitalise(words));
    if keys.is_empty() {
        return words;
    }
    format!("{words}<small class=\"key\">{}</small>", keys_html(keys))
}

/// The meaning and key of a parameter; the key alone if no scene has this parameter.
pub(in crate::report) fn parameter_html(name: &str) -> String {
    parameters::find_parameter(name)
        .map_or_else(|| breakable_key(name), |row| words_with_keys(row.meaning, &[row.name]))
}

/// Prose in which the names between backticks are isolated.
pub(in crate::report) fn prose_html(raw: &str) -> String {
    let parts: Vec<&str> = raw.split('`').collect();
    if parts.len().is_multiple_of(2) {
        // unpaired backticks do not mark names
        return format!("<span dir=\"auto\">{}</span>", escape_text(raw));
    }
    let html = |(i, part): (usize, &&str)| match i % 2 {
        0 => escape_text(part),
        _ => format!("<bdi class=\"name\">{}</bdi>", escape_text(part)),
    };
    parts.iter().enumerate().map(html).collect()
}

/// A sentence in which the names are isolated.
pub(in crate::report) fn sentence_html(sentence: &Sentence) -> String {
    let piece = |piece: &SentencePart| match piece {
        SentencePart::Words(words) => prose_html(words),
        SentencePart::Name(chosen) => isolate_name(chosen),
    };
    sentence.0.iter().map(piece).collect()
}

/// Statements as paragraphs, each with its details as a list.
pub(in crate::report) fn statements_html(list: &[Statement]) -> String {
    let one = |s: &Statement| {
        let class = s.good.map_or("", |good| if good { " class=\"good\"" } else { " class=\"bad\"" });
        format!(
            "<p{class}>{}</p>\n{}",
            sentence_html(&s.statement),
            items_html(s.details.iter().map(sentence_html))
        )
    };
    list.iter().map(one).collect()
}

/// A cell: its HTML and its style.
pub(in crate::report) type HtmlCell = (String, CellStyle);

/// Style of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::report) enum CellStyle {
    /// Text, aligned at its start.
    Words,
    /// Longer text, which may occupy a wide column.
    Prose,
    /// A name of any length, chosen by the user; it is broken so that it does not push the numbers off the
    /// page.
    Name,
    /// A number, aligned at the right.
    Number,
    Good,
    Bad,
}

impl CellStyle {
    fn css_class(self) -> &'static str {
        match self {
            Self::Words => "t",
            Self::Prose => "t wide",
            Self::Name => "t who",
            Self::Number => "n",
            Self::Good => "t good",
            Self::Bad => "t bad",
        }
    }
}

/// A cell with the word for good or for bad, in the respective colour.
pub(in crate::report) fn verdict_cell(good: bool, words: [&str; 2]) -> HtmlCell {
    if good { (escape_text(words[0]), CellStyle::Good) } else { (escape_text(words[1]), CellStyle::Bad) }
}

/// Head cells of the columns of a table, in the program's own words. Each group is a cell style and the heads
/// with that style, separated by `|`.
pub(in crate::report) fn column_heads(groups: &[(CellStyle, &str)]) -> Vec<HtmlCell> {
    groups
        .iter()
        .flat_map(|(style, names)| names.split('|').map(|name| (escape_text(name), *style)))
        .collect()
}

/// A table in a box that scrolls if the table is wider than the page; empty if it has no rows. The first cell
/// of a row is the head of the row.
pub(in crate::report) fn render_table(
    caption: &str,
    head: Vec<HtmlCell>,
    rows: Vec<Vec<HtmlCell>>,
) -> String {
    if rows.is_empty() {
        return String::new();
    }
    // on a narrow screen each row becomes a list in which each cell shows the name of its column
    let cell = |(i, ((html, style), (of, _))): (usize, (&HtmlCell, &HtmlCell))| match i {
        0 => format!("<th role=\"rowheader\" scope=\"row\" class=\"{}\">{html}</th>", style.css_class()),
        _ if html.is_empty() => "<td role=\"cell\" class=\"none\"></td>".to_owned(),
        _ => format!("<td role=\"cell\" class=\"{}\"><i>{of}</i> {html}</td>", style.css_class()),
    };
    let row = |cells: &Vec<HtmlCell>| {
        let cells: String = cells.iter().zip(&head).enumerate().map(cell).collect();
        format!("<tr role=\"row\">{cells}</tr>\n")
    };
    let rows: String = rows.iter().map(row).collect();
    let column = |(html, style): &HtmlCell| {
        format!("<th role=\"columnheader\" scope=\"col\" class=\"{}\">{html}</th>", style.css_class())
    };
    let (caption, head) = (escape_text(caption), head.iter().map(column).collect::<String>());
    format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Table: \
         {caption}\"><table role=\"table\">\n<caption>{caption}</caption>\n\
         <thead role=\"rowgroup\"><tr role=\"row\">{head}</tr></thead>\n\
         <tbody role=\"rowgroup\">\n{rows}</tbody>\n</table></div>\n"
    )
}

/// Named values as a list; empty if there are none.
pub(in crate::report) fn facts_list(list: &[(String, String)]) -> String {
    let items: String = list.iter().map(|(name, html)| format!("<dt>{name}</dt><dd>{html}</dd>\n")).collect();
    if list.is_empty() { items } else { format!("<dl>\n{items}</dl>\n") }
}

/// Sentences as a list; empty if there are none.
pub(in crate::report) fn sentence_list(sentences: &[String]) -> String {
    items_html(sentences.iter().map(|sentence| prose_html(sentence)))
}

/// A list of items; empty if there are none.
pub(in crate::report) fn items_html(items: impl Iterator<Item = String>) -> String {
    let items: String = items.map(|html| format!("<li>{html}</li>\n")).collect();
    if items.is_empty() { items } else { format!("<ul>\n{items}</ul>\n") }
}

/// A paragraph on how to read the part that follows.
pub(in crate::report) fn reading_hint(words: &str) -> String {
    format!("<p class=\"about\">{}</p>\n", escape_text(words))
}

/// Figures with their captions, numbered from `before` + 1.
pub(in crate::report) fn figures_html<'a>(
    blocks: impl IntoIterator<Item = &'a FigureBlock>,
    before: usize,
) -> String {
    let one = |(index, f): (usize, &FigureBlock)| {
        let (number, caption, drawn) = (before + index + 1, prose_html(&f.caption), f.drawing.on_screen());
        let clock = f.condition.map_or_else(String::new, |clock| format!(" data-clock=\"{clock}\""));
        format!(
            "<figure id=\"figure-{number}\"{clock} aria-labelledby=\"caption-{number}\">\n<div \
             class=\"drawing\">{drawn}</div>\n<figcaption><p id=\"caption-{number}\"><span \
             class=\"number\">Figure {number}.</span> {caption}</p>{}</figcaption>\n</figure>\n",
            details_html(&f.details)
        )
    };
    blocks.into_iter().enumerate().map(one).collect()
}

/// The details of a figure, folded, with one paragraph per line; empty if there are none.
fn details_html(text: &str) -> String {
    let paragraph = |words: &str| format!("<p>{}</p>\n", prose_html(words));
    let told: String = text.lines().filter(|line| !line.is_empty()).map(paragraph).collect();
    if told.is_empty() {
        return told;
    }
    format!("\n<details class=\"how\"><summary>How this was made</summary>\n{told}</details>")
}

/// A section of the page.
pub(in crate::report) struct PageSection {
    pub id: &'static str,
    pub heading: &'static str,
    pub html: String,
    /// Whether the contents of the section are folded at first.
    pub folded: bool,
}

impl PageSection {
    fn render(&self) -> String {
        let Self { id, heading, html, folded } = self;
        let heading = format!("<h2 id=\"{id}-heading\">{heading}</h2>");
        let section = |inside: &str| {
            format!("<section id=\"{id}\" aria-labelledby=\"{id}-heading\">\n{inside}</section>")
        };
        if *folded {
            // (a link to folded contents unfolds them)
            return format!("<details><summary>{heading}</summary>\n{}</details>\n", section(html));
        }
        section(&format!("{heading}\n{html}")) + "\n"
    }
}

/// The HTML without repeated style sheets: a style sheet inside a figure applies to the whole page, so that
/// figures with the same one need it only once.
fn remove_repeated_styles(html: &str) -> String {
    let mut seen: Vec<&str> = Vec::new();
    let mut kept = String::new();
    for part in html.split_inclusive("</style>\n") {
        let (before, style) = part.split_at(part.find("<style>").unwrap_or(part.len()));
        kept.push_str(before);
        if !seen.contains(&style) {
            kept.push_str(style);
            seen.push(style);
        }
    }
    kept
}

/// The whole document; sections without contents are left out.
pub(in crate::report) fn render_document(title: &str, lead: &str, sections: &[PageSection]) -> String {
    let shown: Vec<&PageSection> = sections.iter().filter(|s| !s.html.is_empty()).collect();
    let links: String =
        shown.iter().map(|s| format!("<li><a href=\"#{}\">{}</a></li>\n", s.id, s.heading)).collect();
    let body: String = remove_repeated_styles(&shown.iter().map(|s| s.render()).collect::<String>());
    let first = shown.first().map_or("", |s| s.id);
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\">\n\
         <title>{}</title>\n<style>\n{}</style>\n</head>\n<body>\n<a class=\"skip\" href=\"#{first}\">Skip \
         to the contents</a>\n<header>\n<h1>{}</h1>\n{lead}</header>\n\
         <nav aria-label=\"Contents\">\n<ul>\n{links}</ul>\n</nav>\n<main>\n{body}</main>\n\
         <script>\n{}</script>\n</body>\n</html>\n",
        escape_text(title),
        include_str!("../page.css"),
        isolate_name(title),
        include_str!("../page.js"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_isolated_and_nothing_turns_the_line() {
        assert_eq!(isolate_name("\u{202e}\u{5d0} <b>\"'"), "<bdi>\u{5d0} &lt;b&gt;&quot;&#x27;</bdi>");
        let said = sentence_html(&Sentence::new("a & ").with_name("<script>"));
        assert_eq!(said, "a &amp; <bdi>&lt;script&gt;</bdi>");
        assert_eq!(prose_html("the `x<y` is"), "the <bdi class=\"name\">x&lt;y</bdi> is");
        assert_eq!(prose_html("a ` b"), "<span dir=\"auto\">a ` b</span>");
    }

    #[test]
    fn a_table_has_a_caption_heads_of_rows_and_columns_and_a_named_box() {
        let head = column_heads(&[(CellStyle::Words, "a"), (CellStyle::Number, "b")]);
        let cells = vec![("x".to_owned(), CellStyle::Words), ("1".to_owned(), CellStyle::Number)];
        let html = render_table("C", head.clone(), vec![cells]);
        for part in [
            "<caption>C</caption>",
            "<th role=\"columnheader\" scope=\"col\" class=\"n\">b</th>",
            "<th role=\"rowheader\" scope=\"row\" class=\"t\">x</th>",
            "<td role=\"cell\" class=\"n\"><i>b</i> 1</td>",
            "aria-label=\"Table: C\"",
        ] {
            assert!(html.contains(part), "{part}: {html}");
        }
        assert_eq!(render_table("C", head, vec![]), "");
    }
}
