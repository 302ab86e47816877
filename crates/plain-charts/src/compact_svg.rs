//! A back end for the crate `plotters` that writes compact SVG: consecutive lines, rectangles or dots of the
//! same style are merged into one path. The SVG back end of `plotters` itself writes one element for each.

use super::path::CanvasArea;
use super::style::format_hex;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use plotters::prelude::DrawingBackend;
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingErrorKind, FontStyle, FontTransform,
};
use std::convert::Infallible;
use std::fmt::Write;

/// Result of a drawing call; it never fails, because writing into a string cannot fail.
type DrawResult = Result<(), DrawingErrorKind<Infallible>>;

/// The SVG elements drawn so far.
pub(super) struct CompactSvg {
    size: (u32, u32),
    elements: String,
    /// Style attributes of the open path; the next shape with the same attributes is appended to this path.
    open: Option<String>,
}

impl CompactSvg {
    pub(crate) fn new(size: (u32, u32)) -> Self {
        Self { size, elements: String::new(), open: None }
    }

    /// The SVG elements as text, one per line.
    pub(crate) fn into_elements(mut self) -> String {
        self.close_path();
        self.elements
    }

    fn close_path(&mut self) {
        if self.open.take().is_some() {
            self.elements.push_str("\"/>\n");
        }
    }

    fn append_path(&mut self, look: String, data: &str) -> DrawResult {
        if self.open.as_ref() != Some(&look) {
            self.close_path();
            self.elements.push_str(&format!("<path {look} d=\""));
            self.open = Some(look);
        }
        self.elements.push_str(data);
        Ok(())
    }

    /// Opens an SVG group with the given attributes.
    pub(crate) fn open_group(&mut self, attributes: &str) {
        self.close_path();
        self.elements.push_str(&format!("<g {attributes}>\n"));
    }

    /// Closes the last open group.
    pub(crate) fn close_group(&mut self) {
        self.close_path();
        self.elements.push_str("</g>\n");
    }

    /// Appends a PNG image that fills `area` and is clipped to `within`, with its bytes as base64 text. If
    /// not `smooth`, viewers are asked not to interpolate between pixels.
    pub(crate) fn append_png(&mut self, area: &CanvasArea, within: &CanvasArea, png: &[u8], smooth: bool) {
        let rendering = if smooth { "" } else { "image-rendering=\"optimizeSpeed\" " };
        let (x, y) = (area.left - within.left, area.top - within.top);
        let _ = self.append_element(&format!(
            "<svg x=\"{:.0}\" y=\"{:.0}\" width=\"{:.0}\" height=\"{:.0}\"><image x=\"{x:.1}\" y=\"{y:.1}\" \
             width=\"{:.1}\" height=\"{:.1}\" preserveAspectRatio=\"none\" {rendering}\
             href=\"data:image/png;base64,{}\"/></svg>\n",
            within.left,
            within.top,
            within.right - within.left,
            within.bottom - within.top,
            area.right - area.left,
            area.bottom - area.top,
            STANDARD.encode(png)
        )); // (writing into a string cannot fail)
    }

    fn append_element(&mut self, element: &str) -> DrawResult {
        self.close_path();
        self.elements.push_str(element);
        Ok(())
    }
}

/// SVG attributes of a fill: colour, and opacity if it is not 1.
fn fill_attributes(colour: BackendColor) -> String {
    let opacity = if colour.alpha < 1.0 { format!("opacity=\"{}\" ", colour.alpha) } else { String::new() };
    format!("{opacity}fill=\"{}\"", format_hex(colour.rgb))
}

/// SVG path data of a line: its first point in canvas units, then the steps from point to point.
fn relative_path_data(points: impl IntoIterator<Item = BackendCoord>) -> String {
    let mut points = points.into_iter();
    let Some(mut last) = points.next() else { return String::new() };
    let mut data = format!("M{} {}", last.0, last.1);
    for (index, point) in points.enumerate() {
        let (dx, dy) = (point.0 - last.0, point.1 - last.1);
        let before = match index {
            0 => "l",
            _ if dx < 0 => "",
            _ => " ",
        };
        let between = if dy < 0 { "" } else { " " };
        let _ = write!(data, "{before}{dx}{between}{dy}");
        last = point;
    }
    data
}

impl DrawingBackend for CompactSvg {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        self.size
    }

    fn ensure_prepared(&mut self) -> DrawResult {
        Ok(())
    }

    fn present(&mut self) -> DrawResult {
        Ok(())
    }

    fn draw_pixel(&mut self, at: BackendCoord, colour: BackendColor) -> DrawResult {
        self.draw_rect(at, (at.0 + 1, at.1 + 1), &colour, true)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        points: I,
        style: &S,
    ) -> DrawResult {
        let (colour, width) = (format_hex(style.color().rgb), style.stroke_width());
        let look = format!("fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\"");
        self.append_path(look, &relative_path_data(points))
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        (left, top): BackendCoord,
        (right, bottom): BackendCoord,
        style: &S,
        _fill: bool,
    ) -> DrawResult {
        let (width, height) = (right - left, bottom - top);
        self.append_path(fill_attributes(style.color()), &format!("M{left} {top}h{width}v{height}h-{width}z"))
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        corners: I,
        style: &S,
    ) -> DrawResult {
        let corners: String = corners.into_iter().map(|(x, y)| format!("{x},{y} ")).collect();
        self.append_element(&format!("<polygon {} points=\"{corners}\"/>\n", fill_attributes(style.color())))
    }

    /// Draws a filled circle as a line of zero length with round caps.
    fn draw_circle<S: BackendStyle>(
        &mut self,
        (x, y): BackendCoord,
        radius: u32,
        style: &S,
        filled: bool,
    ) -> DrawResult {
        let (colour, width) = (format_hex(style.color().rgb), style.stroke_width());
        if filled {
            let look =
                format!("stroke=\"{colour}\" stroke-width=\"{}\" stroke-linecap=\"round\"", 2 * radius);
            return self.append_path(look, &format!("M{x} {y}h0"));
        }
        self.append_element(&format!(
            "<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" fill=\"none\" stroke=\"{colour}\" \
             stroke-width=\"{width}\"/>\n"
        ))
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, (x, y): BackendCoord) -> DrawResult {
        let anchor = match style.anchor().h_pos {
            HPos::Left => "",
            HPos::Right => " text-anchor=\"end\"",
            HPos::Center => " text-anchor=\"middle\"",
        };
        let lowered = match style.anchor().v_pos {
            VPos::Top => "0.76em",
            VPos::Center => "0.5ex",
            VPos::Bottom => "-0.5ex",
        };
        let bold = if let FontStyle::Bold = style.style() { " font-weight=\"bold\"" } else { "" };
        let turned = match style.transform() {
            FontTransform::Rotate270 => format!(" transform=\"rotate(270, {x}, {y})\""),
            _ => String::new(),
        };
        let (size, colour) = (style.size(), fill_attributes(style.color()));
        self.append_element(&format!(
            "<text x=\"{x}\" y=\"{y}\" dy=\"{lowered}\"{anchor} font-size=\"{size}\" \
             {colour}{bold}{turned}>\n{}\n</text>\n",
            quick_xml::escape::escape(text)
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plotters::style::{Color, RGBColor, ShapeStyle};

    const BLACK: RGBColor = RGBColor(0, 0, 0);
    const BLUE: RGBColor = RGBColor(0, 0x72, 0xB2);

    fn stroke(colour: RGBColor, width: u32) -> ShapeStyle {
        Color::stroke_width(&colour, width)
    }

    fn drawn(draw: impl FnOnce(&mut CompactSvg) -> DrawResult) -> String {
        let mut back = CompactSvg::new((10, 10));
        draw(&mut back).unwrap();
        back.into_elements()
    }

    #[test]
    fn neighbours_of_one_look_become_one_path() {
        let found = drawn(|back| {
            back.draw_path([(1, 2), (3, 1)], &stroke(BLACK, 5))?;
            back.draw_path([(5, 5), (6, 7), (4, 8)], &stroke(BLACK, 5))?;
            back.draw_path([(1, 1), (2, 2)], &stroke(BLUE, 5))
        });
        let expected = "<path fill=\"none\" stroke=\"#000000\" stroke-width=\"5\" d=\"M1 2l2-1M5 5l1 2-2 \
                        1\"/>\n\
                        <path fill=\"none\" stroke=\"#0072B2\" stroke-width=\"5\" d=\"M1 1l1 1\"/>\n";
        assert_eq!(found, expected);
    }

    #[test]
    fn full_circles_become_dots_and_others_stay() {
        let found = drawn(|back| {
            back.draw_circle((1, 7), 4, &BLUE, true)?;
            back.draw_circle((9, 7), 4, &BLUE, true)?;
            back.draw_circle((5, 7), 4, &stroke(BLACK, 4), false)
        });
        let expected = "<path stroke=\"#0072B2\" stroke-width=\"8\" stroke-linecap=\"round\" d=\"M1 7h0M9 \
                        7h0\"/>\n\
                        <circle cx=\"5\" cy=\"7\" r=\"4\" fill=\"none\" stroke=\"#000000\" \
                        stroke-width=\"4\"/>\n";
        assert_eq!(found, expected);
    }

    #[test]
    fn rectangles_keep_their_opacity() {
        let pale = BLUE.mix(0.22);
        let found = drawn(|back| {
            back.draw_rect((1, 2), (4, 6), &pale, true)?;
            back.draw_rect((9, 2), (12, 6), &pale, true)
        });
        assert_eq!(found, "<path opacity=\"0.22\" fill=\"#0072B2\" d=\"M1 2h3v4h-3zM9 2h3v4h-3z\"/>\n");
    }
}
