//! Draws the linkage to scale: its joints, and the panels in which it moves. Lengths are in mm; heights are
//! above the glass.

use super::Animation;
use crate::figures::poses::joint_positions;
use crate::model::Linkage;
use crate::simulate::ModelSample;
use plain_charts::{ChartAxis, Colour, Mark, Panel, Series, TextAnnotation, value_span};

const MM: f64 = 1e3;
/// Estimated width, mm, of axes that take half of the page width; it determines the scale of the drawing.
const AXES_MM: f64 = 70.0;
/// Smallest and largest height that the drawing may have, mm.
const HEIGHT_MM: (f64, f64) = (50.0, 80.0);
/// Margin above the blade, for head and labels, in lengths of the blade.
const ABOVE: f64 = 0.42;
/// Margin below the glass, in lengths of the blade.
const BELOW: f64 = 0.13;
/// Smallest allowed horizontal distance, mm, between two pose names in one row.
const LABEL_MM: f64 = 10.0;
/// Vertical distance, mm, between two rows of pose names.
const ROW_MM: f64 = 3.2;
/// Distance between the middle of a text and the left or right end of the drawing, mm.
const MARGIN_MM: f64 = 5.0;
/// Half width of the drawn head, in lengths of the blade; not to scale.
pub(super) const HEAD_HALF_WIDTH: f64 = 0.22;
/// Height of the drawn head, in lengths of the blade; not to scale.
pub(super) const HEAD_HEIGHT: f64 = 0.14;

/// Name and joints of a pose; the joints are those of [`linkage_points_mm`].
type LabelledPose = (&'static str, [(f64, f64); 3]);

/// Positions, mm, of the upper hinge of the neck, the hinge between neck and lip, and the tip of the lip.
pub(super) fn linkage_points_mm(linkage: &Linkage, sample: &ModelSample) -> [(f64, f64); 3] {
    joint_positions(linkage, sample).map(|(x, y)| (MM * x, MM * y))
}

/// Length of the straight blade, mm.
pub(super) fn blade_length_mm(linkage: &Linkage) -> f64 {
    MM * linkage.upright_height_m()
}

/// The panel with the glass, a scale bar and the poses of [`key_poses`].
pub(super) fn draw_linkage_panel(animation: &Animation) -> Panel {
    let length = blade_length_mm(&animation.linkage);
    let (low, high) = (-BELOW * length, (1.0 + ABOVE) * length);
    let ends = animation.samples.iter().flat_map(|s| [MM * s.head_x_m, MM * s.tip_x_m]);
    let room = 1.2 * HEAD_HALF_WIDTH * length;
    let (left, right) = value_span(ends.flat_map(|x| [x - room, x + room]));
    let height_mm = (AXES_MM * (high - low) / (right - left)).clamp(HEIGHT_MM.0, HEIGHT_MM.1);
    let poses = key_poses(animation);
    let unit_mm = (AXES_MM / (right - left)).min(height_mm / (high - low));
    let (bar, foot) = (left + (MARGIN_MM / unit_mm - 0.5).max(0.0), 0.8 * low);
    let mut annotations = vec![
        text_at("glass", (right - MARGIN_MM / unit_mm, foot)),
        text_at("1 mm", (bar + 0.5, foot - 0.5 / unit_mm)),
    ];
    let label_height = (1.0 + 1.4 * HEAD_HEIGHT) * length;
    annotations.extend(pose_labels(&poses, label_height, ROW_MM / unit_mm, LABEL_MM / unit_mm));
    let points = poses.iter().flat_map(|(_, [a, b, c])| [Some(*a), Some(*b), Some(*c), None]);
    let mut series = vec![
        glass_line(left, right),
        Series::new("", Colour::Black, Mark::Line, [(bar, low / 2.0), (bar + 1.0, low / 2.0)]),
        Series::new("model at the instants named", Colour::Grey, Mark::Thin, points),
    ];
    if animation.measured.is_some() {
        series.push(Series::new("measured tip and head", Colour::Black, Mark::Crosses, [None; 0]));
    }
    let [x, y] = [(left, right), (low, high)].map(|ends| ChartAxis::linear("").with_ends(Some(ends)));
    Panel { equal_aspect: true, bare: true, annotations, ..Panel::new(x, y, height_mm, series) }
}

/// A line for the glass that extends far beyond both sides of the panel.
fn glass_line(left: f64, right: f64) -> Series {
    const FAR: f64 = 100.0;
    let ends = [left - FAR * (right - left), right + FAR * (right - left)];
    Series::new("", Colour::Grey, Mark::Thick, ends.map(|x| (x, 0.0)))
}

fn text_at(text: &str, at: (f64, f64)) -> TextAnnotation {
    TextAnnotation::new(text, Colour::Black, at)
}

/// The panel with the enlarged tip. It shows the path of the tip in the last shown part, in which the tip
/// slips, with a margin at either end.
pub(super) fn draw_tip_panel(animation: &Animation, height_mm: f64) -> Panel {
    /// Margin at either end of the path of the tip, as a fraction of the length of that path.
    const ROOM: f64 = 0.12;
    /// Margin below the glass, as a fraction of the length of the path of the tip.
    const UNDER: f64 = 0.3;
    let [from_s, to_s] = animation.pace.last_part_s();
    let tips =
        animation.samples.iter().filter(|s| s.time_s >= from_s && s.time_s <= to_s).map(|s| MM * s.tip_x_m);
    let (left, right) = value_span(tips);
    let way = (right - left).max(0.01 * blade_length_mm(&animation.linkage));
    let (left, right) = (left - ROOM * way, right + ROOM * way);
    let low = -UNDER * way;
    let x = ChartAxis::linear("along the sweep, mm").with_range(left, right);
    let y = ChartAxis::linear("height, mm").with_range(low, low + (right - left) * height_mm / AXES_MM);
    let title = "the tip, enlarged".to_owned();
    Panel { title, equal_aspect: true, ..Panel::new(x, y, height_mm, [glass_line(left, right)]) }
}

/// The pose names above the heads, each in the lowest row in which it does not overlap an earlier name.
fn pose_labels(poses: &[LabelledPose], height: f64, row: f64, apart: f64) -> Vec<TextAnnotation> {
    let mut labels: Vec<TextAnnotation> = Vec::new();
    for (name, [(x, _), ..]) in poses {
        let meets = |at: f64| labels.iter().any(|l| l.at.1 == at && (l.at.0 - x).abs() < apart);
        let rows = (0..poses.len()).map(|k| height + k as f64 * row);
        if let Some(at) = rows.into_iter().find(|at| !meets(*at)) {
            labels.push(text_at(name, (*x, at)));
        }
    }
    labels
}

/// The drawn poses: one at the start and one at the end of the hold. If the head passes over the resting tip
/// during the hold, there is a pose at that instant too.
fn key_poses(animation: &Animation) -> Vec<LabelledPose> {
    let [from_s, to_s] = animation.hold_s;
    let at = |time_s: f64| animation.samples.iter().find(|s| s.time_s >= time_s);
    let held: Vec<&ModelSample> =
        animation.samples.iter().filter(|s| s.time_s >= from_s && s.time_s <= to_s).collect();
    let deflection = |s: &ModelSample| s.tip_x_m - s.head_x_m;
    let upright =
        held.windows(2).find(|pair| deflection(pair[0]) * deflection(pair[1]) <= 0.0).map(|pair| pair[0]);
    let named = [("hold", at(from_s)), ("stick ends", at(to_s)), ("upright", upright)];
    named
        .into_iter()
        .filter_map(|(name, sample)| Some((name, linkage_points_mm(&animation.linkage, sample?))))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::RunMotion;
    use crate::simulate::scene::Scene;

    #[test]
    fn the_drawn_tip_is_where_the_model_has_it_on_the_glass_and_off_it() {
        let mut scene =
            Scene::parse("actual-blade.toml", include_str!("../../../data/scenes/actual-blade.toml"))
                .unwrap();
        scene.run.stop_s = 0.8;
        let motion = RunMotion::simulate(&scene);
        assert!(motion.samples.len() > 1000);
        for sample in &motion.samples {
            let [head, hinge, tip] = linkage_points_mm(&motion.linkage, sample);
            assert!(
                (tip.0 - 1e3 * sample.tip_x_m).abs() < 1e-9
                    && (tip.1 - 1e3 * sample.tip_height_m).abs() < 1e-9,
                "{sample:?}"
            );
            assert_eq!(head.0, 1e3 * sample.head_x_m);
            let length = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0).hypot(a.1 - b.1);
            assert!(
                (length(head, hinge) - 1e3 * motion.linkage.l1_m).abs() < 1e-9
                    && (length(hinge, tip) - 1e3 * motion.linkage.l2_m).abs() < 1e-9
            );
        }
        // raising the head raises the tip by the same amount
        let lifted = ModelSample { head_drop_m: motion.samples[0].head_drop_m - 1e-4, ..motion.samples[0] };
        assert!((linkage_points_mm(&motion.linkage, &lifted)[2].1 - 0.1).abs() < 1e-9);
    }

    #[test]
    fn names_of_poses_that_would_meet_stand_in_rows() {
        let pose = |name, x| (name, [(x, 5.0); 3]);
        let labels =
            pose_labels(&[pose("hold", 1.0), pose("stick ends", 3.0), pose("upright", 2.5)], 6.0, 0.5, 1.0);
        assert_eq!(
            labels.iter().map(|l| (l.text.as_str(), l.at)).collect::<Vec<_>>(),
            [("hold", (1.0, 6.0)), ("stick ends", (3.0, 6.0)), ("upright", (2.5, 6.5))]
        );
    }
}
