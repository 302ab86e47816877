//! The sketch of the glossary is what its command draws, and can be read.

use crate::raster::{colliding, drawn, near};
use crate::sketch_file;

use std::path::Path;

#[test]
fn the_sketch_is_what_its_command_draws() {
    let (path, svg) = sketch_file::sketch(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
    assert_eq!(
        std::fs::read_to_string(&path).unwrap(),
        svg,
        "{}: run `cargo run --release --example sketch`",
        path.display()
    );
}

#[test]
fn its_words_and_links_are_seen() {
    let (_, svg) = sketch_file::sketch(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
    let map = drawn(&svg);
    assert_eq!(colliding(&svg), Vec::<[String; 2]>::new());
    for (link, colour) in [("neck", (0x00, 0x72, 0xb2)), ("lip", (0xc4, 0x82, 0x00))] {
        assert!(near(&map, colour) > 500, "{link}: {}", near(&map, colour));
    }
}
