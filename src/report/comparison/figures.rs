//! What was measured beside the model: histories, spectra, spectrograms, portraits of the motion, friction;
//! with captions that say what is seen.

mod aims;
mod histories;
mod laws;
mod portraits;
mod ring_downs;
mod spectral;
mod spectrograms;

use super::pair::{self, Pair};
use crate::report::FigureBlock;
use rayon::prelude::*;

/// The figures, condition by condition: the motion itself, then what it is made of, then the law behind it.
pub(super) fn blocks(pairs: &[Pair]) -> Vec<FigureBlock> {
    let law = |pair: &Pair| pair.shared.as_ref().map_or_else(Vec::new, |shared| laws::blocks(pair, shared));
    let of_condition = |pair: &Pair| {
        [
            histories::blocks(pair),
            spectral::blocks(pair),
            spectrograms::blocks(pair),
            portraits::blocks(pair),
            law(pair),
        ]
        .concat()
    };
    distinct(pairs.par_iter().flat_map_iter(of_condition).collect())
}

/// Names that differ in signs alone are one as file names: later ones get a number.
fn distinct(mut blocks: Vec<FigureBlock>) -> Vec<FigureBlock> {
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

/// Longest part of a file name that a name from a job makes: file systems take some 255 bytes of a whole
/// name.
const LONGEST_WORD: usize = 60;

/// A name from a job as part of a file name: letters and digits, everything else a hyphen, no longer than a
/// file system takes.
fn file_word(name: &str) -> String {
    let word: String = name
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' })
        .take(LONGEST_WORD)
        .collect();
    if word.chars().all(|c| c == '-') { "window".to_owned() } else { word } // (a name in another script leaves no letter)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_of_any_length_and_script_makes_a_file_name() {
        let long = file_word(&"A very long name, ".repeat(20));
        assert!(long.starts_with("a-very-long-name--a-very") && long.len() == LONGEST_WORD, "{long}");
        assert_eq!([file_word("high, lowest"), file_word("\u{53cd}\u{8ee2}")], ["high--lowest", "window"]);
    }

    #[test]
    fn no_figure_overwrites_another() {
        let named = |file: &str| FigureBlock { file: file.to_owned(), ..FigureBlock::default() };
        let files: Vec<String> = distinct(["a.svg", "a.svg", "a-2.svg", "a.svg"].map(named).to_vec())
            .into_iter()
            .map(|b| b.file)
            .collect();
        assert_eq!(files, ["a.svg", "a-2.svg", "a-2-2.svg", "a-3.svg"]);
    }
}
