//! Writes docs/sketch.svg, the parts of the blade in one drawing: `cargo run --release --example sketch`.
//!
//! Lengths and the angle of the shoulder are those of data/scenes/actual-blade.toml. The lip leans farther
//! than in steady slip, so that the drop is easy to see.

use portable_math as math;
use std::path::{Path, PathBuf};
use wiperlab::model::{LinkDirections, Linkage, Pose};
use wiperlab::simulate::scene::Scene;

/// Width and height of the drawing, tenths of a millimetre.
const SIZE: (f64, f64) = (850.0, 745.0);
/// Scale of the blade, tenths of a millimetre of the drawing per metre: 8 to 1.
const SCALE: f64 = 8e4;
/// Angle of the neck over the angle of the shoulder.
const NECK_OVER_SHOULDER: f64 = 1.15;
/// Angle of the lip, rad.
const LIP_RAD: f64 = 0.75;
/// Place of the head's hinge along the sweep, and of the glass.
const HEAD_X: f64 = 290.0;
const GLASS_Y: f64 = 620.0;
/// Half the width and the height of the head, and how much narrower a shoulder is on its outer side.
const HEAD: (f64, f64) = (120.0, 90.0);
const SHOULDER_INSET: f64 = 30.0;
/// Height of a shoulder, half the width of the neck, and half the width of the lip at its hinge.
const SHOULDER: f64 = 125.0;
const NECK: f64 = 14.0;
const LIP: f64 = 12.0;
/// Where the labels on the right start.
const LABEL_X: f64 = 440.0;

const GROUND: &str = "#FFFFFF";
const INK: &str = "#000000";
const FAINT: &str = "#808080";
const SOLID: &str = "#DDDDDD";
const NECK_COLOUR: &str = "#0072B2";
const LIP_COLOUR: &str = "#C48200";
/// What a dark screen shows in place of each colour.
const DARK: [(&str, &str); 6] = [
    (GROUND, "#161616"),
    (INK, "#F0F0EE"),
    (FAINT, "#A6A6A6"),
    (SOLID, "#3A3A38"),
    (NECK_COLOUR, "#4AA3E6"),
    (LIP_COLOUR, "#FFC24D"),
];

const TITLE: &str = "Head, neck, lip, shoulder, deflection and drop";
const DESCRIPTION: &str = "Neck and lip hang from the head. The head moves to the left, and the lip tip trails to \
                           the right. The neck leans on the shoulder. Dashed: the upright blade, and the vertical \
                           from which the lip's angle is measured. The deflection is the position of the tip along \
                           the sweep, less that of the head. The drop is how far the head sinks towards the glass.";

/// The file and its text.
///
/// # Errors
/// What could not be read, in words.
pub fn sketch(root: &Path) -> Result<(PathBuf, String), String> {
    let path = root.join("data/scenes/actual-blade.toml");
    let text = std::fs::read_to_string(&path).map_err(|problem| format!("{}: {problem}", path.display()))?;
    let scene = Scene::parse("actual-blade.toml", &text).map_err(|problem| problem.to_string())?;
    Ok((root.join("docs/sketch.svg"), drawing(&scene.linkage)?))
}

fn drawing(blade: &Linkage) -> Result<String, String> {
    let contact_rad = blade.shoulder.ok_or("the scene has no shoulder")?.contact_angle_rad;
    let theta = NECK_OVER_SHOULDER * contact_rad;
    let d = LinkDirections::from_pose(&Pose { theta, phi: LIP_RAD, theta_rate: 0.0, phi_rate: 0.0 });
    let (l1, l2) = (SCALE * blade.l1_m, SCALE * blade.l2_m);
    let drop = SCALE * blade.head_drop_m(&d);
    let hinge_y = GLASS_Y - l1 - l2 + drop;
    let (knee_x, knee_y) = (HEAD_X + l1 * d.sin_theta, hinge_y + l1 * d.cos_theta);
    let tip_x = knee_x + l2 * d.sin_phi;
    let head_y = hinge_y - HEAD.1;

    let mut svg = Svg::new();
    let hatching: String = (0..21).map(|i| format!("M{} {GLASS_Y}l-18 18", 60 + 24 * i)).collect();
    svg.line(FAINT, 2.0, &hatching);
    svg.line(INK, 4.0, &format!("M36 {GLASS_Y}h510"));

    let (left, width) = (HEAD_X - HEAD.0, 2.0 * HEAD.0);
    svg.dashed(&format!("M{left} {head_y:.1}v{:.1}h{width}v{drop:.1}", -drop));
    svg.dashed(&format!("M{HEAD_X} {hinge_y:.1}V{GLASS_Y}"));
    svg.dashed(&format!("M{knee_x:.1} {knee_y:.1}V{GLASS_Y}"));

    // the edge of a neck at the contact angle lies on the inner face of a shoulder
    let face = |depth: f64| NECK / math::cos(contact_rad) + depth * math::tan(contact_rad);
    for side in [-1.0, 1.0] {
        let [inner, outer, foot] =
            [face(0.0), HEAD.0 - SHOULDER_INSET, face(SHOULDER)].map(|x| HEAD_X + side * x);
        svg.solid(&format!("M{inner:.1} {hinge_y:.1}H{outer:.1}v{SHOULDER}H{foot:.1}z"));
    }
    svg.solid(&format!("M{left} {head_y:.1}h{width}v{}h-{width}z", HEAD.1));
    svg.line(NECK_COLOUR, 2.0 * NECK, &format!("M{HEAD_X} {hinge_y:.1}L{knee_x:.1} {knee_y:.1}"));
    // the lip tapers to its tip
    let (across_x, across_y) = (LIP * d.cos_phi, LIP * d.sin_phi);
    svg.0 += &format!(
        "<path fill=\"{LIP_COLOUR}\" d=\"M{:.1} {:.1}L{tip_x:.1} {GLASS_Y}L{:.1} {:.1}z\"/>\n",
        knee_x - across_x,
        knee_y + across_y,
        knee_x + across_x,
        knee_y - across_y
    );
    svg.hinge(HEAD_X, hinge_y);
    svg.hinge(knee_x, knee_y);

    svg.angle((HEAD_X, hinge_y), theta, 240.0);
    svg.text("end", (HEAD_X - 10.0, hinge_y + 245.0), "\u{3b8}");
    svg.angle((knee_x, knee_y), LIP_RAD, 76.0);
    svg.text("middle", (knee_x + 17.0, knee_y + 58.0), "\u{3c6}");

    svg.text("middle", (HEAD_X, hinge_y - 35.0), "head");
    svg.label(hinge_y + 80.0, (HEAD_X + HEAD.0 - SHOULDER_INSET - 12.0, hinge_y + 80.0), "shoulder");
    svg.label(hinge_y + 185.0, (HEAD_X + 40.0, hinge_y + 185.0), &link("neck", 1, "\u{3b8}"));
    svg.label(knee_y + 5.0, (knee_x + 40.0, knee_y + 29.0), &link("lip", 2, "\u{3c6}"));
    svg.label(GLASS_Y - 34.0, (tip_x + 6.0, GLASS_Y - 6.0), "lip tip");
    svg.text("start", (560.0, GLASS_Y + 9.0), "glass");

    svg.arrow((HEAD_X + 60.0, 56.0), (HEAD_X - 60.0, 56.0));
    svg.text("middle", (HEAD_X, 38.0), "the head moves");
    for y in [head_y - drop, head_y] {
        svg.line(FAINT, 2.0, &format!("M{} {y:.1}h-66", left - 6.0));
    }
    svg.arrow((left - 50.0, head_y - drop), (left - 50.0, head_y));
    svg.text("end", (left - 80.0, head_y - 0.5 * drop + 9.0), "drop");
    for x in [HEAD_X, tip_x] {
        svg.line(FAINT, 2.0, &format!("M{x:.1} {}v52", GLASS_Y + 24.0));
    }
    svg.arrow((HEAD_X, GLASS_Y + 62.0), (tip_x, GLASS_Y + 62.0));
    svg.text("middle", (0.5 * (HEAD_X + tip_x), GLASS_Y + 104.0), "deflection");
    Ok(svg.0 + "</svg>\n")
}

/// The label of a link, with its length and its angle.
fn link(name: &str, number: u8, angle: &str) -> String {
    format!(
        "{name}, length l<tspan font-size=\"20\" dy=\"6\">{number}</tspan><tspan dy=\"-6\">, angle {angle}</tspan>"
    )
}

struct Svg(String);

impl Svg {
    fn new() -> Self {
        let (width, height) = SIZE;
        let dark: String = DARK
            .iter()
            .map(|(light, dark)| {
                format!("svg [fill=\"{light}\"]{{fill:{dark}}}svg [stroke=\"{light}\"]{{stroke:{dark}}}")
            })
            .collect();
        Self(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-label=\"{TITLE}\" width=\"{}mm\" \
             height=\"{}mm\" viewBox=\"0 0 {width} {height}\" stroke-linejoin=\"round\">\n<title>{TITLE}</title>\n\
             <desc>{DESCRIPTION}</desc>\n<style>@media screen and (prefers-color-scheme:dark){{{dark}}}</style>\n\
             <path fill=\"{GROUND}\" d=\"M0 0h{width}v{height}h-{width}z\"/>\n",
            width / 10.0,
            height / 10.0
        ))
    }

    fn line(&mut self, colour: &str, width: f64, path: &str) {
        self.0 +=
            &format!("<path fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" d=\"{path}\"/>\n");
    }

    fn dashed(&mut self, path: &str) {
        self.0 += &format!(
            "<path fill=\"none\" stroke=\"{FAINT}\" stroke-width=\"3\" stroke-dasharray=\"10 7\" d=\"{path}\"/>\n"
        );
    }

    fn solid(&mut self, path: &str) {
        self.0 += &format!("<path fill=\"{SOLID}\" stroke=\"{INK}\" stroke-width=\"3\" d=\"{path}\"/>\n");
    }

    fn hinge(&mut self, x: f64, y: f64) {
        self.0 += &format!(
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"8\" fill=\"{GROUND}\" stroke=\"{INK}\" stroke-width=\"3\"/>\n"
        );
    }

    /// An arc from the vertical below a hinge to its link.
    fn angle(&mut self, (x, y): (f64, f64), angle_rad: f64, radius: f64) {
        let (sin, cos) = math::sin_cos(angle_rad);
        let (dx, dy) = (radius * sin, radius * (cos - 1.0));
        self.line(INK, 2.0, &format!("M{x:.1} {:.1}a{radius} {radius} 0 0 0 {dx:.1} {dy:.1}", y + radius));
    }

    /// An arrow along the sweep or across it.
    fn arrow(&mut self, from: (f64, f64), to: (f64, f64)) {
        const BARB: f64 = 12.0;
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let length = math::hypot(dx, dy);
        let (ux, uy) = (BARB * dx / length, BARB * dy / length);
        let barb = |side: f64| (to.0 - ux - 0.5 * side * uy, to.1 - uy + 0.5 * side * ux);
        let ((ax, ay), (bx, by)) = (barb(1.0), barb(-1.0));
        self.line(
            INK,
            3.0,
            &format!(
                "M{:.1} {:.1}L{:.1} {:.1}M{ax:.1} {ay:.1}L{:.1} {:.1}L{bx:.1} {by:.1}",
                from.0, from.1, to.0, to.1, to.0, to.1
            ),
        );
    }

    fn text(&mut self, anchor: &str, (x, y): (f64, f64), text: &str) {
        self.0 += &format!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" font-family=\"sans-serif\" font-size=\"28\" \
             fill=\"{INK}\">{text}</text>\n"
        );
    }

    /// A label on the right at this height, with a line from it to what it names.
    fn label(&mut self, y: f64, part: (f64, f64), text: &str) {
        self.line(INK, 2.0, &format!("M{} {y:.1}L{:.1} {:.1}", LABEL_X - 8.0, part.0, part.1));
        self.text("start", (LABEL_X, y + 9.0), text);
    }
}

#[allow(dead_code, reason = "the test that compares the drawing with the committed file includes this file")]
fn main() -> Result<(), String> {
    let (path, svg) = sketch(Path::new(env!("CARGO_MANIFEST_DIR")))?;
    std::fs::write(&path, svg).map_err(|problem| format!("{}: {problem}", path.display()))?;
    println!("{}", path.display());
    Ok(())
}
