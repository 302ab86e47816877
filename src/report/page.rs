//! The page of a report: one HTML file with its style and figures inside, without script or network.

use super::{Comparison, Fact, FigureBlock, ParameterLine, RecordingLine, Report};
use html_escape::encode_safe;

/// The page; the same report always gives the same bytes.
#[must_use]
pub fn page(report: &Report) -> String {
    let sections = [
        figures(&report.figures),
        comparisons("Components", "component", &report.components),
        comparisons("Features", "feature", &report.features),
        parameters(&report.parameters),
        quality(report),
        facts("The best run of the model", &report.best_run),
        notes(&report.notes),
        provenance(report),
    ];
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>\n{}</style>\n</head>\n<body>\n<main>\n<h1>{title}</h1>\n{}{}{}</main>\n</body>\n</html>\n",
        include_str!("page.css"),
        banner(report),
        verdict(report),
        sections.concat(),
        title = text(&report.title),
    )
}

/// Text from anywhere as HTML; control characters have no place in it.
fn text(raw: &str) -> String {
    let printable: String = raw.chars().map(|c| if c.is_control() && c != '\n' { ' ' } else { c }).collect();
    encode_safe(&printable).into_owned()
}

/// Four significant digits.
fn number(value: f64) -> String {
    to_digits(value, 4)
}

/// So many significant digits; powers of ten where plain digits would be long.
fn to_digits(value: f64, digits: i32) -> String {
    if !value.is_finite() {
        return "\u{2013}".to_owned();
    }
    let magnitude = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    let written = match magnitude {
        -3..=4 => format!("{value:.*}", (digits - 1 - magnitude).max(0) as usize),
        _ => {
            let written = format!("{value:.*e}", (digits - 1).max(0) as usize);
            match written.split_once('e') {
                Some((digits, exponent)) => format!("{digits}\u{b7}10<sup>{}</sup>", exponent.replace('-', "\u{2212}")),
                None => written,
            }
        }
    };
    written.replace('-', "\u{2212}")
}

/// A missing value is a dash.
fn optional(value: Option<f64>) -> String {
    value.map_or_else(|| "\u{2013}".to_owned(), number)
}

fn banner(report: &Report) -> String {
    if !report.is_synthetic() {
        return String::new();
    }
    let named: Vec<_> = report.recordings.iter().filter(|r| r.synthetic).map(|r| text(&r.name)).collect();
    format!("<p class=\"synthetic\" role=\"note\">Synthetic data: no camera took {}. The numbers below test the method, not a blade.</p>\n", named.join(", "))
}

fn verdict(report: &Report) -> String {
    let mut sentences = report.verdict();
    if sentences.is_empty() {
        sentences.push("Nothing was compared.".to_owned());
    }
    if report.recordings.is_empty() {
        sentences.push(
            "Only published numbers were fitted: there are no measured traces, so the figures show the model alone and the published values as lines."
                .to_owned(),
        );
    }
    sentences.extend(Some(format!("How the search ended: {}. {}", report.status, report.ending)).filter(|_| !report.status.is_empty()));
    let paragraphs: String = sentences.iter().map(|s| format!("<p>{}</p>\n", text(s.trim()))).collect();
    format!("<section class=\"verdict\" aria-label=\"Verdict\">\n{paragraphs}</section>\n")
}

fn figures(figures: &[FigureBlock]) -> String {
    if figures.is_empty() {
        return String::new();
    }
    let one = |(index, f): (usize, &FigureBlock)| {
        let (number, caption) = (index + 1, text(&f.caption));
        format!(
            "<figure id=\"figure-{number}\">\n<div class=\"scroll\" tabindex=\"0\">{}</div>\n<figcaption>Figure {number}. {caption}</figcaption>\n</figure>\n",
            f.svg
        )
    };
    format!("<h2>Figures</h2>\n{}", figures.iter().enumerate().map(one).collect::<String>())
}

/// A cell: its contents as HTML, and its class.
type Cell = (String, &'static str);

/// Left-aligned text.
const TEXT: &str = "t";

/// A table under a heading; nothing when it has no rows.
fn table(heading: &str, about: &str, head: &[(&str, &str)], rows: &[Vec<Cell>]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let head: String = head.iter().map(|(name, class)| format!("<th scope=\"col\" class=\"{class}\">{name}</th>")).collect();
    let row = |cells: &Vec<Cell>| {
        let cells: String = cells.iter().map(|(html, class)| format!("<td class=\"{class}\">{html}</td>")).collect();
        format!("<tr>{cells}</tr>\n")
    };
    let body: String = rows.iter().map(row).collect();
    format!(
        "<h2>{heading}</h2>\n<p class=\"about\">{about}</p>\n<div class=\"scroll\" tabindex=\"0\"><table aria-label=\"{heading}\">\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody>\n</table></div>\n"
    )
}

fn comparisons(heading: &str, kind: &str, list: &[Comparison]) -> String {
    let row = |c: &Comparison| {
        let target = c.target_sd.map_or_else(|| number(c.target), |sd| format!("{} \u{b1} {}", number(c.target), to_digits(sd, 2)));
        let error = c.relative_error.map_or_else(|| "\u{2013}".to_owned(), |e| format!("{:+.2} %", 100.0 * e).replace('-', "\u{2212}"));
        let met = if c.pass { ("met".to_owned(), "t good") } else { ("not met".to_owned(), "t bad") };
        vec![(text(&c.name), TEXT), (text(&c.unit), TEXT), (target, ""), (optional(c.model), ""), (error, ""), met]
    };
    let head = [(kind, TEXT), ("unit", TEXT), ("target", ""), ("model", ""), ("relative error", ""), ("verdict", TEXT)];
    table(
        heading,
        "Target with its standard deviation where it is known; relative error = model / target \u{2212} 1.",
        &head,
        &list.iter().map(row).collect::<Vec<_>>(),
    )
}

fn parameters(list: &[ParameterLine]) -> String {
    let with_truth = list.iter().any(|p| p.truth.is_some());
    let row = |p: &ParameterLine| {
        let open = |end: Option<f64>| end.map_or_else(|| "open".to_owned(), number);
        let verdict = (text(&p.verdict), if p.verdict == super::IDENTIFIED { "t good" } else { "t bad" });
        let name = (format!("<code>{}</code>", text(&p.name).replace('_', "_<wbr>")), TEXT);
        let interval = format!("{} to {}", open(p.lower_95), open(p.upper_95));
        let mut cells = vec![name, (text(&p.symbol), TEXT), (text(&p.unit), TEXT), (number(p.estimate), ""), (interval, ""), verdict];
        if with_truth {
            cells.push((optional(p.truth), ""));
        }
        cells
    };
    let mut head = vec![("parameter", TEXT), ("symbol", TEXT), ("unit", TEXT), ("estimate", ""), ("95 % interval", ""), ("verdict", TEXT)];
    if with_truth {
        head.push(("truth (synthetic)", ""));
    }
    table("Parameters", "An open end means that the data set no bound there.", &head, &list.iter().map(row).collect::<Vec<_>>())
}

fn quality(report: &Report) -> String {
    let row = |r: &RecordingLine| {
        let noise = optional(r.noise_m.map(|n| n * 1e6));
        let source = if r.synthetic { "synthetic" } else { "camera" };
        let missing = format!("{:.1} %", 100.0 * r.missing);
        vec![(text(&r.name), TEXT), (source.to_owned(), TEXT), (number(r.frame_rate_hz), ""), (r.frames.to_string(), ""), (missing, ""), (noise, "")]
    };
    let head = [("recording", TEXT), ("source", TEXT), ("frames/s", ""), ("frames", ""), ("missing", ""), ("noise, \u{b5}m", "")];
    table(
        "Data",
        "Noise is the standard deviation of the tracked position. Missing frames stay missing; gaps of up to four frames are bridged for spectra alone.",
        &head,
        &report.recordings.iter().map(row).collect::<Vec<_>>(),
    )
}

fn facts(heading: &str, list: &[Fact]) -> String {
    let items: String = list.iter().map(|f| format!("<dt>{}</dt><dd>{}</dd>\n", text(&f.name), text(&f.value))).collect();
    if list.is_empty() { String::new() } else { format!("<h2>{heading}</h2>\n<dl>\n{items}</dl>\n") }
}

fn notes(notes: &[String]) -> String {
    let items: String = notes.iter().map(|n| format!("<li>{}</li>\n", text(n))).collect();
    if notes.is_empty() { String::new() } else { format!("<h2>Reservations</h2>\n<ul>\n{items}</ul>\n") }
}

fn provenance(report: &Report) -> String {
    let p = &report.provenance;
    let fact = |name: &str, value: String| Fact { name: name.to_owned(), value };
    let mut list = vec![fact("wiperlab", p.version.clone())];
    list.extend(p.seed.map(|seed| fact("seed", seed.to_string())));
    list.push(fact("fingerprint", p.fingerprint.clone()));
    list.extend(p.files.iter().map(|f| fact(&f.name, format!("SHA-256 {}", f.sha256))));
    list.retain(|f| !f.value.is_empty());
    let mut html = facts("Provenance", &list);
    if !p.commands.is_empty() {
        html.push_str(&format!("<p>To make it again:</p>\n<pre>{}</pre>\n", text(&p.commands.join("\n"))));
    }
    html
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_from_files_stay_text() {
        let hostile = "<script>alert('x')</script> & \"q\"\u{7}".to_owned();
        let report = Report {
            title: hostile.clone(),
            ending: hostile.clone(),
            status: hostile.clone(),
            recordings: vec![RecordingLine { name: hostile.clone(), synthetic: true, ..RecordingLine::default() }],
            components: vec![Comparison { name: hostile.clone(), unit: hostile.clone(), ..Comparison::default() }],
            parameters: vec![ParameterLine {
                name: hostile.clone(),
                symbol: hostile.clone(),
                unit: hostile.clone(),
                verdict: hostile.clone(),
                ..ParameterLine::default()
            }],
            best_run: vec![Fact { name: hostile.clone(), value: hostile.clone() }],
            notes: vec![hostile.clone()],
            ..Report::default()
        };
        let html = page(&report);
        assert!(!html.contains("<script") && !html.contains('\u{7}') && !html.contains("'x'"));
        assert!(html.contains("&lt;script&gt;"));
    }

    #[test]
    fn the_page_stands_alone_and_leads_with_the_verdict() {
        let report = Report { title: "t".to_owned(), components: vec![Comparison { name: "low".to_owned(), ..Comparison::default() }], ..Report::default() };
        let html = page(&report);
        assert!(!html.contains("http") && !html.contains("src="));
        let (verdict, table) = (html.find("class=\"verdict\"").unwrap(), html.find("<table ").unwrap());
        assert!(verdict < table);
        assert!(html.contains("Only published numbers were fitted") && !html.contains("class=\"synthetic\""));
        assert_eq!(html, page(&report));
    }

    #[test]
    fn synthetic_data_carry_a_banner_and_the_truth() {
        let report = Report {
            recordings: vec![RecordingLine { name: "twin".to_owned(), synthetic: true, ..RecordingLine::default() }],
            parameters: vec![ParameterLine { truth: Some(0.5), ..ParameterLine::default() }],
            ..Report::default()
        };
        let html = page(&report);
        assert!(html.contains("Synthetic data: no camera took twin.") && html.contains("truth (synthetic)"));
    }

    #[test]
    fn numbers_have_four_digits_and_true_minus_signs() {
        assert_eq!([78.4, 900.0, 0.0, -0.0123456].map(number), ["78.40", "900.0", "0.000", "\u{2212}0.01235"]);
        assert_eq!(number(-1.23456e-7), "\u{2212}1.235\u{b7}10<sup>\u{2212}7</sup>");
        assert_eq!(number(f64::NAN), "\u{2013}");
    }
}
