//! Fewer bytes for the same picture: neighbouring lines of one look become one path in relative coordinates,
//! neighbouring rectangles likewise.

use std::fmt::Write;

/// Whole units of the canvas.
type Whole = (i64, i64);

/// One element of the back end, as far as it can share a path with its neighbours.
enum Element<'a> {
    /// Look and points.
    Line(&'a str, Vec<Whole>),
    /// Look, corner and size.
    Rectangle(&'a str, Whole, Whole),
    /// Radius and colour of a full circle, and its middle.
    Dot((i64, &'a str), Whole),
    /// As it stands.
    Other(&'a str),
}

/// The elements of the back end, one a line, with neighbours of one look as one path.
pub(super) fn compact(drawn: &str) -> String {
    let elements: Vec<Element<'_>> = drawn.lines().filter(|line| !line.is_empty()).map(element).collect();
    let mut text = String::with_capacity(drawn.len() / 2);
    for group in elements.chunk_by(alike) {
        match group.first() {
            Some(Element::Line(look, _)) => {
                path(&mut text, look, group.iter().flat_map(points).map(line_data))
            }
            Some(Element::Rectangle(look, ..)) => {
                path(&mut text, look, group.iter().filter_map(rectangle_data))
            }
            Some(Element::Dot((radius, colour), _)) => {
                dots(&mut text, *radius, colour, group.iter().filter_map(dot_data))
            }
            Some(Element::Other(line)) => {
                // a line of text has no `<`: its words stay as they are
                if line.starts_with('<') {
                    text.push_str(&line.replace(" opacity=\"1\"", ""));
                } else {
                    text.push_str(line);
                }
                text.push('\n');
            }
            None => {}
        }
    }
    text
}

fn alike(a: &Element<'_>, b: &Element<'_>) -> bool {
    match (a, b) {
        (Element::Line(a, _), Element::Line(b, _))
        | (Element::Rectangle(a, ..), Element::Rectangle(b, ..)) => a == b,
        (Element::Dot(a, _), Element::Dot(b, _)) => a == b,
        _ => false,
    }
}

fn element(line: &str) -> Element<'_> {
    let known = || {
        if let Some(rest) = line.strip_prefix("<polyline ") {
            let (look, points) = rest.split_once(" points=\"")?;
            let points: Option<Vec<Whole>> =
                points.strip_suffix("\"/>")?.split_whitespace().map(whole).collect();
            return Some(Element::Line(look, points?));
        }
        if let Some(rest) = line.strip_prefix("<circle ") {
            let (numbers, look) = rest.split_once(" opacity=\"1\" fill=\"")?;
            let (colour, rest) = look.split_once('"')?;
            let [x, y, radius] = whole_numbers(numbers).try_into().ok()?;
            return (rest.contains("stroke=\"none\"") && colour != "none")
                .then_some(Element::Dot((radius, colour), (x, y)));
        }
        let (numbers, look) = line.strip_prefix("<rect ")?.split_once(" opacity=\"")?;
        let [x, y, width, height] = whole_numbers(numbers).try_into().ok()?;
        let look = look.strip_suffix("/>")?;
        look.contains(" stroke=\"none\"").then_some(Element::Rectangle(look, (x, y), (width, height)))
    };
    known().unwrap_or(Element::Other(line))
}

/// The values of attributes.
fn whole_numbers(attributes: &str) -> Vec<i64> {
    attributes.split('"').filter_map(|part| part.parse().ok()).collect()
}

fn whole(point: &str) -> Option<Whole> {
    let (x, y) = point.split_once(',')?;
    Some((x.parse().ok()?, y.parse().ok()?))
}

fn points<'a>(element: &'a Element<'_>) -> Option<&'a [Whole]> {
    match element {
        Element::Line(_, points) => Some(points),
        _ => None,
    }
}

/// A path of that look; that of a rectangle begins with the value of its opacity.
fn path(text: &mut String, look: &str, data: impl Iterator<Item = String>) {
    let look = if look.starts_with("fill=") { look.to_owned() } else { format!("opacity=\"{look}") };
    let look =
        look.replace(" opacity=\"1\"", "").replace("opacity=\"1\" ", "").replace(" stroke=\"none\"", "");
    let _ = writeln!(text, "<path {} d=\"{}\"/>", look.trim(), data.collect::<String>()); // (a string takes everything)
}

/// Dots as lines without length and with round ends.
fn dots(text: &mut String, radius: i64, colour: &str, data: impl Iterator<Item = String>) {
    let data = data.collect::<String>();
    let _ = writeln!(
        text,
        "<path stroke=\"{colour}\" stroke-width=\"{}\" stroke-linecap=\"round\" d=\"{data}\"/>",
        2 * radius
    ); // (as above)
}

fn dot_data(element: &Element<'_>) -> Option<String> {
    match element {
        Element::Dot(_, (x, y)) => Some(format!("M{x} {y}h0")),
        _ => None,
    }
}

/// Start in the units of the canvas, then steps.
fn line_data(points: &[Whole]) -> String {
    let Some((first, rest)) = points.split_first() else { return String::new() };
    let mut data = format!("M{} {}", first.0, first.1);
    let mut last = *first;
    for (index, point) in rest.iter().enumerate() {
        let (dx, dy) = (point.0 - last.0, point.1 - last.1);
        let before = if index == 0 {
            "l"
        } else if dx < 0 {
            ""
        } else {
            " "
        };
        let between = if dy < 0 { "" } else { " " };
        let _ = write!(data, "{before}{dx}{between}{dy}");
        last = *point;
    }
    data
}

fn rectangle_data(element: &Element<'_>) -> Option<String> {
    match element {
        Element::Rectangle(_, (x, y), (width, height)) => {
            Some(format!("M{x} {y}h{width}v{height}h-{width}z"))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_of_one_look_become_one_path() {
        let line = |colour: &str, points: &str| {
            format!(
                "<polyline fill=\"none\" opacity=\"1\" stroke=\"{colour}\" stroke-width=\"5\" points=\"{points} \"/>\n"
            )
        };
        let drawn = [
            line("#000000", "1,2 3,1"),
            line("#000000", "5,5 6,7 4,8"),
            line("#0072B2", "1,1 2,2"),
            "<text>a</text>\n".to_owned(),
        ]
        .concat();
        let expected = "<path fill=\"none\" stroke=\"#000000\" stroke-width=\"5\" d=\"M1 2l2-1M5 5l1 2-2 1\"/>\n\
                        <path fill=\"none\" stroke=\"#0072B2\" stroke-width=\"5\" d=\"M1 1l1 1\"/>\n<text>a</text>\n";
        assert_eq!(compact(&drawn), expected);
    }

    #[test]
    fn full_circles_become_dots_and_others_stay() {
        let circle = |x: i32, fill: &str, stroke: &str| {
            format!(
                "<circle cx=\"{x}\" cy=\"7\" r=\"4\" opacity=\"1\" fill=\"{fill}\" stroke=\"{stroke}\" stroke-width=\"4\"/>\n"
            )
        };
        let drawn =
            [circle(1, "#808080", "none"), circle(9, "#808080", "none"), circle(5, "none", "#000000")]
                .concat();
        let expected = "<path stroke=\"#808080\" stroke-width=\"8\" stroke-linecap=\"round\" d=\"M1 7h0M9 7h0\"/>\n\
                        <circle cx=\"5\" cy=\"7\" r=\"4\" fill=\"none\" stroke=\"#000000\" stroke-width=\"4\"/>\n";
        assert_eq!(compact(&drawn), expected);
    }

    #[test]
    fn rectangles_keep_their_opacity() {
        let rectangle = |x: i32| {
            format!(
                "<rect x=\"{x}\" y=\"2\" width=\"3\" height=\"4\" opacity=\"0.22\" fill=\"#56B4E9\" stroke=\"none\"/>\n"
            )
        };
        let expected = "<path opacity=\"0.22\" fill=\"#56B4E9\" d=\"M1 2h3v4h-3zM9 2h3v4h-3z\"/>\n";
        assert_eq!(compact(&[rectangle(1), rectangle(9)].concat()), expected);
    }
}
