//! Where the tip sticks, as bands that a figure can show.

use crate::chart::{Colour, ShadedSpan};

/// Share of the span below which two sticks are shown as one band of cycles: less than a millimetre on a
/// page.
const MIN_STICK_GAP: f64 = 0.005;

const STICKS_LABEL: &str = "tip sticks (model)";
const CYCLES_LABEL: &str = "stick-slip cycles (model)";

/// Sticks that stand alone, and cycles of sticks too close to stand apart, within a span.
pub(crate) fn stick_spans(stick_s: &[(f64, f64)], (from, to): (f64, f64)) -> Vec<ShadedSpan> {
    let shown: Vec<(f64, f64)> =
        stick_s.iter().filter(|s| s.1 > from && s.0 < to).map(|s| (s.0.max(from), s.1.min(to))).collect();
    let apart = MIN_STICK_GAP * (to - from);
    let long = |s: &(f64, f64)| s.1 - s.0 > apart;
    // a stick that is long enough to be visible is a band of its own, however close the next one is
    let groups = shown.chunk_by(|a, b| b.0 - a.1 < apart && !long(a) && !long(b));
    let band = |group: &[(f64, f64)]| {
        let (first, last) = (group.first()?, group.last()?);
        // (black is darker than orange in grey too)
        let (label, colour) =
            if group.len() > 1 { (CYCLES_LABEL, Colour::Orange) } else { (STICKS_LABEL, Colour::Black) };
        Some(ShadedSpan {
            label: label.to_owned(),
            colour,
            from: first.0,
            to: last.1,
            ..ShadedSpan::default()
        })
    };
    groups.filter_map(band).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cycles_that_cannot_be_told_apart_are_one_band_and_long_sticks_stay() {
        let mut stick_s = vec![(0.1, 0.3), (0.301, 0.302)];
        stick_s.extend((0..100).map(|i| (f64::from(500 + i) / 1000.0, f64::from(5004 + 10 * i) / 10_000.0)));
        stick_s.push((2.0, 3.0));
        let found: Vec<_> =
            stick_spans(&stick_s, (0.0, 1.0)).into_iter().map(|b| (b.label, b.from, b.to)).collect();
        let sticks = |from, to| (STICKS_LABEL.to_owned(), from, to);
        assert_eq!(found, [sticks(0.1, 0.3), sticks(0.301, 0.302), (CYCLES_LABEL.to_owned(), 0.5, 0.5994)]);
    }
}
