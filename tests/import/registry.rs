//! Every format that is read has fixtures, a row in the documentation and an exporter of the property tests.

use crate::exports;

use std::fs;
use std::path::Path;
use wiperlab::import::format_names;

#[test]
fn no_format_is_read_without_its_evidence() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let table = fs::read_to_string(root.join("docs/formats.md")).unwrap();
    let written: Vec<&str> = exports::exporters().iter().map(|exporter| exporter.format).collect();
    for name in format_names() {
        let fixtures = root.join("tests/fixtures").join(name.replace('-', "_"));
        assert!(
            fs::read_dir(&fixtures).is_ok_and(|files| files.count() > 0),
            "no fixture in {}",
            fixtures.display()
        );
        assert!(table.contains(&format!("`{name}`")), "docs/formats.md has no row for `{name}`");
        assert!(
            written.contains(&name) || name == "wiperlab",
            "no exporter writes `{name}` (tests/common/exports.rs)"
        );
    }
}
