//! List of all keys of a kind of file, from its schema.

use super::schema_check::{self, resolve_reference};
use serde_json::Value;

/// The keys of a table of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeyTable {
    /// Name of the table as written in a file, such as `[blade]` or `[[trace]]`; empty for the top level.
    pub name: String,
    /// Description of the table.
    pub about: String,
    /// Keys of the table, in the order of the schema.
    pub keys: Vec<KeyEntry>,
}

/// A key of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeyEntry {
    /// Name of the key.
    pub name: String,
    /// Accepted values of the key, with range and default.
    pub value: String,
    /// Whether the key is required.
    pub required: bool,
    /// Meaning of the key, with its unit.
    pub meaning: String,
}

/// The tables of a kind of file: first the top level, then its tables, each followed by its own subtables.
#[must_use]
pub fn list_key_tables(schema: &Value) -> Vec<KeyTable> {
    let mut all = Vec::new();
    collect_tables(&mut all, schema, schema, "");
    all
}

fn collect_tables(all: &mut Vec<KeyTable>, root: &Value, table: &Value, name: &str) {
    let table = resolve_reference(root, table);
    let Some(keys) = table["properties"].as_object() else { return };
    let required: Vec<&str> =
        table["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    let key = |(key, part): (&String, &Value)| {
        let meaning = part["description"].as_str().or(resolve_reference(root, part)["description"].as_str());
        KeyEntry {
            name: key.clone(),
            value: describe_takes(root, part),
            required: required.contains(&key.as_str()),
            meaning: meaning.unwrap_or_default().replace('\n', " "),
        }
    };
    let about = table["description"].as_str().unwrap_or_default().replace('\n', " ");
    all.push(KeyTable { name: name.to_owned(), about, keys: keys.iter().map(key).collect() });
    for (key, part) in keys {
        let at = match name.trim_matches(['[', ']']) {
            "" => key.clone(),
            outer => format!("{outer}.{key}"),
        };
        let part = resolve_container(root, part);
        if part["type"] == "array" {
            collect_tables(all, root, resolve_container(root, &part["items"]), &format!("[[{at}]]"));
        } else {
            collect_tables(all, root, part, &format!("[{at}]"));
        }
    }
}

/// Accepted values of a key, with its range and default.
fn describe_takes(root: &Value, part: &Value) -> String {
    let mut words = schema_check::describe_expected(root, part);
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

/// The schema to which a schema refers, or the schema itself; of several alternatives, the one that is a
/// table or a list.
fn resolve_container<'a>(root: &'a Value, part: &'a Value) -> &'a Value {
    let part = resolve_reference(root, part);
    let ways = part.get("anyOf").and_then(Value::as_array).into_iter().flatten();
    let mut ways = ways.map(|way| resolve_container(root, way));
    ways.find(|way| way["type"] == "object" || way["type"] == "array").unwrap_or(part)
}
