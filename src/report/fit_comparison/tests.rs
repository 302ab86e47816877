use super::interval_relation;
use super::*;
use crate::compare::{ParameterLine, TargetComparison};
use crate::fit::uncertainty::ParameterVerdict as Knowledge;
use plain_charts::{MAX_HEIGHT_MM, Medium};

fn line(verdict: Knowledge, lower_95: Option<f64>, upper_95: Option<f64>) -> ParameterLine {
    ParameterLine {
        name: "friction.c".to_owned(),
        symbol: "C".to_owned(),
        verdict,
        estimate: 0.5,
        lower_95,
        upper_95,
        ..ParameterLine::default()
    }
}

fn report(parameters: Vec<ParameterLine>, pass: bool) -> Report {
    Report {
        components: vec![TargetComparison { name: "low".to_owned(), pass, ..TargetComparison::default() }],
        parameters,
        ..Report::default()
    }
}

fn entry(name: &str, report: Report) -> ComparedFit {
    ComparedFit { name: name.to_owned(), verdict: ReportVerdict::from_report(&report), report }
}

#[test]
fn intervals_are_apart_only_where_both_ends_are_known() {
    let known = |lower, upper| line(Knowledge::Identified, Some(lower), Some(upper));
    assert_eq!(interval_relation(&known(0.1, 0.2), &known(0.3, 0.4)), IntervalRelation::Disjoint);
    assert_eq!(interval_relation(&known(0.3, 0.4), &known(0.1, 0.2)), IntervalRelation::Disjoint);
    assert_eq!(interval_relation(&known(0.1, 0.3), &known(0.3, 0.4)), IntervalRelation::Overlap);
    // an open end extends to infinity, a closed one does not
    assert_eq!(
        interval_relation(&line(Knowledge::OpenAbove, Some(0.1), None), &known(0.3, 0.4)),
        IntervalRelation::Overlap
    );
    assert_eq!(
        interval_relation(&line(Knowledge::OpenAbove, Some(0.5), None), &known(0.3, 0.4)),
        IntervalRelation::Disjoint
    );
    for verdict in [Knowledge::NotIdentified, Knowledge::AtBound] {
        assert_eq!(
            interval_relation(&line(verdict, Some(0.1), Some(0.2)), &known(0.3, 0.4)),
            IntervalRelation::NotComparable
        );
    }
}

#[test]
fn the_verdict_says_in_how_many_pairs_the_intervals_do_not_overlap() {
    let entries = [
        entry("a", report(vec![line(Knowledge::Identified, Some(0.1), Some(0.2))], true)),
        entry("b", report(vec![line(Knowledge::Identified, Some(0.3), Some(0.4))], false)),
        entry("c", report(vec![line(Knowledge::AtBound, Some(0.3), None)], true)),
        entry("d", report(vec![], true)),
    ];
    let parameters = shared_parameters(&entries);
    assert_eq!(
        (parameters.len(), parameters[0].pairs.len(), parameters[0].lines.iter().flatten().count()),
        (1, 3, 3)
    );
    let said = |entries: &[ComparedFit]| -> Vec<String> {
        comparison_statements(entries, &shared_parameters(entries))
            .iter()
            .map(Statement::plain_text)
            .collect()
    };
    let lines = said(&entries);
    assert!(
        lines[0]
            .starts_with("3 of 4 fits explain what they were fitted to: a: The model meets its one target")
            && lines[0].contains("b: The model meets 0 of 1 target"),
        "{}",
        lines[0]
    );
    assert_eq!(
        lines[1],
        "95 % intervals do not overlap in 1 of 1 pairs of estimates that can be compared: C of the friction \
         law, in 1 pair."
    );
    assert_eq!(said(&entries[2..])[1], "No two of the fits determine the same parameter");
}

#[test]
fn an_open_end_reaches_the_frame_and_the_first_fit_stands_at_the_top() {
    let entries = [
        entry("first", report(vec![line(Knowledge::OpenAbove, Some(0.4), None)], true)),
        entry("second", report(vec![line(Knowledge::Identified, Some(0.3), Some(0.6))], true)),
    ];
    let block = intervals::interval_figure(&entries, &shared_parameters(&entries)).unwrap();
    let crate::figures::Drawing::Chart(figure) = &block.drawing else { panic!("a chart") };
    let panel = &figure.panels[0];
    assert_eq!(panel.y.categories, [(0.0, "second".to_owned()), (1.0, "first".to_owned())]);
    let (low, high) = panel.x.range.unwrap();
    assert!(low < 0.3 && high > 0.6, "{low} {high}");
    let open = panel.series.iter().find(|s| s.points == [Some((0.5, 1.0))]).unwrap();
    assert!(
        matches!(open.error_bars[0], plain_charts::ErrorBar::Horizontal { y: 1.0, from: 0.4, to } if to > high),
        "{open:?}"
    );
    assert!(block.caption.contains("1 of 1 comparable pairs"), "{}", block.caption);
    assert!(intervals::interval_figure(&entries[..1], &shared_parameters(&entries[..1])).is_none());
}

#[test]
fn the_figure_of_eight_fits_fits_a_page() {
    let named = |name: &&str| ParameterLine {
        name: (*name).to_owned(),
        ..line(Knowledge::Identified, Some(0.4), Some(0.6))
    };
    let names = ["a", "b", "c", "d", "e"];
    let of = |i: usize| entry(&format!("fit {i}"), report(names.iter().map(named).collect(), true));
    let entries: Vec<ComparedFit> = (0..8).map(of).collect();
    let block = intervals::interval_figure(&entries, &shared_parameters(&entries)).unwrap();
    let crate::figures::Drawing::Chart(figure) = &block.drawing else { panic!("a chart") };
    assert!(figure.height_mm(Medium::Column) <= MAX_HEIGHT_MM, "{}", figure.height_mm(Medium::Column));
    assert_eq!(figure.panels.len(), names.len());
    // 28 pairs of eight fits for each parameter
    assert!(
        block.caption.contains("140 of 140 comparable pairs of 95 % intervals overlap"),
        "{}",
        block.caption
    );
}

#[test]
fn page_and_json_of_hostile_names_are_text_and_say_the_same() {
    let hostile = "<script>\"'\u{202e}";
    let entries = vec![
        entry(hostile, report(vec![line(Knowledge::Identified, Some(0.1), Some(0.2))], true)),
        entry("\u{5e9}", report(vec![line(Knowledge::Identified, Some(0.3), None)], false)),
    ];
    let parameters = shared_parameters(&entries);
    let several = FitComparison {
        title: hostile.to_owned(),
        figure: None,
        statements: comparison_statements(&entries, &parameters),
        fits: entries,
        parameters,
    };
    let html = render_page(&several);
    let (html, _script) = html.rsplit_once("<script>").unwrap();
    assert!(!html.contains("<script") && !html.contains('\u{202e}') && html.contains("<bdi>\u{5e9}</bdi>"));
    assert!(!html.contains("http") && !html.contains("src="));
    let json: serde_json::Value = serde_json::from_str(&comparison_json(&several).unwrap()).unwrap();
    assert_eq!(
        (&json["all_components_met"], &json["fits"][0]["name"], &json["fits"][1]["all_components_met"]),
        (&false.into(), &hostile.into(), &false.into())
    );
    assert_eq!(json["parameters"][0]["pairs"][0]["relation"], "disjoint");
    assert_eq!(json["summary"][0], several.statements[0].plain_text());
}
