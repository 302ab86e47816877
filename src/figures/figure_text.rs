//! Texts and file names of the figures of a condition.

use super::{Drawing, FigureBlock, FigureText, NO_TRACES, about};
use crate::compare::ConditionComparison;
use crate::model::parameters;
use crate::text::{join_with_and, truncate_text};
use plain_charts::Figure;

/// Maximum number of letters of a title in a heading. A longer title is cut to leave room for the figure.
const TITLE_LETTERS: usize = 120;
/// Maximum number of letters of a name in a heading. A longer name is cut to leave room for the figure.
const NAME_LETTERS: usize = 50;

impl ConditionComparison<'_> {
    /// Name of the condition; `None` if it is the only one of its job.
    fn distinct_name(&self) -> Option<&str> {
        Some(self.name()).filter(|_| self.job.conditions.len() > 1)
    }

    /// Title of the job, followed by the condition if the job has several.
    pub(crate) fn figure_title(&self) -> String {
        let name = |name| format!(", {}", truncate_text(name, NAME_LETTERS));
        let of = self.distinct_name().map_or_else(String::new, name);
        format!("{}{of}", truncate_text(&self.job.title, TITLE_LETTERS))
    }

    /// The line under a heading: `text`, preceded by a note if no traces are published.
    pub(crate) fn heading_note(&self, text: &str) -> String {
        about(if self.recording().is_none() { NO_TRACES } else { "" }, text)
    }

    /// Name of the data source: "the synthetic recording `twin`", "the recording ..." or "the fitted model
    /// alone, ...".
    pub(crate) fn source_name(&self) -> String {
        let kind = self.source_kind();
        self.recording().map_or_else(|| kind.to_owned(), |r| format!("{kind} {}", r.name()))
    }

    /// Kind of the data source: [`Self::source_name`] without the name of the recording.
    pub(crate) fn source_kind(&self) -> &'static str {
        match self.recording() {
            Some(r) if r.is_synthetic() => "the synthetic recording",
            Some(_) => "the recording",
            None => "the fitted model alone, as no traces are published",
        }
    }

    /// Builds the block of a figure that shows recording and model.
    pub(crate) fn figure_block(&self, name: &str, words: FigureText, figure: Figure) -> FigureBlock {
        let figure = Figure { subtitle: about(&self.figure_title(), &figure.subtitle), ..figure };
        self.drawing_block(name, words, Drawing::Chart(figure))
    }

    /// Builds the block of a figure that shows only the model. Conditions with the same run share this
    /// figure, so its details name the condition.
    pub(crate) fn model_figure_block(&self, name: &str, words: FigureText, drawing: Drawing) -> FigureBlock {
        let of = self.distinct_name().map_or_else(String::new, |name| format!("{name}: "));
        let details = format!("{of}{}{}", words.details, self.sharing_note());
        self.drawing_block(name, FigureText { details, ..words }, drawing)
    }

    fn drawing_block(
        &self,
        name: &str,
        FigureText { caption, details }: FigureText,
        drawing: Drawing,
    ) -> FigureBlock {
        let number = self.distinct_name().map_or_else(String::new, |_| format!("-{}", self.condition + 1));
        let drawing = match drawing {
            Drawing::Chart(figure) => Drawing::Chart(Figure { watermarked: self.is_synthetic(), ..figure }),
            moving @ Drawing::Moving(_) => moving,
        };
        let file = format!("{name}{number}.svg");
        FigureBlock { file, caption, details, drawing, condition: Some(self.condition) }
    }

    /// Sentence on other conditions with the same run; empty if there are none.
    pub(crate) fn sharing_note(&self) -> String {
        let same = self.same_run.iter().flatten().filter_map(|i| self.job.conditions.get(*i));
        let names: Vec<String> = same.map(|c| truncate_text(&c.name, NAME_LETTERS)).collect();
        if names.is_empty() {
            return String::new();
        }
        let names = join_with_and(&names);
        format!(" The model's run is the same in {names}, but for the clock of the recording.")
    }
}

/// Appends numbers to repeated file names: names that differ only in punctuation give the same file name.
pub(crate) fn make_file_names_unique(mut blocks: Vec<FigureBlock>) -> Vec<FigureBlock> {
    for i in 1..blocks.len() {
        let (before, rest) = blocks.split_at_mut(i);
        let taken = |file: &str| before.iter().any(|b| b.file == file);
        let Some(block) = rest.first_mut().filter(|b| taken(&b.file)) else { continue };
        let stem = block.file.trim_end_matches(".svg").to_owned();
        let free = (2..).map(|n| format!("{stem}-{n}.svg")).find(|file| !taken(file));
        block.file = free.unwrap_or_default();
    }
    blocks
}

/// Maximum number of letters of a name in a file name; file systems allow about 255 bytes for the whole file
/// name.
const LONGEST_WORD: usize = 60;

/// A name as part of a file name: letters and digits in lower case, a hyphen for any other character, cut at
/// [`LONGEST_WORD`] letters.
pub(crate) fn file_name_part(name: &str) -> String {
    let letter = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' };
    let word: String = name.chars().map(letter).take(LONGEST_WORD).collect();
    // a name in a non-Latin script gives only hyphens
    if word.chars().all(|c| c == '-') { "window".to_owned() } else { word }
}

/// Number of letters of a parameter's name that replace a missing symbol.
const LETTERS: usize = 10;

/// Symbol of a parameter in the equations, or the first letters of its name if it has no symbol.
pub(super) fn parameter_symbol(name: &str) -> String {
    parameters::find_parameter(name).map_or_else(|| truncate_text(name, LETTERS), |row| row.symbol.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_of_any_length_and_script_makes_a_file_name() {
        let long = file_name_part(&"A very long name, ".repeat(20));
        assert!(long.starts_with("a-very-long-name--a-very") && long.len() == LONGEST_WORD, "{long}");
        assert_eq!(
            [file_name_part("high, lowest"), file_name_part("\u{53cd}\u{8ee2}")],
            ["high--lowest", "window"]
        );
    }

    #[test]
    fn no_figure_overwrites_another() {
        let named = |file: &str| FigureBlock { file: file.to_owned(), ..FigureBlock::default() };
        let files: Vec<String> =
            make_file_names_unique(["a.svg", "a.svg", "a-2.svg", "a.svg"].map(named).to_vec())
                .into_iter()
                .map(|b| b.file)
                .collect();
        assert_eq!(files, ["a.svg", "a-2.svg", "a-2-2.svg", "a-3.svg"]);
    }

    #[test]
    fn a_symbol_stands_for_a_known_name_and_a_short_form_for_any_other() {
        assert_eq!(
            [parameter_symbol("friction.a"), parameter_symbol("something.unheard_of")],
            ["A".to_owned(), "something\u{2026}".to_owned()]
        );
    }
}
