//! Sentences in which names that users chose are kept apart from the program's own words.
//!
//! A name may be written from right to left, or contain characters that change the direction of the text that
//! follows. The page isolates each name; text without markup omits such characters.

use crate::text::make_printable;
use serde::{Serialize, Serializer};

/// A sentence: a sequence of the program's own words and of names.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Sentence(pub(crate) Vec<SentencePart>);

/// A part of a sentence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum SentencePart {
    /// The program's own words.
    Words(String),
    /// A name that a user chose.
    Name(String),
}

impl Sentence {
    /// A sentence of the program's own words.
    pub(crate) fn new(words: impl Into<String>) -> Self {
        Self::default().with_words(words)
    }

    /// Appends words of the program.
    pub(crate) fn with_words(mut self, words: impl Into<String>) -> Self {
        self.0.push(SentencePart::Words(words.into()));
        self
    }

    /// Appends a name.
    pub(crate) fn with_name(mut self, name: &str) -> Self {
        self.0.push(SentencePart::Name(make_printable(name)));
        self
    }

    /// Appends another sentence.
    pub(crate) fn with_sentence(mut self, other: Self) -> Self {
        self.0.extend(other.0);
        self
    }

    /// The sentence as text without markup.
    pub(crate) fn plain_text(&self) -> String {
        self.0
            .iter()
            .map(|piece| match piece {
                SentencePart::Words(text) | SentencePart::Name(text) => text.as_str(),
            })
            .collect()
    }
}

impl<T: Into<String>> From<T> for Sentence {
    fn from(words: T) -> Self {
        Self::new(words)
    }
}

impl Serialize for Sentence {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(&self.plain_text())
    }
}

/// A statement with supporting details.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Statement {
    /// The statement itself.
    pub statement: Sentence,
    /// Details, each on a line of its own.
    pub details: Vec<Sentence>,
    /// Whether the statement is good news; `None` if it is neither good nor bad.
    pub good: Option<bool>,
}

impl Statement {
    /// A statement without details.
    pub(crate) fn new(statement: impl Into<Sentence>) -> Self {
        Self { statement: statement.into(), ..Self::default() }
    }

    /// A statement with its details, good or bad.
    pub(crate) fn with_details(
        statement: impl Into<Sentence>,
        details: Vec<Sentence>,
        good: Option<bool>,
    ) -> Self {
        Self { statement: statement.into(), details, good }
    }

    /// Sets whether the statement is good.
    pub(crate) fn with_verdict(self, good: bool) -> Self {
        Self { good: Some(good), ..self }
    }

    /// The statement and its details as one line of text.
    pub(crate) fn plain_text(&self) -> String {
        let plain = |sentence: &Sentence| sentence.plain_text().trim_end_matches('.').to_owned();
        let details = self.details.iter().map(plain).collect::<Vec<_>>().join("; ");
        let statement = self.statement.plain_text();
        match (details.is_empty(), statement.ends_with('.')) {
            (true, _) => statement,
            (false, true) => format!("{statement} {details}."),
            (false, false) => format!("{statement}: {details}."),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_statement_is_one_line_with_its_details() {
        let name = Sentence::new("open: ").with_name("a\u{202e}");
        let statement = Statement {
            statement: Sentence::new("One is met."),
            details: vec![name, Sentence::new("x")],
            ..Statement::default()
        };
        assert_eq!(statement.plain_text(), "One is met. open: a; x.");
        assert_eq!(Statement::new(Sentence::new("Nothing.")).plain_text(), "Nothing.");
    }
}
