//! What stands for a parameter in figures.

use crate::blade::parameters;
use crate::text::truncate_text;

/// Letters of a name that stand in for a symbol.
const LETTERS: usize = 10;

/// Symbol of a parameter in the equations; a short form of its name where it has none.
pub(super) fn parameter_symbol(name: &str) -> String {
    parameters::find_parameter(name).map_or_else(|| truncate_text(name, LETTERS), |row| row.symbol.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_symbol_stands_for_a_known_name_and_a_short_form_for_any_other() {
        assert_eq!(
            [parameter_symbol("friction.a"), parameter_symbol("something.unheard_of")],
            ["A".to_owned(), "something\u{2026}".to_owned()]
        );
    }
}
