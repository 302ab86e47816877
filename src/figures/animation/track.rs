//! What changes over an animation, as the few key frames that show it: SMIL's attributes, no script.

use super::pace::PlaybackPace;
use std::fmt::Write;

/// Values over the animation: when, as a share of it, and what.
pub(super) type KeyFrames<const N: usize> = Vec<(f64, [f64; N])>;

/// The key frames between which straight lines are nowhere farther from the values than `tolerance` (Douglas
/// and Peucker, over time).
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

/// How far a value is from the straight line between two others.
fn deviation_from_line<const N: usize>(
    from: &(f64, [f64; N]),
    to: &(f64, [f64; N]),
    value: &(f64, [f64; N]),
) -> f64 {
    let share = if to.0 > from.0 { (value.0 - from.0) / (to.0 - from.0) } else { 0.0 };
    (0..N).map(|k| (from.1[k] + share * (to.1[k] - from.1[k]) - value.1[k]).abs()).fold(0.0, f64::max)
}

/// How an element changes: which element does it, and the attributes that say what.
#[derive(Debug, Clone, Copy)]
pub(super) enum AnimatedAttribute {
    /// The path of a line.
    Path,
    /// The place of a group.
    Place,
    /// The same from one place to the next without what lies between.
    Jumping,
    /// Whether it is visible.
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

/// The animating element of an element that changes so. The first value is shown from the start, as SMIL
/// requires, and the last one to the end. Nothing for something that stays as it is.
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
        push_item(&mut times, "1"); // straight lines need an end
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

/// A number with at most this many decimals.
pub(super) fn format_short(value: f64, decimals: usize) -> String {
    let written = format!("{value:.decimals$}");
    let trimmed =
        if written.contains('.') { written.trim_end_matches('0').trim_end_matches('.') } else { &written };
    if trimmed == "-0" { "0".to_owned() } else { trimmed.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::super::pace::PlaybackPart;
    use super::*;

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
