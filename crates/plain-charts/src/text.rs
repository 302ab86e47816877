//! Text: estimated widths, wrapping and truncation. Widths are estimates, as the reader's fonts are unknown.

use super::style::{SMALL_MM, TEXT_MM};
use crate::printable::make_printable;
use unicode_width::{UnicodeWidthChar, UnicodeWidthStr};

/// Ratio of the mean width of a sans-serif letter to the font size.
pub(super) const LETTER: f64 = 0.58;
/// Ratio of the mean width of a plain letter to the font size in DejaVu Sans, the widest fallback font of
/// browsers. Lines must fit in this font.
pub(super) const WIDE_LETTER: f64 = 0.63;
/// Ratio of the mean width of a bold letter to the font size in DejaVu Sans, the widest fallback font of
/// browsers.
pub(super) const WIDE_BOLD_LETTER: f64 = 0.7;
const ELLIPSIS: char = '\u{2026}';
/// Largest allowed width of the first of two lines, as a fraction of the width of the whole text.
const NEAR_MIDDLE: f64 = 0.65;

/// Estimated width of a text, mm. An ideograph or emoji counts as two letters, a combining mark as none.
pub(super) fn text_width(text: &str, size_mm: f64) -> f64 {
    text.width() as f64 * LETTER * size_mm
}

fn letter_count(letter: char) -> usize {
    letter.width().unwrap_or(0)
}

/// Wraps text at spaces to lines of at most `width_mm`; words wider than a line are broken.
pub(super) fn wrap_lines(text: &str, letter_mm: f64, width_mm: f64) -> Vec<String> {
    let most = (width_mm / letter_mm).max(2.0) as usize;
    let mut lines = vec![String::new()];
    let mut used = 0;
    for word in text.split_inclusive(' ') {
        if used > 0 && used + word.trim_end().width() > most {
            lines.push(String::new());
            used = 0;
        }
        for letter in word.chars() {
            if used + letter_count(letter) > most && letter != ' ' {
                lines.push(String::new());
                used = 0;
            }
            if let Some(line) = lines.last_mut() {
                line.push(letter);
            }
            used += letter_count(letter);
        }
    }
    lines
}

/// Text of at most `width_mm` in the widest font; longer text is cut and ends with an ellipsis.
pub(super) fn truncate_text(text: &str, size_mm: f64, width_mm: f64) -> String {
    let letter_mm = WIDE_LETTER * size_mm;
    if text.width() as f64 * letter_mm <= width_mm {
        return text.to_owned();
    }
    let most = (width_mm / letter_mm).max(2.0) as usize - 1;
    let mut used = 0;
    let kept = text.chars().take_while(|letter| {
        used += letter_count(*letter);
        used <= most
    });
    let kept: String = kept.collect();
    format!("{}{ELLIPSIS}", kept.trim_end())
}

/// Text in one line of at most `width_mm`, or in two lines of small letters. The second line is cut if
/// necessary.
pub(super) fn wrap_in_two_lines(text: &str, width_mm: f64) -> String {
    let text = make_printable(text);
    if text.width() as f64 * WIDE_LETTER * TEXT_MM <= width_mm {
        return text;
    }
    // text that fits into one line of small letters is broken near its middle
    let own_mm = text.width() as f64 * WIDE_LETTER * SMALL_MM;
    let line_mm = if own_mm <= width_mm { NEAR_MIDDLE * own_mm } else { width_mm };
    let broken = wrap_lines(&text, WIDE_LETTER * SMALL_MM, line_mm);
    match broken.split_first() {
        Some((first, rest)) if !rest.is_empty() => {
            format!("{}\n{}", first.trim_end(), truncate_text(rest.concat().trim_end(), SMALL_MM, width_mm))
        }
        _ => truncate_text(&text, TEXT_MM, width_mm),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_text_is_broken_at_words_and_long_words_in_themselves() {
        let broken = |text: &str| wrap_lines(text, 1.0, 10.5);
        assert_eq!(broken("one two three four"), ["one two ", "three four"]);
        assert_eq!(broken("abcdefghijklmno pq"), ["abcdefghij", "klmno pq"]);
        assert_eq!([broken("exactlyten"), broken("")], [[String::from("exactlyten")], [String::new()]]);
    }

    #[test]
    fn letters_are_counted_as_wide_as_they_are() {
        assert_eq!(text_width("\u{b5}m\u{b2}", 1.0), text_width("um2", 1.0));
        assert_eq!(text_width("\u{6f22}\u{1f600}", 1.0), text_width("abcd", 1.0));
        assert_eq!(text_width("e\u{301}", 1.0), text_width("e", 1.0));
        assert_eq!(wrap_lines("\u{6f22}\u{6f22}\u{6f22}", 1.0, 4.0).len(), 2);
    }

    #[test]
    fn what_is_too_long_ends_in_an_ellipsis() {
        assert_eq!(truncate_text("abcdef", 1.0, 6.01 * WIDE_LETTER), "abcdef");
        assert_eq!(truncate_text("abcdefg", 1.0, 6.01 * WIDE_LETTER), "abcde\u{2026}");
        assert_eq!(truncate_text("ab cdefg", 1.0, 4.01 * WIDE_LETTER), "ab\u{2026}");
    }

    #[test]
    fn names_break_into_two_lines_of_small_letters() {
        let width_mm = 20.5 * WIDE_LETTER * SMALL_MM;
        assert_eq!(wrap_in_two_lines("high band", width_mm), "high band");
        assert_eq!(wrap_in_two_lines("low band after flips", width_mm), "low band\nafter flips");
        assert_eq!(
            wrap_in_two_lines("deflection at 0.08 m/s, before", width_mm),
            "deflection at 0.08\nm/s, before"
        );
        assert_eq!(
            wrap_in_two_lines("deflection at 0.08 m/s, before the reversal", width_mm),
            "deflection at 0.08\nm/s, before the rev\u{2026}"
        );
        assert_eq!(wrap_in_two_lines("a\nb", width_mm), "a b");
    }
}
