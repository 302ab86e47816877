//! Files that the program reads, damaged: refused with a message, or used; never a panic.

#[path = "../../fuzz/src/readers.rs"]
mod fuzzed;
#[path = "../../fuzz/src/imports.rs"]
mod fuzzed_imports;

use fuzzed::READERS;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::path::Path;

/// Damaged texts of each seed.
const DAMAGED: usize = 1_000;
/// What a slip of the hand or of a disk puts into a file.
const PIECES: [&str; 16] =
    ["", "-", "0", "9", "1e999", "nan", "-0.0", "\"", "]", "[", "=", "\n", ",", "\u{feff}", "\0", "null"];

/// The fuzzer is a workspace of its own: this builds its checks, and tries them on its seeds.
#[test]
fn every_fixture_passes_the_check_of_the_fuzzer() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures");
    let mut checked = 0;
    for format in wiperlab::import::format_names() {
        let Ok(fixtures) = std::fs::read_dir(folder.join(format.replace('-', "_"))) else { continue };
        for fixture in fixtures {
            fuzzed_imports::check(format, &std::fs::read(fixture.unwrap().path()).unwrap());
            checked += 1;
        }
    }
    assert!(checked > 50, "{checked}");
}

#[test]
fn a_seed_is_read_and_whatever_is_damaged_is_refused_or_used() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(16);
    for reader in READERS {
        for seed in reader.seeds {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(seed);
            let text = std::fs::read_to_string(&path).unwrap();
            (reader.check)(&text);
            for _ in 0..DAMAGED {
                let text = damaged(&text, &mut random);
                let read = std::panic::catch_unwind(|| (reader.check)(&text));
                assert!(read.is_ok(), "{} from {seed}:\n{text}", reader.name);
            }
        }
    }
}

/// One to three places of `text` are replaced.
fn damaged(text: &str, random: &mut impl Rng) -> String {
    let mut letters: Vec<char> = text.chars().collect();
    for _ in 0..random.random_range(1..=3) {
        let from = random.random_range(0..=letters.len());
        let to = (from + random.random_range(0..=4)).min(letters.len());
        let piece = match random.random_range(0..PIECES.len() + 2) {
            at if at < PIECES.len() => PIECES[at].chars().collect(),
            at if at == PIECES.len() => letters[from..].to_vec(),
            _ => letters[..from.min(40)].to_vec(),
        };
        letters.splice(from..to, piece);
    }
    letters.into_iter().collect()
}
