//! TOML with comments.

use crate::text::{printable, wrapped};
use serde::Serialize;

/// Widest line of a comment, characters.
const WIDTH: usize = 100;

/// A file of TOML as it grows.
#[derive(Default)]
pub(super) struct Commented(String);

impl Commented {
    /// A comment, broken into lines.
    pub(super) fn comment(mut self, words: &str) -> Self {
        wrapped(&printable(words), WIDTH - 2).iter().for_each(|line| self.push(&format!("# {line}")));
        self
    }

    /// Several comments, each on lines of its own.
    pub(super) fn comments(self, all: impl IntoIterator<Item = impl AsRef<str>>) -> Self {
        all.into_iter().fold(self, |text, words| text.comment(words.as_ref()))
    }

    /// Lines as they are.
    pub(super) fn line(mut self, line: &str) -> Self {
        self.push(line);
        self
    }

    /// An empty line.
    pub(super) fn gap(self) -> Self {
        self.line("")
    }

    /// A key with a text.
    pub(super) fn text(self, key: &str, value: &str) -> Self {
        let value = toml::Value::String(value.to_owned());
        self.line(&format!("{key} = {value}"))
    }

    /// A key with a number.
    pub(super) fn number(self, key: &str, value: f64) -> Self {
        self.line(&format!("{key} = {}", written(value)))
    }

    /// A key with a word of a list, or several.
    pub(super) fn word(self, key: &str, value: impl Serialize) -> Self {
        // (words and lists of them cannot fail)
        let value = toml::Value::try_from(value).unwrap_or_else(|_| toml::Value::Array(Vec::new()));
        self.line(&format!("{key} = {value}"))
    }

    pub(super) fn end(self) -> String {
        self.0
    }

    fn push(&mut self, line: &str) {
        self.0.push_str(line.trim_end());
        self.0.push('\n');
    }
}

/// The shortest decimal number that reads back as the same, with a point or a power of ten, as TOML wants it.
pub(super) fn written(value: f64) -> String {
    format!("{value:?}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comment_stays_a_comment_whatever_a_file_is_called() {
        let text = Commented::default().comment("of data/a\nformat = 2\r# and \u{2028}b").end();
        assert!(text.lines().all(|line| line.starts_with("# ")), "{text}");
        let long = Commented::default().comment(&"word ".repeat(60)).end();
        assert!(long.lines().count() > 2 && long.lines().all(|line| line.chars().count() <= WIDTH));
    }

    #[test]
    fn numbers_and_texts_read_back_as_they_are() {
        let text = Commented::default().number("a", 7.687e-12).number("b", 20.0).text("c", "a\"b\\c\n").end();
        let table: toml::Table = text.parse().unwrap();
        assert_eq!((table["a"].as_float(), table["b"].as_float()), (Some(7.687e-12), Some(20.0)));
        assert_eq!(table["c"].as_str(), Some("a\"b\\c\n"));
    }
}
