//! Reference and schemas are what the types say.

use crate::reference_pages;
use std::path::Path;

#[test]
fn keys_and_schemas_are_what_their_command_writes() {
    for (path, text) in reference_pages::pages(Path::new(env!("CARGO_MANIFEST_DIR"))) {
        let kept = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(kept == text, "{}: run `cargo run --release --example reference`", path.display());
    }
}

/// Every number of the one table of parameters stands in the schema of a scene, with its unit.
#[test]
fn the_schema_of_a_scene_has_every_number_with_its_unit() {
    use wiperlab::model::parameters::PARAMETERS;
    let schema = wiperlab::simulate::scene::Scene::schema();
    let of_tables = ["blade", "shoulder", "friction"];
    let rows = PARAMETERS.iter().filter_map(|row| Some((row, row.name.split_once('.')?)));
    let mut count = 0;
    for (row, (table, key)) in rows.filter(|(_, (table, _))| of_tables.contains(table)) {
        let words = schema["properties"][table]["properties"][key]["description"].as_str().unwrap();
        assert!(row.unit == "1" || words.contains(&format!(", {}.", row.unit)), "{}: {words}", row.name);
        count += 1;
    }
    assert_eq!(count, 39);
}
