//! The moving elements over the still figure: one SVG element per moving part, with the key frames of that
//! part.

use super::drawing::{HEAD_HALF_WIDTH, HEAD_HEIGHT};
use super::{Animation, PlaybackPace, PlaybackPart, drawing};
use crate::figures::animation;
use crate::simulate::ModelSample;
use crate::simulate::mode::TipMode;
use plain_charts::{Colour, PanelPlacement};
use std::fmt::Write;

/// Largest position error allowed for a drawn point, in canvas units: a fiftieth of a millimetre, less than a
/// line width.
const TOLERANCE: f64 = 0.3;
/// Half width of the symbol at the tip, in canvas units.
const TIP_HALF_WIDTH: f64 = 20.0;
/// Half width of the cross at a measured point, in canvas units.
const CROSS_HALF_WIDTH: f64 = 15.0;
/// Distance of the mode symbol below the tip, in canvas units.
const SYMBOL_OFFSET: f64 = 40.0;
/// Distance of a link's name from the middle of the link, in canvas units.
const NAME_OFFSET: f64 = 52.0;
/// Background colour of the figure.
const BACKGROUND: &str = "#FFFFFF";
/// Font size, in canvas units.
const TEXT_SIZE: f64 = 44.0;
/// A measured point is shown for at least this fraction of the playback time; a screen cannot show anything
/// shorter.
const MIN_CROSS_FRACTION: f64 = 1.0 / 2000.0;

/// A contact mode, its name, and the colour and outline of its symbol. The outline is an SVG path in units of
/// the half width of the symbol.
type ContactModeSymbol = (TipMode, &'static str, Colour, &'static str);

const CONTACT_MODE_SYMBOLS: [ContactModeSymbol; 4] = [
    (TipMode::Stick, "stick", Colour::Blue, "M-1 -1H1V1H-1Z"),
    (TipMode::SlipForward, "slip+ (to the right)", Colour::Green, "M1.4 0L-0.9 1.2V-1.2Z"),
    (TipMode::SlipBackward, "slip\u{2212} (to the left)", Colour::Green, "M-1.4 0L0.9 1.2V-1.2Z"),
    (TipMode::Flight, "flight", Colour::Purple, "M0 -1.3L1.3 0L0 1.3L-1.3 0Z"),
];

/// The moving elements; empty if the drawings of the linkage and of the enlarged tip are missing.
pub(super) fn moving_elements(animation: &Animation, plots: &[PanelPlacement]) -> String {
    let [plot, close, strips @ ..] = plots else { return String::new() };
    [
        moving_linkage(animation, plot),
        tip_symbol(animation, plot),
        measured_crosses(animation, plot),
        enlarged_tip(animation, close),
        mode_and_pace_text(animation, plot, close),
        time_cursors(animation, strips),
    ]
    .concat()
}

/// Key frames of the pose: canvas coordinates of head, hinge and tip, as x, y, x, y, x, y.
fn pose_key_frames(animation: &Animation, plot: &PanelPlacement) -> KeyFrames<6> {
    let point = |sample: &ModelSample| {
        let points = drawing::linkage_points_mm(&animation.linkage, sample);
        let [a, b, c] = points.map(|(x, y)| plot.canvas_point(x, y));
        let (a, b, c) = (a?, b?, c?);
        Some((animation.pace.playback_fraction(sample.time_s), [a.0, a.1, b.0, b.1, c.0, c.1]))
    };
    animation.samples.iter().filter_map(point).collect()
}

/// Key frames with `N` of the six coordinates of each pose, beginning at index `from`; superfluous key frames
/// are left out.
fn select_numbers<const N: usize>(poses: &KeyFrames<6>, from: usize) -> KeyFrames<N> {
    let some: KeyFrames<N> =
        poses.iter().map(|(share, all)| (*share, std::array::from_fn(|k| all[from + k]))).collect();
    simplify_key_frames(&some, TOLERANCE)
}

fn format_numbers<const N: usize>(values: &[f64; N]) -> [String; N] {
    values.map(|v| format_short(v, 1))
}

fn format_translation(values: &[f64; 2]) -> String {
    format_numbers(values).join(" ")
}

fn line_path(values: &[f64; 4]) -> String {
    let [x1, y1, x2, y2] = format_numbers(values);
    format!("M{x1} {y1}L{x2} {y2}")
}

/// A group that moves; without SMIL it stays at its first position.
fn moving_group(
    animation: &Animation,
    changed: AnimatedAttribute,
    keys: &KeyFrames<2>,
    contents: &str,
) -> String {
    let Some((_, first)) = keys.first() else { return String::new() };
    let motion = animate_element(changed, &animation.pace, keys, format_translation);
    format!("<g transform=\"translate({})\">{motion}{contents}</g>\n", format_translation(first))
}

/// A moving line for the link from one joint to the next; the coordinates of the first joint begin at index
/// `from` of a pose.
fn moving_link(animation: &Animation, poses: &KeyFrames<6>, from: usize, width: u32) -> String {
    let keys: KeyFrames<4> = select_numbers(poses, from);
    let Some((_, first)) = keys.first() else { return String::new() };
    let motion = animate_element(AnimatedAttribute::Path, &animation.pace, &keys, line_path);
    let colour = Colour::Vermilion.hex();
    format!(
        "<path d=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" \
         stroke-linecap=\"round\">{motion}</path>\n",
        line_path(first)
    )
}

/// Neck, lip, head and the hinges.
fn moving_linkage(animation: &Animation, plot: &PanelPlacement) -> String {
    let poses = pose_key_frames(animation, plot);
    let hinge = format!(
        "<circle r=\"10\" fill=\"{BACKGROUND}\" stroke=\"{}\" stroke-width=\"4\"/>",
        Colour::Vermilion.hex()
    );
    let head = moving_head(animation, plot) + &hinge;
    let joint = |from: usize, contents: &str| {
        moving_group(animation, AnimatedAttribute::Place, &select_numbers(&poses, from), contents)
    };
    let links = [moving_link(animation, &poses, 0, 34), moving_link(animation, &poses, 2, 22)].concat();
    [
        links,
        joint(0, &head),
        joint(2, &hinge),
        link_name(animation, &poses, 0, "neck"),
        link_name(animation, &poses, 2, "lip"),
    ]
    .concat()
}

/// The name of a link, to the right of its middle.
fn link_name(animation: &Animation, poses: &KeyFrames<6>, from: usize, word: &str) -> String {
    let middle = |[x1, y1, x2, y2]: [f64; 4]| [(x1 + x2) / 2.0, (y1 + y2) / 2.0];
    let keys: KeyFrames<2> =
        poses.iter().map(|(share, all)| (*share, middle(std::array::from_fn(|k| all[from + k])))).collect();
    moving_group(
        animation,
        AnimatedAttribute::Place,
        &simplify_key_frames(&keys, TOLERANCE),
        &text_element(NAME_OFFSET, 0.0, "start", word),
    )
}

/// The lip near its tip, clipped to the panel.
fn enlarged_tip(animation: &Animation, plot: &PanelPlacement) -> String {
    let [(left, top), (right, bottom)] = plot.corners();
    let [x, y, width, height] = format_numbers(&[left, top, right - left, bottom - top]);
    let contents = [
        moving_link(animation, &pose_key_frames(animation, plot), 2, 40),
        tip_symbol(animation, plot),
        measured_crosses(animation, plot),
    ]
    .concat();
    // the id contains the position, so animations on one page share an id only if their clipping frames are
    // equal
    let name = format!("frame-{x}-{y}-{width}-{height}").replace('.', "_");
    let frame = format!(
        "<clipPath id=\"{name}\"><rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"/></clipPath>"
    );
    format!("{frame}\n<g clip-path=\"url(#{name})\">\n{contents}</g>\n")
}

/// The head, drawn around its hinge.
fn moving_head(animation: &Animation, plot: &PanelPlacement) -> String {
    let length = drawing::blade_length_mm(&animation.linkage);
    let corner = |x: f64, y: f64| plot.canvas_point(x * length, y * length);
    let (Some((x0, y0)), Some((x1, y1))) = (corner(0.0, 0.0), corner(HEAD_HALF_WIDTH, HEAD_HEIGHT)) else {
        return String::new();
    };
    let (half, height, grey) = (x1 - x0, y0 - y1, Colour::Grey.hex());
    let word = text_element(0.0, -height / 2.0, "middle", "head");
    let [x, y, width, height] = format_numbers(&[-half, -height, 2.0 * half, height]);
    format!(
        "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" rx=\"12\" fill=\"{grey}\" \
         opacity=\"0.6\"/>{word}"
    )
}

/// Times at which a contact mode begins or ends, as fractions of the playback time; each has `true` if the
/// mode begins.
fn mode_intervals(animation: &Animation, mode: TipMode) -> Vec<(f64, bool)> {
    let mut spells: Vec<(f64, bool)> = animation
        .modes
        .iter()
        .map(|(since_s, entered)| (animation.pace.playback_fraction(*since_s), *entered == mode))
        .collect();
    spells.dedup_by_key(|(_, on)| *on);
    spells
}

/// A group that appears and disappears at given times.
fn visible_at_times(animation: &Animation, spells: &[(f64, bool)], contents: &str) -> String {
    let opacity = |on: &bool| u8::from(*on).to_string();
    let Some((_, first)) = spells.first() else { return String::new() };
    let change = animate_element(AnimatedAttribute::Visible, &animation.pace, spells, opacity);
    format!("<g opacity=\"{}\">{change}{contents}</g>\n", opacity(first))
}

/// A group that is visible in one contact mode; empty if that mode never occurs.
fn visible_in_mode(animation: &Animation, mode: TipMode, contents: &str) -> String {
    let spells = mode_intervals(animation, mode);
    if spells.iter().any(|(_, on)| *on) {
        visible_at_times(animation, &spells, contents)
    } else {
        String::new()
    }
}

fn mode_symbol((_, _, colour, outline): &ContactModeSymbol, at: (f64, f64)) -> String {
    let [x, y, size] = format_numbers(&[at.0, at.1, TIP_HALF_WIDTH]);
    format!(
        "<path d=\"{outline}\" transform=\"translate({x} {y}) scale({size})\" fill=\"{}\"/>",
        colour.hex()
    )
}

/// The symbol of the contact mode, below the glass so that it does not cover the tip.
fn tip_symbol(animation: &Animation, plot: &PanelPlacement) -> String {
    let symbols: String = CONTACT_MODE_SYMBOLS
        .iter()
        .map(|sign| visible_in_mode(animation, sign.0, &mode_symbol(sign, (0.0, SYMBOL_OFFSET))))
        .collect();
    moving_group(
        animation,
        AnimatedAttribute::Place,
        &select_numbers(&pose_key_frames(animation, plot), 4),
        &symbols,
    )
}

fn text_element(x: f64, y: f64, anchor: &str, words: &str) -> String {
    let (size, [x, y]) = (format_short(TEXT_SIZE, 1), format_numbers(&[x, y]));
    format!(
        "<text x=\"{x}\" y=\"{y}\" dy=\"0.35em\" text-anchor=\"{anchor}\" font-family=\"sans-serif\" \
         font-size=\"{size}\" fill=\"#000000\">{words}</text>"
    )
}

/// Name of the contact mode in the upper corner of the drawing, and pace above the enlarged tip.
fn mode_and_pace_text(animation: &Animation, plot: &PanelPlacement, close: &PanelPlacement) -> String {
    let [[(left, top), _], [(_, frame), (right, _)]] = [plot.corners(), close.corners()];
    let y = top + TEXT_SIZE / 2.0;
    let modes = CONTACT_MODE_SYMBOLS.iter().map(|sign| {
        let word = text_element(left + 4.0 * TIP_HALF_WIDTH, y, "start", &format!("tip: {}", sign.1));
        visible_in_mode(animation, sign.0, &(mode_symbol(sign, (left + 1.5 * TIP_HALF_WIDTH, y)) + &word))
    });
    let over = frame - 0.8 * TEXT_SIZE;
    let pace = |part: &PlaybackPart| {
        visible_at_times(
            animation,
            &part_visibility(animation, part),
            &text_element(right, over, "end", &format!("{} times slower", part.slower)),
        )
    };
    let paces = animation.pace.parts.iter().map(pace);
    modes.chain(paces).collect()
}

/// Times at which the text of a part of the motion appears and disappears, as fractions of the playback time;
/// the last part stays visible to the end.
fn part_visibility(animation: &Animation, part: &PlaybackPart) -> Vec<(f64, bool)> {
    let [from_s, to_s] = animation.pace.span_s();
    let mut spells = vec![(0.0, part.from_s <= from_s)];
    if part.from_s > from_s {
        spells.push((animation.pace.playback_fraction(part.from_s), true));
    }
    if part.to_s < to_s {
        spells.push((animation.pace.playback_fraction(part.to_s), false));
    }
    spells
}

/// Crosses at the measured tip (drawn on the glass) and at the measured head, in the frame nearest to the
/// shown instant. A cross is hidden while its point is not tracked.
fn measured_crosses(animation: &Animation, plot: &PanelPlacement) -> String {
    let Some(measured) = &animation.measured else { return String::new() };
    let length = drawing::blade_length_mm(&animation.linkage);
    let tips = measured.tip_x_m.iter().map(|x| x.map(|x| (1e3 * x, 0.0)));
    let heads = measured
        .head_x_m
        .iter()
        .zip(&measured.head_drop_m)
        .map(|(x, u)| x.zip(*u).map(|(x, u)| (1e3 * x, length - 1e3 * u)));
    let cross = |frames: Vec<Option<(f64, f64)>>| {
        let frames = frames.into_iter().map(|p| p.and_then(|(x, y)| plot.canvas_point_inside(x, y)));
        jumping_cross(animation, &measured.time_s, &frames.collect::<Vec<_>>())
    };
    cross(tips.collect()) + &cross(heads.collect())
}

/// A cross that jumps from frame to frame.
fn jumping_cross(animation: &Animation, time_s: &[f64], frames: &[Option<(f64, f64)>]) -> String {
    let [from_s, to_s] = animation.pace.span_s();
    let (mut places, mut visible): (KeyFrames<2>, Vec<(f64, bool)>) = (Vec::new(), Vec::new());
    let mut shown = 0.0;
    for (i, (t, frame)) in time_s.iter().zip(frames).enumerate() {
        let until_s = time_s.get(i + 1).map_or(*t, |next| (t + next) / 2.0);
        let since_s = i.checked_sub(1).and_then(|i| time_s.get(i)).map_or(*t, |before| (t + before) / 2.0);
        if until_s < from_s || since_s > to_s {
            continue;
        }
        let share = if visible.is_empty() { 0.0 } else { animation.pace.playback_fraction(since_s) };
        if !visible.is_empty() && share - shown < MIN_CROSS_FRACTION {
            continue;
        }
        shown = share;
        if visible.last().is_none_or(|(_, on)| *on != frame.is_some()) {
            visible.push((share, frame.is_some()));
        }
        if let Some((x, y)) = frame {
            places.push((if places.is_empty() { 0.0 } else { share }, [*x, *y]));
        }
    }
    let arms = format!(
        "<path d=\"M-{0} -{0}L{0} {0}M-{0} {0}L{0} -{0}\" stroke=\"#000000\" stroke-width=\"5\"/>",
        format_short(CROSS_HALF_WIDTH, 1)
    );
    visible_at_times(
        animation,
        &visible,
        &moving_group(animation, AnimatedAttribute::Jumping, &places, &arms),
    )
}

/// The time cursors of the strips. While the shown instant is outside the time axis of a strip, its cursor
/// rests at the nearer end.
fn time_cursors(animation: &Animation, strips: &[PanelPlacement]) -> String {
    let turns: Vec<f64> = animation.pace.parts.iter().flat_map(|p| [p.from_s, p.to_s]).collect();
    let cursor = |(plot, [from_s, to_s]): (&PanelPlacement, [f64; 2])| {
        let [(left, top), (right, bottom)] = plot.corners();
        let x = |t: f64| left + (right - left) * (t.max(from_s).min(to_s) - from_s) / (to_s - from_s);
        let keys: KeyFrames<2> =
            turns.iter().map(|t| (animation.pace.playback_fraction(*t), [x(*t), 0.0])).collect();
        let [top, bottom] = format_numbers(&[top, bottom]);
        let line =
            format!("<path d=\"M0 {top}V{bottom}\" stroke=\"{}\" stroke-width=\"6\"/>", Colour::Blue.hex());
        moving_group(animation, AnimatedAttribute::Place, &simplify_key_frames(&keys, TOLERANCE), &line)
    };
    strips.iter().zip(animation::strip_spans_s(animation)).map(cursor).collect()
}

// Key frames and SMIL elements.

/// Key frames. Each is a time, as a fraction of the playback time, with the values at that time.
pub(super) type KeyFrames<const N: usize> = Vec<(f64, [f64; N])>;

/// Leaves out key frames that linear interpolation between the others reproduces within `tolerance`
/// (Douglas-Peucker algorithm with time as the abscissa).
pub(super) fn simplify_key_frames<const N: usize>(
    values: &[(f64, [f64; N])],
    tolerance: f64,
) -> KeyFrames<N> {
    let mut kept = vec![false; values.len()];
    if let Some(last) = values.len().checked_sub(1) {
        (kept[0], kept[last]) = (true, true);
        let mut open = vec![(0, last)];
        while let Some((from, to)) = open.pop() {
            let apart = |i: usize| (i, deviation_from_line(&values[from], &values[to], &values[i]));
            let farthest = (from + 1..to).map(apart).max_by(|a, b| a.1.total_cmp(&b.1));
            if let Some((index, _)) = farthest.filter(|(_, apart)| *apart > tolerance) {
                kept[index] = true;
                open.extend([(from, index), (index, to)]);
            }
        }
    }
    values.iter().zip(kept).filter(|(_, kept)| *kept).map(|(value, _)| *value).collect()
}

/// Deviation of a key frame from linear interpolation between two other key frames: the largest absolute
/// difference of any of its values.
fn deviation_from_line<const N: usize>(
    from: &(f64, [f64; N]),
    to: &(f64, [f64; N]),
    value: &(f64, [f64; N]),
) -> f64 {
    let share = if to.0 > from.0 { (value.0 - from.0) / (to.0 - from.0) } else { 0.0 };
    (0..N).map(|k| (from.1[k] + share * (to.1[k] - from.1[k]) - value.1[k]).abs()).fold(0.0, f64::max)
}

/// The attribute of an element that is animated.
#[derive(Debug, Clone, Copy)]
pub(super) enum AnimatedAttribute {
    /// The path of a line.
    Path,
    /// The position of a group.
    Place,
    /// The position of a group, which jumps from value to value.
    Jumping,
    /// The visibility of a group.
    Visible,
}

impl AnimatedAttribute {
    /// Name and attributes of the animating element.
    fn animating_element(self) -> (&'static str, &'static str) {
        match self {
            Self::Path => ("animate", "attributeName=\"d\""),
            Self::Place => ("animateTransform", "attributeName=\"transform\" type=\"translate\""),
            Self::Jumping => {
                ("animateTransform", "attributeName=\"transform\" type=\"translate\" calcMode=\"discrete\"")
            }
            Self::Visible => ("animate", "attributeName=\"opacity\" calcMode=\"discrete\""),
        }
    }
}

/// The SMIL element that animates an attribute; empty for fewer than two key frames. The first value is valid
/// from the start, as SMIL requires, and the last value remains valid to the end.
pub(super) fn animate_element<T>(
    changed: AnimatedAttribute,
    pace: &PlaybackPace,
    keys: &[(f64, T)],
    written: impl Fn(&T) -> String,
) -> String {
    let Some((_, last)) = keys.last().filter(|_| keys.len() > 1) else { return String::new() };
    let (mut times, mut values) = (String::new(), String::new());
    for (i, (share, value)) in keys.iter().enumerate() {
        push_item(&mut times, &format_short(if i == 0 { 0.0 } else { *share }, 5));
        push_item(&mut values, &written(value));
    }
    if matches!(changed, AnimatedAttribute::Path | AnimatedAttribute::Place) {
        push_item(&mut times, "1"); // interpolation needs a value at the end
        push_item(&mut values, &written(last));
    }
    let (name, attributes) = changed.animating_element();
    let duration = format_short(pace.duration_s(), 3);
    format!(
        "<{name} {attributes} dur=\"{duration}s\" repeatCount=\"indefinite\" keyTimes=\"{times}\" \
         values=\"{values}\"/>"
    )
}

fn push_item(list: &mut String, item: &str) {
    let separator = if list.is_empty() { "" } else { ";" };
    let _ = write!(list, "{separator}{item}"); // writing to a string cannot fail
}

/// A number with at most `decimals` decimals.
pub(super) fn format_short(value: f64, decimals: usize) -> String {
    let written = format!("{value:.decimals$}");
    let trimmed =
        if written.contains('.') { written.trim_end_matches('0').trim_end_matches('.') } else { &written };
    if trimmed == "-0" { "0".to_owned() } else { trimmed.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figures::animation::PlaybackPart;

    #[test]
    fn few_key_frames_come_as_near_as_asked_for() {
        let wave: Vec<(f64, [f64; 2])> = (0..=1000)
            .map(|i| f64::from(i) / 1000.0)
            .map(|s| (s, [(6.0 * s).sin(), if s < 0.5 { 0.0 } else { s - 0.5 }]))
            .collect();
        let keys = simplify_key_frames(&wave, 1e-3);
        assert!((10..80).contains(&keys.len()), "{}", keys.len());
        for value in &wave {
            let after = keys.iter().position(|k| k.0 >= value.0).unwrap().max(1);
            assert!(deviation_from_line(&keys[after - 1], &keys[after], value) <= 1e-3 + 1e-12);
        }
        assert_eq!(simplify_key_frames(&[(0.0, [1.0]), (0.5, [1.0]), (1.0, [1.0])], 0.1).len(), 2);
        assert_eq!(simplify_key_frames::<1>(&[], 0.1), []);
    }

    #[test]
    fn an_animation_says_when_and_what_and_keeps_its_last_value() {
        let pace = PlaybackPace { parts: vec![PlaybackPart { from_s: 0.0, to_s: 0.05, slower: 20.0 }] };
        let moved = animate_element(AnimatedAttribute::Place, &pace, &[(0.01, 1.0), (0.25, 2.5)], |x| {
            format_short(*x, 1)
        });
        let expected = "<animateTransform attributeName=\"transform\" type=\"translate\" dur=\"2s\" \
        repeatCount=\"indefinite\" keyTimes=\"0;0.25;1\" values=\"1;2.5;2.5\"/>";
        assert_eq!(moved, expected);
        assert_eq!(
            animate_element(AnimatedAttribute::Place, &pace, &[(0.0, 1.0)], |x| format_short(*x, 1)),
            ""
        );
        assert!(
            animate_element(AnimatedAttribute::Visible, &pace, &[(0.0, true), (0.5, false)], |s| i32::from(
                *s
            )
            .to_string())
            .contains("keyTimes=\"0;0.5\" values=\"1;0\"")
        );
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!(
            [1.0, 0.25, -0.001, 100.0, 12.3456].map(|x| format_short(x, 2)),
            ["1", "0.25", "0", "100", "12.35"]
        );
    }
}
