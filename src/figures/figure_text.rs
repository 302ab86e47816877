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

    /// Title of the job.
    pub(crate) fn figure_title(&self) -> String {
        truncate_text(&self.job.title, TITLE_LETTERS)
    }

    /// A sentence, preceded by the name of the condition if the job has several.
    fn name_condition(&self, said: &str) -> String {
        let name = |name| format!("{}: {said}", truncate_text(name, NAME_LETTERS));
        self.distinct_name().map_or_else(|| said.to_owned(), name)
    }

    /// The line under a heading: `text`, preceded by a note if no traces are published.
    pub(crate) fn heading_note(&self, text: &str) -> String {
        about(if self.recording().is_none() { NO_TRACES } else { "" }, text)
    }

    /// Builds the block of a figure that shows recording and model.
    pub(crate) fn figure_block(&self, name: &str, words: FigureText, figure: Figure) -> FigureBlock {
        let mut figure = figure;
        figure.subtitle = about(&self.figure_title(), &figure.subtitle);
        figure.title = self.name_condition(&figure.title);
        if let Some(name) = self.distinct_name()
            && let Some(panel) = figure.panels.first_mut()
        {
            panel.title = about(&truncate_text(name, NAME_LETTERS), &panel.title);
        }
        let caption = self.name_condition(&words.caption);
        self.drawing_block(name, FigureText { caption, ..words }, Drawing::Chart(figure))
    }

    /// Builds the block of a figure that shows only the model. Conditions with the same run share this
    /// figure, so its caption names the condition.
    pub(crate) fn model_figure_block(&self, name: &str, words: FigureText, drawing: Drawing) -> FigureBlock {
        let caption = self.name_condition(&words.caption);
        let details = format!("{}{}", words.details, self.sharing_note()).trim_start().to_owned();
        self.drawing_block(name, FigureText { caption, details }, drawing)
    }

    fn drawing_block(
        &self,
        name: &str,
        FigureText { caption, details }: FigureText,
        drawing: Drawing,
    ) -> FigureBlock {
        let drawing = match drawing {
            Drawing::Chart(figure) => Drawing::Chart(Figure { watermarked: self.is_synthetic(), ..figure }),
            moving @ Drawing::Moving(_) => moving,
        };
        let file = format!("{name}.svg");
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

/// Number of letters of a parameter's name that replace a missing symbol.
const LETTERS: usize = 10;

/// Symbol of a parameter in the equations, or the first letters of its name if it has no symbol.
pub(super) fn parameter_symbol(name: &str) -> String {
    parameters::symbol_with_recording(name).unwrap_or_else(|| truncate_text(name, LETTERS))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_symbol_stands_for_a_known_name_and_a_short_form_for_any_other() {
        assert_eq!(
            ["friction.a", "friction.a@2", "something.unheard_of"].map(parameter_symbol),
            ["A", "A@2", "something\u{2026}"]
        );
    }
}
