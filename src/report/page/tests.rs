use super::*;
use crate::compare::{ParameterLine, TargetComparison, TrueValue};
use crate::figures::{Drawing, FigureBlock};
use crate::fit::law::{LawComparison, LawVerdict};
use crate::fit::misfit::{ChannelMisfit, TraceMisfit, WorstSegment};
use crate::fit::result::{FitStatus, NuisanceResult};
use crate::recording::quality::{Check, Grade, QualityFinding, Severity};
use crate::recording::{FrameGrid, Recording, Traces};
use crate::report::{
    CombinationLine, FailureCount, FigureGroup, ProbeLine, Provenance, RecordingLine, RunSummary, SearchLine,
    SourceFile,
};
use crate::stability::chatter::ChatterSummary;

pub(in crate::report) fn recording(name: &str, synthetic: bool) -> RecordingLine {
    let still = vec![Some(0.0); 10];
    let traces = Traces {
        tip_x_m: still.clone(),
        tip_y_m: still.clone(),
        head_x_m: still.clone(),
        head_y_m: still,
        ..Traces::default()
    };
    let recording =
        Recording::new(name, FrameGrid { start_s: 0.0, frame_rate_hz: 1e3, frames: 10 }, traces, synthetic)
            .unwrap();
    let findings = vec![
        QualityFinding::new(Check::Gaps, Severity::Caution, 3.0, name, name.to_owned())
            .on_channel(name)
            .with_advice(name),
    ];
    let measurements = crate::recording::quality::measure_quality(&recording, None);
    RecordingLine {
        name: name.to_owned(),
        synthetic,
        exports: vec![name.to_owned()],
        grade: Grade::Good,
        measurements,
        findings,
        verdict: vec![name.to_owned()],
    }
}

/// A page without its script, which is its last element.
fn without_script(html: &str) -> &str {
    let (before, script) = html.rsplit_once("<script>").unwrap();
    for foreign in
        ["http", "fetch(", "XMLHttp", "import(", "eval", "innerHTML", "<script", "storage", "cookie"]
    {
        assert!(!script.contains(foreign), "{foreign}");
    }
    before
}

/// A report in which every text is `t`.
fn everywhere(t: &str) -> Report {
    let own = || t.to_owned();
    let comparison = || TargetComparison {
        name: own(),
        condition: Some(own()),
        unit: own(),
        missing: Some(own()),
        ..TargetComparison::default()
    };
    let truth = Some(TrueValue { value: 1.0, inside_95: false });
    Report {
        title: own(),
        search: SearchLine {
            status: Some(FitStatus::Failed),
            failed: vec![FailureCount { reason: own(), count: 1 }],
            ..SearchLine::default()
        },
        findings: Vec::new(),
        recordings: vec![recording(t, true)],
        components: vec![comparison()],
        features: vec![comparison()],
        held_out: vec![comparison()],
        parameters: vec![ParameterLine {
            name: own(),
            symbol: own(),
            unit: own(),
            why: Some(own()),
            truth,
            ..ParameterLine::default()
        }],
        misfit: Some(TraceMisfit {
            reasons: vec![own()],
            channels: vec![ChannelMisfit {
                recording: own(),
                channel: own(),
                worst: vec![WorstSegment { start_s: 0.1, end_s: 0.2, chi2_per_dof: 3.0 }],
                ..ChannelMisfit::default()
            }],
            ..TraceMisfit::default()
        }),
        nuisances: vec![NuisanceResult {
            recording: Some(own()),
            name: own(),
            prior: Some(0.0),
            prior_sd: Some(1.0),
            estimate: 0.1,
            lower_95: None,
            upper_95: None,
        }],
        friction: Vec::new(),
        law: Some(LawComparison {
            verdict: LawVerdict::Undecided,
            chosen: Some(own()),
            sentence: own(),
            candidates: Vec::new(),
        }),
        chatter: Some(ChatterSummary { sentences: vec![own()], ..ChatterSummary::default() }),
        combinations: vec![CombinationLine { words: own(), determined: false, sd_relative: 0.1 }],
        advice: vec![own()],
        comparison: Vec::new(),
        tables: Vec::new(),
        runs: vec![RunSummary { name: own(), ..RunSummary::default() }],
        gate: vec![ProbeLine { determines: vec![own()], failure: Some(own()), ..ProbeLine::default() }],
        gate_notes: vec![own()],
        figures: vec![FigureGroup {
            subject: FigureSubject::Blade,
            figures: vec![FigureBlock {
                condition: None,
                file: own(),
                caption: own(),
                details: own(),
                drawing: Drawing::default(),
            }],
        }],
        notes: vec![own()],
        provenance: Provenance {
            version: own(),
            seed: Some(1),
            fingerprint: own(),
            files: vec![SourceFile { kind: own(), name: own(), sha256: own(), synthetic: true }],
            commands: vec![own()],
        },
    }
}

/// The law of friction, and where and why the blade chatters, are in the answer of the page and among the
/// lines of the terminal.
#[test]
fn the_page_and_the_terminal_name_the_law_and_say_why_the_blade_chatters() {
    let sentences = vec!["It chatters.".to_owned(), "At 1 m/s, on the neck.".to_owned()];
    let law = "Law of friction: undecided.".to_owned();
    let report = Report {
        law: Some(LawComparison {
            verdict: LawVerdict::Undecided,
            chosen: None,
            sentence: law.clone(),
            candidates: Vec::new(),
        }),
        chatter: Some(ChatterSummary { sentences, ..ChatterSummary::default() }),
        ..Report::default()
    };
    // (a slash is written as an entity)
    let html = summary_html(&report);
    assert!(html.contains("<p>It chatters. At 1 m") && html.contains("s, on the neck.</p>"), "{html}");
    assert!(html.contains("<p>Law of friction: undecided.</p>"), "{html}");
    let lines = crate::report::verdict::ReportVerdict::from_report(&report).summary();
    assert!(lines.iter().any(|line| line.starts_with(&law)), "{lines:?}");
    assert!(lines.iter().any(|line| line.starts_with("It chatters. At 1 m/s, on the neck")), "{lines:?}");
    assert!(!summary_html(&Report::default()).contains("<p></p>"));
}

#[test]
fn names_from_files_stay_text_wherever_they_stand() {
    for hostile in [
        "<script>alert('x')</script> & \"q\"\u{7}\u{202e}",
        "`<img src=x onerror=alert(1)>`",
        "\u{5e9}\u{5dc}\u{5d5}\u{5dd} \u{1f600}<b>",
    ] {
        let html = render_page(&everywhere(hostile));
        let html = without_script(&html);
        for bad in ["<script", "<img", "<b>\u{5e9}", "'x'", "\u{7}", "\u{202e}", "\"q\"", "<b></"] {
            assert!(!html.contains(bad), "{bad:?} of {hostile:?}");
        }
        assert!(html.contains("&lt;"));
    }
}

#[test]
fn names_that_users_chose_are_isolated_from_the_words_beside_them() {
    let named = |k: usize| format!("\u{5e9}{k}");
    let comparison = |k| TargetComparison {
        name: named(k),
        condition: Some(named(k + 10)),
        ..TargetComparison::default()
    };
    let report = Report {
        title: named(1),
        recordings: vec![RecordingLine { exports: vec![named(2)], ..recording(&named(3), true) }],
        components: vec![comparison(4)],
        features: vec![comparison(5)],
        held_out: vec![comparison(6)],
        runs: vec![RunSummary { name: named(7), ..RunSummary::default() }],
        provenance: Provenance {
            files: vec![SourceFile { name: named(8), ..SourceFile::default() }],
            ..Provenance::default()
        },
        ..Report::default()
    };
    let html = render_page(&report);
    for k in [1, 2, 3, 4, 5, 6, 7, 8, 14, 15, 16] {
        assert!(html.contains(&format!("<bdi>{}</bdi>", named(k))), "{k}");
    }
    for (from, to) in [("class=\"headline", "<table"), ("class=\"verdict\"", "id=\"features\"")] {
        let part = &html[html.find(from).unwrap()..];
        let part = &part[..part.find(to).unwrap()];
        assert!(part.contains('\u{5e9}'), "{from}");
        assert_eq!(part.matches('\u{5e9}').count(), part.matches("<bdi>\u{5e9}").count(), "{from}");
    }
}

#[test]
fn the_page_stands_alone_and_leads_with_the_answer() {
    let report = Report {
        title: "t".to_owned(),
        components: vec![TargetComparison { name: "low".to_owned(), ..TargetComparison::default() }],
        ..Report::default()
    };
    let html = render_page(&report);
    for asked in ["http", "src=", "url(", "@import"] {
        assert!(!without_script(&html).contains(asked), "{asked}");
    }
    let at = |part: &str| html.find(part).unwrap_or_else(|| panic!("{part}"));
    let order = ["class=\"headline", "<strong>Next:", "<table", "class=\"verdict\""].map(at);
    assert!(order.is_sorted(), "{order:?}");
    assert!(
        html.contains("No recording was compared.")
            && html.contains("no recording: the traces shown are the model")
    );
    assert_eq!(html, render_page(&report));
}

#[test]
fn synthetic_data_carry_a_banner_and_the_truth() {
    let truth = Some(TrueValue { value: 0.5, inside_95: true });
    let report = Report {
        recordings: vec![recording("twin", true)],
        parameters: vec![ParameterLine { truth, ..ParameterLine::default() }],
        ..Report::default()
    };
    let html = render_page(&report);
    assert!(
        html.contains("Synthetic data: no camera took <bdi>twin</bdi>.")
            && html.contains("truth (synthetic)")
    );
    let measured = render_page(&Report { recordings: vec![recording("film", false)], ..Report::default() });
    assert!(!measured.contains("class=\"banner\"") && !measured.contains("synthetic"));
}

#[test]
fn hard_events_that_did_not_happen_are_said_to_be_none() {
    let quiet = RunSummary { name: "slow".to_owned(), ..RunSummary::default() };
    let lost = RunSummary {
        name: "fast".to_owned(),
        status: crate::simulate::RunStatus::ContactLost,
        contact_losses: 1,
        ..RunSummary::default()
    };
    let html = render_page(&Report { runs: vec![quiet, lost], ..Report::default() });
    assert!(
        html.contains(
            "<th role=\"rowheader\" scope=\"row\" class=\"t\">loss of contact</th><td role=\"cell\" \
                           class=\"t\"><i><bdi>slow</bdi></i> none</td><td role=\"cell\" class=\"t \
                           bad\"><i><bdi>fast</bdi></i> 1</td>"
        ),
        "{html}"
    );
    assert!(html.contains("The best model&#x27;s run in <bdi>fast</bdi> ended early"), "{html}");
    for event in ["impact on the glass", "jam (", "indeterminate contact", "chattering"] {
        let row = html.split(event).nth(1).unwrap();
        assert!(row[..row.find("</tr>").unwrap()].matches("</i> none<").count() == 2, "{event}");
    }
}

/// Levels of the headings, in order.
fn headings(html: &str) -> Vec<u8> {
    html.match_indices("<h")
        .filter_map(|(at, _)| html.as_bytes().get(at + 2).filter(|b| b.is_ascii_digit()).map(|b| b - b'0'))
        .collect()
}

#[test]
fn the_page_can_be_read_by_ear_and_by_keyboard() {
    let html = render_page(&everywhere("x"));
    let levels = headings(&html);
    assert!(
        levels[0] == 1
            && levels.iter().filter(|l| **l == 1).count() == 1
            && levels.windows(2).all(|pair| pair[1] <= pair[0] + 1),
        "{levels:?}"
    );
    assert_eq!(html.matches("<table").count(), html.matches("<caption>").count());
    let heads = |role: &str| html.matches(&format!("<th role=\"{role}\" scope=\"")).count();
    assert_eq!(html.matches("<th ").count(), heads("columnheader") + heads("rowheader"));
    assert_eq!(html.matches("<td ").count(), html.matches("<td role=\"cell\"").count());
    for at in html.match_indices("tabindex=\"0\"").map(|(at, _)| at) {
        let tag = &html[at..at + html[at..].find('>').unwrap()];
        assert!(tag.contains("role=") && tag.contains("aria-label="), "{tag}");
    }
    assert!(html.contains("<html lang=\"en\">") && html.contains("role=\"img\" aria-label="));
    for link in html.split("href=\"#").skip(1).map(|rest| &rest[..rest.find('"').unwrap()]) {
        assert!(html.contains(&format!("id=\"{link}\"")), "{link}");
    }
}

/// Relative luminance of `#rrggbb` (WCAG 2.2).
fn luminance(colour: &str) -> f64 {
    let channel = |at: usize| {
        let c = f64::from(u8::from_str_radix(&colour[at..at + 2], 16).unwrap()) / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    };
    0.2126 * channel(1) + 0.7152 * channel(3) + 0.0722 * channel(5)
}

#[test]
fn every_text_has_the_contrast_of_wcag_aa_in_every_scheme() {
    let schemes: Vec<&str> = include_str!("../page.css")
        .split(":root{")
        .skip(1)
        .map(|rest| &rest[..rest.find('}').unwrap()])
        .collect();
    assert_eq!(schemes.len(), 3, "light, dark, print");
    for scheme in schemes {
        let colour =
            |name: &str| scheme.split(';').find_map(|d| d.strip_prefix(&format!("--{name}:"))).unwrap();
        for (text, ground) in
            ["text", "soft", "good", "bad", "link"].iter().flat_map(|t| [(t, "ground"), (t, "card")])
        {
            let (a, b) = (luminance(colour(text)), luminance(colour(ground)));
            let ratio = (a.max(b) + 0.05) / (a.min(b) + 0.05);
            assert!(ratio >= 4.5, "{text} on {ground}: {ratio:.2} in {scheme}");
        }
    }
}

#[test]
fn a_force_that_vanishes_is_zero_and_twins_too_few_for_an_interval_are_said_to_be() {
    let report = |twins: usize, force: f64| Report {
        search: SearchLine { status: Some(FitStatus::Converged), twins, ..SearchLine::default() },
        parameters: vec![ParameterLine { name: "friction.a".to_owned(), ..ParameterLine::default() }],
        runs: vec![RunSummary {
            name: "r".to_owned(),
            least_normal_force_n: Some(force),
            ..RunSummary::default()
        }],
        ..Report::default()
    };
    let few = render_page(&report(3, -3.8e-12));
    assert!(few.contains(" too few twins<") && !few.contains(" no twins<"));
    assert!(few.contains(" 0 N<"));
    let none = render_page(&report(0, 0.0669));
    assert!(none.contains(" no twins<") && none.contains(" 0.06690 N<"));
}
