//! The one filter that every name and text from a file passes before it is shown.

/// Text with nothing in it that steers instead of being read. Control characters, line separators and what
/// XML has no place for become spaces; characters that turn the direction of what follows are left out.
#[must_use]
pub fn printable(text: &str) -> String {
    text.chars().filter(|c| !turns(*c)).map(|c| if steers(c) { ' ' } else { c }).collect()
}

fn turns(c: char) -> bool {
    matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

fn steers(c: char) -> bool {
    c.is_control() || matches!(c, '\u{2028}' | '\u{2029}' | '\u{fffe}' | '\u{ffff}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lose_what_steers_and_keep_everything_else() {
        assert_eq!(printable("a\u{202e}b\u{7}c\u{2066}\u{2028}d\u{200f}\u{ffff}"), "ab c d ");
        let family = "\u{1f468}\u{200d}\u{1f469}\u{200d}\u{1f467} \u{5d0}\u{5d1} <script>";
        assert_eq!(printable(family), family);
    }
}
