//! Filters that remove or escape control characters in names and texts from files before they are shown.

use std::fmt::Write;

/// Text without control characters. Control characters, line separators and characters invalid in XML become
/// spaces; characters that change the direction of text are removed.
#[must_use]
pub fn make_printable(text: &str) -> String {
    text.chars().filter(|c| !is_bidi_control(*c)).map(|c| if is_control(c) { ' ' } else { c }).collect()
}

/// Text for a terminal. Every control character (line ends too) and every character that changes the
/// direction of text is written as its JSON escape, such as `\u001b`.
#[must_use]
pub fn escape_controls(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if is_bidi_control(c) || is_control(c) {
            let _ = write!(shown, "\\u{:04x}", u32::from(c)); // (writing to a String cannot fail)
        } else {
            shown.push(c);
        }
    }
    shown
}

fn is_bidi_control(c: char) -> bool {
    matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Whether a character controls a terminal or is invalid in XML. The code points of all these characters have
/// at most four hexadecimal digits.
fn is_control(c: char) -> bool {
    c.is_control() || matches!(c, '\u{2028}' | '\u{2029}' | '\u{fffe}' | '\u{ffff}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lose_what_steers_and_keep_everything_else() {
        assert_eq!(make_printable("a\u{202e}b\u{7}c\u{2066}\u{2028}d\u{200f}\u{ffff}"), "ab c d ");
        let family = "\u{1f468}\u{200d}\u{1f469}\u{200d}\u{1f467} \u{5d0}\u{5d1} <script>";
        assert_eq!(make_printable(family), family);
        assert_eq!(escape_controls(family), family);
    }

    #[test]
    fn what_steers_is_shown_as_what_json_reads_back() {
        let hostile: String = (0..0x3000u32).filter_map(char::from_u32).collect();
        let shown = escape_controls(&hostile);
        assert!(shown.chars().all(|c| !is_bidi_control(c) && !is_control(c)));
        let written = serde_json::to_string(&hostile).unwrap();
        assert_eq!(serde_json::from_str::<String>(&escape_controls(&written)).unwrap(), hostile);
    }
}
