//! The gallery lists the figures that are there, in the words that they have.

use crate::gallery_pages;

use std::path::Path;

#[test]
fn the_gallery_is_what_its_command_writes() {
    for (path, text) in gallery_pages::pages(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap() {
        assert_eq!(
            std::fs::read_to_string(&path).unwrap(),
            text,
            "{}: run `cargo run --release --example gallery`",
            path.display()
        );
    }
}

#[test]
fn every_figure_it_shows_is_there_and_small() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let [(_, gallery), (_, readme)] = gallery_pages::pages(root).unwrap();
    let named = gallery.split("](../").skip(1).chain(readme.split("<img src=\"").skip(1));
    let files: Vec<&str> = named.map(|rest| rest.split([')', '"']).next().unwrap()).collect();
    assert!(files.len() > 30, "{}", files.len());
    for file in files {
        let bytes =
            std::fs::metadata(root.join(file)).unwrap_or_else(|problem| panic!("{file}: {problem}")).len();
        assert!((500..300_000).contains(&bytes), "{file}: {bytes}");
    }
}
