//! Short phrases: lists, counts, intervals, truncated names.

/// A list of words: "a, b and c".
pub(crate) fn join_with_and(items: &[String]) -> String {
    match items {
        [] => String::new(),
        [one] => one.clone(),
        [all @ .., last] => format!("{} and {last}", all.join(", ")),
    }
}

/// A noun with a plural `s` unless the count is 1.
pub(crate) fn pluralise(noun: &str, count: usize) -> String {
    if count == 1 { noun.to_owned() } else { format!("{noun}s") }
}

/// A number of times in words: "once", "twice", "14 times".
pub(crate) fn format_times(count: usize) -> String {
    match count {
        1 => "once".to_owned(),
        2 => "twice".to_owned(),
        n => format!("{n} times"),
    }
}

/// An interval such as `0.09656 to 0.1355`, `above 0.09656` or `below 0.1355`.
pub(crate) fn format_interval(
    lower: Option<f64>,
    upper: Option<f64>,
    written: impl Fn(f64) -> String,
) -> String {
    match (lower, upper) {
        (Some(lower), Some(upper)) => format!("{} to {}", written(lower), written(upper)),
        (Some(lower), None) => format!("above {}", written(lower)),
        (None, Some(upper)) => format!("below {}", written(upper)),
        (None, None) => "open on both sides".to_owned(),
    }
}

/// A text truncated to `most` characters; if truncated, its last character is an ellipsis.
pub(crate) fn truncate_text(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.to_owned();
    }
    let kept: String = text.chars().take(most.saturating_sub(1)).collect();
    format!("{}\u{2026}", kept.trim_end())
}

/// The text with a capital first letter.
pub(crate) fn capitalise(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Message of a panic; `None` if its payload is not text.
pub(crate) fn panic_message(payload: &(dyn std::any::Any + Send)) -> Option<String> {
    let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| payload.downcast_ref::<String>().cloned())
}

/// Breaks a text into lines of at most `width` characters; a longer word has a line of its own.
pub(crate) fn wrap_words(words: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in words.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::text::format_number;

    #[test]
    fn an_open_end_is_said() {
        let of = |lower, upper| format_interval(lower, upper, format_number);
        assert_eq!(of(Some(1.0), Some(2.0)), "1.000 to 2.000");
        assert_eq!(
            [of(Some(1.0), None), of(None, Some(2.0)), of(None, None)],
            ["above 1.000", "below 2.000", "open on both sides"]
        );
    }

    #[test]
    fn long_names_end_in_an_ellipsis() {
        assert_eq!(
            [
                truncate_text("deflection after", 12),
                truncate_text("release", 12),
                truncate_text("\u{e9}\u{e9}\u{e9}", 2)
            ],
            ["deflection\u{2026}", "release", "\u{e9}\u{2026}"]
        );
    }

    #[test]
    fn lists_and_counts_are_words() {
        assert_eq!(join_with_and(&["a".to_owned(), "b".to_owned(), "c".to_owned()]), "a, b and c");
        assert_eq!(
            [format_times(1), format_times(14), pluralise("step", 1), pluralise("step", 0)],
            ["once", "14 times", "step", "steps"]
        );
        assert_eq!(capitalise("\u{e9}nergie"), "\u{c9}nergie");
    }
}
