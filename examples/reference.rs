//! Writes docs/keys.md and the JSON Schemas in schemas/ from the types that the program reads: `cargo run
//! --release --example reference`.

use serde_json::Value;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use wiperlab::fit::job::Job;
use wiperlab::model::section::BladeSection;
use wiperlab::recording::files::RecordingFile;
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::twin::spec::TwinSpec;
use wiperlab::sweep::Study;
use wiperlab::toml_file::{FORMAT, KeyEntry, KeyTable, list_key_tables};

/// A kind of file.
struct Kind {
    /// Name of its schema.
    name: &'static str,
    heading: &'static str,
    /// A link to one that is committed.
    example: &'static str,
    schema: fn() -> Value,
}

const KINDS: [Kind; 6] = [
    Kind {
        name: "scene",
        heading: "Scenes",
        example: "[a scene](../data/scenes/actual-blade.toml)",
        schema: Scene::schema,
    },
    Kind {
        name: "job",
        heading: "Fit jobs",
        example: "[a job](../fits/actual-blade-twin/job.toml)",
        schema: Job::schema,
    },
    Kind {
        name: "study",
        heading: "Parameter studies",
        example: "[a study](../data/sweeps/neck.toml)",
        schema: Study::schema,
    },
    Kind {
        name: "twin",
        heading: "Synthetic recordings",
        example: "[a twin](../data/twins/actual-blade.toml)",
        schema: TwinSpec::schema,
    },
    Kind {
        name: "recording",
        heading: "Recordings (recording.toml, written by `import` and `twin`)",
        example: "[a recording](../data/actual-blade-twin/recording.toml)",
        schema: RecordingFile::schema,
    },
    Kind {
        name: "section",
        heading: "Sections of a blade",
        example: "[a section](../data/sections/example.toml)",
        schema: BladeSection::schema,
    },
];

const HEAD: &str = "# Every key of every file\n\nWhat people write in TOML, from the types that the program reads: \
    `cargo run --release --example reference` writes this page and the JSON Schemas in `schemas/`. An editor that \
    knows JSON Schema (Even Better TOML, taplo) completes and checks a file whose first line names its schema:\n\n\
    ```toml\n#:schema ../../schemas/1/scene.json\n```\n\nNumbers are in SI units; the end of a key says the unit. \
    Masses, inertias, stiffnesses, dampings and the preload of a scene are all for one and the same length of \
    blade: the whole blade, the piece on the rig, or one metre. What can be written in two ways, such as a \
    stiffness or a natural frequency, is given in one of them.\n";

/// Paths and contents of everything that is written.
#[must_use]
pub fn pages(root: &Path) -> Vec<(PathBuf, String)> {
    let mut page = HEAD.to_owned();
    let mut all = Vec::new();
    for Kind { name, heading, example, schema } in KINDS {
        let schema = schema();
        let tables = list_key_tables(&schema);
        let about = tables.first().map_or("", |table| table.about.as_str());
        let _ = write!(page, "\n## {heading}\n\n{about} See {example}.\n");
        tables.iter().for_each(|table| section(&mut page, table));
        let text = serde_json::to_string_pretty(&schema).unwrap_or_default();
        all.push((root.join(format!("schemas/{FORMAT}/{name}.json")), text + "\n"));
    }
    all.push((root.join("docs/keys.md"), page));
    all
}

/// The keys of a table.
fn section(page: &mut String, table: &KeyTable) {
    if !table.name.is_empty() {
        let _ = write!(page, "\n### `{}`\n\n{}\n", table.name, table.about);
    }
    page.push_str("\n| key | value | needed | meaning |\n|---|---|---|---|\n");
    for KeyEntry { name, value, required, meaning } in &table.keys {
        let (value, meaning) = (value.replace('|', "\\|"), meaning.replace('|', "\\|"));
        let needed = if *required { "yes" } else { "" };
        let _ = writeln!(page, "| `{name}` | {value} | {needed} | {meaning} |");
    }
}

#[allow(dead_code)] // (a test takes the pages alone)
fn main() -> std::io::Result<()> {
    for (path, text) in pages(Path::new(env!("CARGO_MANIFEST_DIR"))) {
        std::fs::create_dir_all(path.parent().unwrap_or(Path::new(".")))?;
        std::fs::write(path, text)?;
    }
    Ok(())
}
