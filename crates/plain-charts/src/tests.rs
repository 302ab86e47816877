use super::*;

fn figure(points: Vec<Option<(f64, f64)>>, title: &str) -> Figure {
    let series = Series {
        label: title.to_owned(),
        colour: Colour::Blue,
        mark: Mark::Line,
        points,
        ..Series::default()
    };
    let rule = VerticalLine {
        label: title.to_owned(),
        colour: Colour::Grey,
        mark: Mark::Dashed,
        at: 0.5,
        above: None,
    };
    let x = ChartAxis::linear("x").with_range(0.0, 1.0);
    let y = ChartAxis::linear(title).with_range(0.0, 1.0);
    let panel =
        Panel { x, y, height_mm: 30.0, series: vec![series], vertical_lines: vec![rule], ..Panel::default() };
    Figure {
        title: title.to_owned(),
        subtitle: title.to_owned(),
        description: title.to_owned(),
        width_mm: FULL_WIDTH_MM,
        panels: vec![panel],
        ..Figure::default()
    }
}

fn as_svg(figure: &Figure) -> String {
    figure.to_svg(Medium::Screen)
}

/// The drawn lines of a colour and stroke width, as lists of points.
fn lines(svg: &str, colour: &str, width: u32) -> Vec<Vec<(f64, f64)>> {
    let look = format!("stroke=\"{colour}\" stroke-width=\"{width}\" d=\"");
    let paths = svg
        .lines()
        .filter_map(|line| line.strip_prefix("<path fill=\"none\" ")?.split_once(&look))
        .map(|(_, data)| data);
    paths.flat_map(|data| data.trim_end_matches("\"/>").split('M').skip(1)).map(points).collect()
}

/// The points of SVG path data, which consist of a start and relative steps.
fn points(data: &str) -> Vec<(f64, f64)> {
    let spaced = data.replace('l', " ").replace('-', " -");
    let numbers: Vec<f64> = spaced.split_whitespace().map(|n| n.parse().unwrap()).collect();
    let steps = numbers.chunks(2).scan((0.0, 0.0), |at, step| {
        *at = (at.0 + step[0], at.1 + step[1]);
        Some(*at)
    });
    steps.collect()
}

#[test]
fn text_from_files_is_escaped_everywhere() {
    let drawn =
        as_svg(&figure(vec![Some((0.0, 0.0)), Some((1.0, 1.0))], "<script>\"a\" & 'b'</script>\u{1}"));
    assert!(
        !drawn.contains("<script")
            && !drawn.contains("\"a\"")
            && !drawn.contains("& ")
            && !drawn.contains('\u{1}')
    );
    assert!(drawn.matches("&lt;script&gt;").count() >= 6);
}

#[test]
fn the_figure_has_its_width_in_millimetres_and_a_name() {
    let drawn = as_svg(&figure(vec![], "a name"));
    assert!(drawn.starts_with(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-label=\"a name. a name\" width=\"170.00mm\""
    ));
    assert!(
        drawn.contains("viewBox=\"0 0 2550 ")
            && drawn.contains("<title>a name</title>")
            && drawn.contains("<desc>")
    );
}

#[test]
fn gaps_and_values_that_are_no_numbers_split_a_line() {
    let points = vec![
        Some((0.0, 0.1)),
        Some((0.2, 0.1)),
        None,
        Some((0.4, 0.1)),
        Some((0.5, 0.1)),
        Some((0.6, f64::NAN)),
        Some((0.7, 0.1)),
        Some((0.8, 0.1)),
    ];
    let drawn = as_svg(&figure(points, ""));
    assert_eq!(lines(&drawn, "#0072B2", 5).len(), 3);
}

#[test]
fn a_line_is_cut_at_the_frame_and_not_bent() {
    let drawn = as_svg(&figure(vec![Some((0.0, -1.0)), Some((1.0, 2.0))], ""));
    let line = lines(&drawn, "#0072B2", 5).remove(0);
    let frame = lines(&drawn, "#333333", 3).into_iter().find(|l| l.len() == 5).unwrap();
    let ((left, top), (right, bottom)) = (frame[0], frame[2]);
    let third = (right - left) / 3.0;
    let expected = [(left + third, bottom), (right - third, top)];
    let near = |(found, expected): (&(f64, f64), (f64, f64))| {
        (found.0 - expected.0).abs() <= 1.0 && (found.1 - expected.1).abs() <= 1.0
    };
    assert!(line.iter().zip(expected).all(near), "{line:?} {expected:?}");
}

#[test]
fn error_bars_have_caps_but_where_they_are_cut() {
    let count = |y: ChartAxis, bar| {
        let mut figure = figure(vec![Some((0.5, 0.5))], "");
        let panel = &mut figure.panels[0];
        (panel.y, panel.series[0].error_bars, panel.series[0].mark) = (y, vec![bar], Mark::Circles);
        lines(&as_svg(&figure), "#0072B2", 3).len()
    };
    let linear = || ChartAxis::linear("y").with_range(0.0, 1.0);
    assert_eq!(count(linear(), ErrorBar::Vertical { x: 0.5, from: 0.2, to: 0.7 }), 3);
    assert_eq!(count(linear(), ErrorBar::Horizontal { y: 0.5, from: 0.2, to: 1.7 }), 2);
    assert_eq!(count(linear(), ErrorBar::Horizontal { y: 1.5, from: 0.2, to: 0.7 }), 0);
    assert_eq!(count(linear(), ErrorBar::Vertical { x: 0.5, from: f64::NAN, to: 0.7 }), 0);
    assert_eq!(
        count(ChartAxis::log("y").with_range(0.1, 1.0), ErrorBar::Vertical { x: 0.5, from: -0.2, to: 0.7 }),
        2
    );
}

#[test]
fn a_million_points_are_drawn_in_few_bytes() {
    let points = (0..1_000_000)
        .map(|i| Some((f64::from(i) * 1e-6, f64::from(i % 1000 * 7919 % 1000) * 1e-3)))
        .collect();
    let drawn = as_svg(&figure(points, ""));
    assert!(drawn.len() < 60_000, "{}", drawn.len());
}

#[test]
fn the_same_figure_gives_the_same_bytes_also_in_one_column() {
    let narrow =
        Figure { width_mm: COLUMN_WIDTH_MM, ..figure(vec![Some((0.0, 0.5)), Some((1.0, 0.5))], "t") };
    assert_eq!(as_svg(&narrow), as_svg(&narrow));
    assert!(as_svg(&narrow).contains("width=\"85.00mm\""));
}

#[test]
fn every_point_is_drawn_also_one_between_two_gaps() {
    // two single points, at 2 and 8, and a pair of neighbours, at 5 and 6
    let at = |i: u32| Some((0.1 * f64::from(i), 0.5));
    let alone = |mark| {
        let mut drawn = figure(vec![None, at(2), None, at(5), at(6), None, at(8)], "y");
        drawn.panels[0].series[0].mark = mark;
        drawn.panels[0].series[0].label.clear();
        as_svg(&drawn)
    };
    let dots = |svg: &str| svg.matches("h0").count() + svg.matches("<circle").count();
    for mark in [Mark::Line, Mark::Thin, Mark::Thick, Mark::Dashed, Mark::Dotted] {
        assert_eq!(dots(&alone(mark)), 2, "{mark:?}");
    }
}
