//! What was measured beside the model: histories, spectra, spectrograms, portraits of the motion, friction; with captions that say what is seen.

mod aims;
mod histories;
mod laws;
mod portraits;
mod ring_downs;
mod spectral;
mod spectrograms;
mod words;

use super::pair::{self, Pair};
use crate::report::FigureBlock;

/// The figures, condition by condition: the motion itself, then what it is made of, then the law behind it.
pub(super) fn blocks(pairs: &[Pair]) -> Vec<FigureBlock> {
    let of_condition =
        |pair: &Pair| [histories::blocks(pair), spectral::blocks(pair), spectrograms::blocks(pair), portraits::blocks(pair), laws::blocks(pair)].concat();
    distinct(pairs.iter().flat_map(of_condition).collect())
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

/// A name from a job as part of a file name: letters and digits, everything else a hyphen.
fn file_word(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_figure_overwrites_another() {
        let named = |file: &str| FigureBlock { file: file.to_owned(), ..FigureBlock::default() };
        let files: Vec<String> = distinct(["a.svg", "a.svg", "a-2.svg", "a.svg"].map(named).to_vec()).into_iter().map(|b| b.file).collect();
        assert_eq!(files, ["a.svg", "a-2.svg", "a-2-2.svg", "a-3.svg"]);
    }
}
