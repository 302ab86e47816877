//! TOML with comments.

use crate::text::{make_printable, wrap_words};
use serde::Serialize;

/// Widest line of a comment, characters.
const WIDTH: usize = 100;

/// A file of TOML as it grows.
#[derive(Default)]
pub(super) struct CommentedToml(String);

impl CommentedToml {
    /// A comment, broken into lines.
    pub(super) fn add_comment(mut self, words: &str) -> Self {
        wrap_words(&make_printable(words), WIDTH - 2)
            .iter()
            .for_each(|line| self.push_line(&format!("# {line}")));
        self
    }

    /// Several comments, each on lines of its own.
    pub(super) fn add_comments(self, all: impl IntoIterator<Item = impl AsRef<str>>) -> Self {
        all.into_iter().fold(self, |text, words| text.add_comment(words.as_ref()))
    }

    /// Lines as they are.
    pub(super) fn add_line(mut self, line: &str) -> Self {
        self.push_line(line);
        self
    }

    /// An empty line.
    pub(super) fn add_empty_line(self) -> Self {
        self.add_line("")
    }

    /// A key with a text.
    pub(super) fn add_text(self, key: &str, value: &str) -> Self {
        let value = toml::Value::String(value.to_owned());
        self.add_line(&format!("{key} = {value}"))
    }

    /// A key with a number.
    pub(super) fn add_number(self, key: &str, value: f64) -> Self {
        self.add_line(&format!("{key} = {}", format_toml_number(value)))
    }

    /// A key with a word of a list, or several.
    pub(super) fn add_word(self, key: &str, value: impl Serialize) -> Self {
        // (words and lists of them cannot fail)
        let value = toml::Value::try_from(value).unwrap_or_else(|_| toml::Value::Array(Vec::new()));
        self.add_line(&format!("{key} = {value}"))
    }

    pub(super) fn into_text(self) -> String {
        self.0
    }

    fn push_line(&mut self, line: &str) {
        self.0.push_str(line.trim_end());
        self.0.push('\n');
    }
}

/// The shortest decimal number that reads back as the same, with a point or a power of ten, as TOML wants it.
pub(super) fn format_toml_number(value: f64) -> String {
    format!("{value:?}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comment_stays_a_comment_whatever_a_file_is_called() {
        let text = CommentedToml::default().add_comment("of data/a\nformat = 2\r# and \u{2028}b").into_text();
        assert!(text.lines().all(|line| line.starts_with("# ")), "{text}");
        let long = CommentedToml::default().add_comment(&"word ".repeat(60)).into_text();
        assert!(long.lines().count() > 2 && long.lines().all(|line| line.chars().count() <= WIDTH));
    }

    #[test]
    fn numbers_and_texts_read_back_as_they_are() {
        let text = CommentedToml::default()
            .add_number("a", 7.687e-12)
            .add_number("b", 20.0)
            .add_text("c", "a\"b\\c\n")
            .into_text();
        let table: toml::Table = text.parse().unwrap();
        assert_eq!((table["a"].as_float(), table["b"].as_float()), (Some(7.687e-12), Some(20.0)));
        assert_eq!(table["c"].as_str(), Some("a\"b\\c\n"));
    }
}
