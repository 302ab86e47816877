//! Figures as pixels and as boxes of words, with fonts that do not depend on the system.

#![allow(dead_code)] // each test program uses a part

use epaint_default_fonts::{HACK_REGULAR, NOTO_EMOJI_REGULAR, UBUNTU_LIGHT};
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{self, Group, Node, Options, Tree, fontdb};
use std::sync::{Arc, LazyLock};

/// Where the words of a figure are measured: a narrow face as browsers show it, and a wide one (every letter
/// 0.6 of its size, as wide as those of the widest face that browsers fall back on are on average).
static FACES: LazyLock<[Options<'static>; 2]> = LazyLock::new(|| ["Ubuntu", "Hack"].map(options));

fn options(family: &str) -> Options<'static> {
    let mut fonts = fontdb::Database::new();
    for bytes in [UBUNTU_LIGHT, HACK_REGULAR, NOTO_EMOJI_REGULAR] {
        fonts.load_font_data(bytes.to_vec());
    }
    fonts.set_sans_serif_family(family);
    Options { fontdb: Arc::new(fonts), font_family: family.to_owned(), ..Options::default() }
}

fn parsed(svg: &str, face: &Options) -> Tree {
    Tree::from_str(svg, face).expect("well-formed SVG")
}

/// The figure at twice its size, so that thin lines have their own colour.
pub fn rasterised(svg: &str) -> Pixmap {
    let tree = parsed(svg, &FACES[0]);
    let size = tree.size().to_int_size();
    let mut map = Pixmap::new(2 * size.width(), 2 * size.height()).unwrap();
    resvg::render(&tree, Transform::from_scale(2.0, 2.0), &mut map.as_mut());
    map
}

/// Pixels near a colour.
pub fn near(map: &Pixmap, (r, g, b): (u8, u8, u8)) -> usize {
    let close = |a: u8, b: u8| a.abs_diff(b) < 20;
    map.pixels().iter().filter(|p| close(p.red(), r) && close(p.green(), g) && close(p.blue(), b)).count()
}

/// Pixels that are not the white of the ground.
pub fn inked(map: &Pixmap) -> usize {
    map.pixels().iter().filter(|p| p.red() < 250 || p.green() < 250 || p.blue() < 250).count()
}

/// A part of a figure: what it is, and its box in the units of the tree.
struct Part {
    what: String,
    is_text: bool,
    area: usvg::Rect,
}

fn parts(group: &Group, found: &mut Vec<Part>) {
    for node in group.children() {
        match node {
            Node::Group(group) if group.clip_path().is_some() => {} // what leaves it is not seen
            Node::Group(group) => parts(group, found),
            Node::Text(text) => {
                let words: String = text.chunks().iter().map(|chunk| chunk.text()).collect();
                found.push(Part { what: words, is_text: true, area: text.abs_bounding_box() });
            }
            Node::Path(path) => found.push(Part {
                what: format!("path {:?}", path.data().bounds()),
                is_text: false,
                area: path.abs_bounding_box(),
            }),
            Node::Image(_) => {
                found.push(Part { what: "image".to_owned(), is_text: false, area: node.abs_bounding_box() })
            }
        }
    }
}

fn parts_of(tree: &Tree) -> Vec<Part> {
    let mut found = Vec::new();
    parts(tree.root(), &mut found);
    found
}

/// Words, lines and surfaces that leave the figure in either face.
pub fn outside(svg: &str) -> Vec<String> {
    /// Rounding of whole canvas units, in units of the tree (a canvas unit is a quarter of one).
    const ROUNDING: f32 = 0.3;
    let of = |face: &Options| {
        let tree = parsed(svg, face);
        let (width, height) = (tree.size().width() + ROUNDING, tree.size().height() + ROUNDING);
        let leaves = move |a: &usvg::Rect| {
            a.left() < -ROUNDING || a.top() < -ROUNDING || a.right() > width || a.bottom() > height
        };
        let described = |p: Part| format!("{} at {:?} of {width} x {height}", p.what, p.area);
        parts_of(&tree).into_iter().filter(|p| leaves(&p.area)).map(described).collect::<Vec<_>>()
    };
    FACES.iter().flat_map(of).collect()
}

/// Pairs of words that run into each other, in the narrow face.
pub fn colliding(svg: &str) -> Vec<[String; 2]> {
    /// The part of the height of a line that letters without ascender and descender take.
    const INKED: f32 = 0.5;
    let tree = parsed(svg, &FACES[0]);
    let words: Vec<Part> =
        parts_of(&tree).into_iter().filter(|p| p.is_text && !p.what.trim().is_empty()).collect();
    let shrunk = |a: &usvg::Rect| {
        // the shorter side is the height of the line, wherever the text is turned to
        let trim = (1.0 - INKED) / 2.0 * a.width().min(a.height());
        (a.left() + trim, a.top() + trim, a.right() - trim, a.bottom() - trim)
    };
    let meet = |a: &Part, b: &Part| {
        let (a, b) = (shrunk(&a.area), shrunk(&b.area));
        a.0 < b.2 && b.0 < a.2 && a.1 < b.3 && b.1 < a.3
    };
    let pairs = words.iter().enumerate().flat_map(|(i, a)| words[i + 1..].iter().map(move |b| (a, b)));
    pairs.filter(|(a, b)| meet(a, b)).map(|(a, b)| [a.what.clone(), b.what.clone()]).collect()
}

/// What every figure must be, whatever it shows.
pub fn sound(name: &str, svg: &str) {
    assert_eq!(outside(svg), Vec::<String>::new(), "{name}");
    // pictures are part of the file, and the letters of their data have no meaning
    let mut pieces = svg.split("href=\"data:image/png;base64,");
    let first = pieces.next().unwrap_or_default().to_owned();
    let text = pieces.fold(first, |text, piece| text + piece.split_once('"').map_or("", |(_, rest)| rest));
    for part in ["NaN", "inf\"", "<script", "href="] {
        assert!(!text.contains(part), "{name}: {part}");
    }
    let between = |open: &str, close: &str| {
        svg.split_once(open).and_then(|(_, rest)| rest.split_once(close)).map(|(text, _)| text.to_owned())
    };
    let (title, description) = (between("<title>", "</title>"), between("<desc>", "</desc>"));
    assert!(
        title.is_some() && description.is_some_and(|d| !d.trim().is_empty()),
        "{name}: title or description is missing"
    );
    assert!(svg.contains("role=\"img\""), "{name}");
    assert!(svg.len() < 300_000, "{name}: {} bytes", svg.len());
}

/// A sound figure as pixels.
pub fn drawn(svg: &str) -> Pixmap {
    sound("figure", svg);
    rasterised(svg)
}
