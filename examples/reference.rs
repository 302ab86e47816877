//! Writes docs/keys.md and the JSON Schemas in schemas/ from the types that the program reads: `cargo run
//! --release --example reference`.

use serde_json::Value;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use wiperlab::fit::job::Job;
use wiperlab::recording::files::RecordingFile;
use wiperlab::simulate::scene::Scene;
use wiperlab::sweep::Study;
use wiperlab::toml_file::{FORMAT, in_words};
use wiperlab::twin::spec::TwinSpec;

/// A kind of file.
struct Kind {
    /// Name of its schema.
    name: &'static str,
    heading: &'static str,
    /// A link to one that is committed.
    example: &'static str,
    schema: fn() -> Value,
}

const KINDS: [Kind; 5] = [
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
        let _ = write!(page, "\n## {heading}\n\n{} See {example}.\n", sentence(&schema));
        tables(&mut page, &schema, &schema, "");
        let text = serde_json::to_string_pretty(&schema).unwrap_or_default();
        all.push((root.join(format!("schemas/{FORMAT}/{name}.json")), text + "\n"));
    }
    all.push((root.join("docs/keys.md"), page));
    all
}

/// The keys of a table, then those of the tables in it.
fn tables(page: &mut String, root: &Value, table: &Value, name: &str) {
    let table = resolved(root, table);
    let Some(keys) = table["properties"].as_object() else { return };
    if !name.is_empty() {
        let _ = write!(page, "\n### `{name}`\n\n{}\n", sentence(table));
    }
    let required: Vec<&str> =
        table["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    page.push_str("\n| key | value | needed | meaning |\n|---|---|---|---|\n");
    for (key, part) in keys {
        let needed = if required.contains(&key.as_str()) { "yes" } else { "" };
        let meaning = part["description"].as_str().or(resolved(root, part)["description"].as_str());
        let meaning = meaning.unwrap_or_default().replace('\n', " ").replace('|', "\\|");
        let _ =
            writeln!(page, "| `{key}` | {} | {needed} | {meaning} |", value(root, part).replace('|', "\\|"));
    }
    for (key, part) in keys {
        let at =
            if name.is_empty() { key.clone() } else { format!("{}.{key}", name.trim_matches(['[', ']'])) };
        let part = inner(root, part);
        if part["type"] == "array" {
            tables(page, root, inner(root, &part["items"]), &format!("[[{at}]]"));
        } else {
            tables(page, root, part, &format!("[{at}]"));
        }
    }
}

/// What a key takes, with its range and default.
fn value(root: &Value, part: &Value) -> String {
    let mut words = in_words(root, part);
    let number = |key: &str| part[key].as_f64();
    match (number("minimum"), number("maximum"), number("exclusiveMinimum")) {
        (Some(least), Some(most), _) => words = format!("{words} from {least} to {most}"),
        (Some(least), None, _) if !words.contains("or more") => words = format!("{words} of {least} or more"),
        (.., Some(above)) => words = format!("{words} above {above}"),
        _ => (),
    }
    match number("default") {
        Some(default) => format!("{words}; {default} if left out"),
        None => words,
    }
}

/// A schema without its reference, and of several ways the one that is a table or a list.
fn inner<'a>(root: &'a Value, part: &'a Value) -> &'a Value {
    let part = resolved(root, part);
    let ways = part.get("anyOf").and_then(Value::as_array);
    let ways = ways.into_iter().flatten().map(|way| inner(root, way));
    ways.into_iter().find(|way| way["type"] == "object" || way["type"] == "array").unwrap_or(part)
}

fn resolved<'a>(root: &'a Value, part: &'a Value) -> &'a Value {
    let pointer = part["$ref"].as_str().and_then(|place| place.strip_prefix('#'));
    pointer.and_then(|pointer| root.pointer(pointer)).unwrap_or(part)
}

fn sentence(schema: &Value) -> String {
    schema["description"].as_str().unwrap_or_default().replace('\n', " ")
}

#[allow(dead_code)] // (a test takes the pages alone)
fn main() -> std::io::Result<()> {
    for (path, text) in pages(Path::new(env!("CARGO_MANIFEST_DIR"))) {
        std::fs::create_dir_all(path.parent().unwrap_or(Path::new(".")))?;
        std::fs::write(path, text)?;
    }
    Ok(())
}
