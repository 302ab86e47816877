//! Every problem of a file at once: its tables and values against the schema of its format.

use super::hint::{describe_bad_line, describe_duplicate, suggest_value};
use super::{TomlError, line_and_column, suggest_key};
use crate::text::format_plain;
use serde_json::Value as Schema;
use std::ops::Range;
use toml::de::{DeTable, DeValue};

/// Most problems that are listed: beyond it the file is most likely of another kind.
const MOST_PROBLEMS: usize = 20;

/// What is wrong with a file, in the order of its lines; nothing for one that goes with the schema.
pub(super) fn find_problems(file: &str, text: &str, schema: &Schema) -> Vec<TomlError> {
    let (table, errors) = DeTable::parse_recoverable(text);
    let mut check = SchemaCheck { file, text, root: schema, found: Vec::new() };
    if errors.is_empty() {
        check.check_table(&[], table.get_ref(), schema, table.span());
    }
    for error in errors.iter().take(MOST_PROBLEMS) {
        let at = error.span().map_or(0, |span| span.start);
        let (line, _) = line_and_column(text, at);
        let written = text.lines().nth(line - 1).unwrap_or_default();
        let problem = match error.message() {
            "duplicate key" => describe_duplicate(written),
            message => describe_bad_line(written).unwrap_or_else(|| message.trim().replace('\n', "; ")),
        };
        check.add_problem(at, problem);
    }
    check.found.sort_by_key(|(at, _)| *at);
    check.found.dedup_by(|a, b| line_and_column(text, a.0).0 == line_and_column(text, b.0).0 && a.1 == b.1);
    check.found.into_iter().map(|(_, problem)| problem).take(MOST_PROBLEMS).collect()
}

struct SchemaCheck<'a> {
    file: &'a str,
    text: &'a str,
    root: &'a Schema,
    /// Byte of the file, and what is wrong there.
    found: Vec<(usize, TomlError)>,
}

impl<'a> SchemaCheck<'a> {
    fn add_problem(&mut self, at: usize, problem: String) {
        let (line, column) = line_and_column(self.text, at);
        self.found.push((at, TomlError::Syntax { file: self.file.to_owned(), line, column, problem }));
    }

    fn check_table(&mut self, path: &[&str], table: &DeTable<'_>, schema: &'a Schema, span: Range<usize>) {
        let schema = resolve_reference(self.root, schema);
        let known = schema["properties"].as_object();
        let property = |name: &str| known.and_then(|known| known.get(name));
        let others = schema.get("additionalProperties");
        let mut meant: Vec<&str> = Vec::new();
        for (key, value) in table {
            if self.found.len() >= MOST_PROBLEMS {
                return;
            }
            let name: &str = key.get_ref();
            let path: Vec<&str> = path.iter().copied().chain([name]).collect();
            match (property(name), others) {
                (Some(schema), _) => self.check_value(&path, value.get_ref(), schema, value.span()),
                (None, Some(Schema::Bool(false))) => {
                    let names: Vec<&str> =
                        known.into_iter().flatten().map(|(name, _)| name.as_str()).collect();
                    let (line, column) = line_and_column(self.text, key.span().start);
                    let unknown = TomlError::UnknownKey {
                        file: self.file.to_owned(),
                        line,
                        column,
                        key: path.join("."),
                        advice: suggest_key(name, &names),
                    };
                    meant.extend(names.iter().find(|known| suggests_key(&unknown, known)));
                    self.found.push((key.span().start, unknown));
                }
                (None, Some(schema)) => self.check_value(&path, value.get_ref(), schema, value.span()),
                (None, None) => (),
            }
        }
        let required = schema["required"].as_array().into_iter().flatten().filter_map(Schema::as_str);
        let absent = required.filter(|name| !table.keys().any(|key| key.get_ref() == name));
        for name in absent.filter(|name| !meant.contains(name)) {
            let Some(of) = property(name) else { continue };
            let meaning =
                of["description"].as_str().and_then(|words| words.lines().next()).unwrap_or_default();
            let path: Vec<&str> = path.iter().copied().chain([name]).collect();
            let meaning = meaning.trim_end_matches('.');
            let add = if meaning.is_empty() { String::new() } else { format!("; add it: {meaning}") };
            let problem = format!(
                "key `{}`: found nothing, expected {}{add}",
                path.join("."),
                describe_expected(self.root, of)
            );
            self.add_problem(span.start, problem);
        }
    }

    fn check_value(&mut self, path: &[&str], value: &DeValue<'_>, schema: &'a Schema, span: Range<usize>) {
        let ways = list_alternatives(self.root, schema);
        let Some(way) = ways.iter().copied().find(|way| matches_schema(way, value)) else {
            let key = path.join(".");
            let name = path.last().copied().unwrap_or_default();
            let kinds: Vec<&str> = ways.iter().flat_map(|way| list_types(way)).collect();
            let hint =
                suggest_value(name, value, &kinds).map_or_else(String::new, |hint| format!("; {hint}"));
            let problem = format!(
                "key `{key}`: found {}, expected {}{hint}",
                describe_value(value),
                describe_expected(self.root, schema)
            );
            return self.add_problem(span.start, problem);
        };
        match value {
            DeValue::Table(table) => self.check_table(path, table, way, span),
            DeValue::Array(list) => {
                let Some(items) = way.get("items") else { return };
                for (i, item) in list.iter().enumerate() {
                    if self.found.len() >= MOST_PROBLEMS {
                        return;
                    }
                    let place = format!("{}[{}]", path.join("."), i + 1);
                    self.check_value(&[&place], item.get_ref(), items, item.span());
                }
            }
            DeValue::Integer(_) | DeValue::Float(_) => self.check_range(path, value, way, span.start),
            _ => (),
        }
    }

    /// A number against the range of its key.
    fn check_range(&mut self, path: &[&str], value: &DeValue<'_>, schema: &Schema, at: usize) {
        let written = describe_value(value);
        let Ok(number) = written.replace('_', "").parse::<f64>() else { return };
        let [least, most, above] =
            ["minimum", "maximum", "exclusiveMinimum"].map(|end| schema.get(end).and_then(Schema::as_f64));
        let expected = match (least, most, above) {
            (Some(least), Some(most), _) if !(least..=most).contains(&number) => {
                format!("a number from {} to {}", format_plain(least), format_plain(most))
            }
            (Some(least), None, _)
                if list_types(schema) == ["number"] && !(number >= least && number.is_finite()) =>
            {
                format!("a number of {least} or more")
            }
            (.., Some(above)) if !(number > above && number.is_finite()) => format!("a number above {above}"),
            _ => return,
        };
        let meaning = schema["description"].as_str().and_then(|words| words.split(". ").next());
        let meaning = meaning.map_or_else(String::new, |meaning| format!(" ({meaning})"));
        let key = path.join(".");
        self.add_problem(
            at,
            format!("key `{key}`: found {written}, expected {expected}{meaning}; correct the value"),
        );
    }
}

/// A schema without its reference.
fn resolve_reference<'a>(root: &'a Schema, schema: &'a Schema) -> &'a Schema {
    let pointer = schema["$ref"].as_str().and_then(|place| place.strip_prefix('#'));
    pointer.and_then(|pointer| root.pointer(pointer)).unwrap_or(schema)
}

/// The ways in which a value may be written.
fn list_alternatives<'a>(root: &'a Schema, schema: &'a Schema) -> Vec<&'a Schema> {
    let schema = resolve_reference(root, schema);
    match schema.get("anyOf").or(schema.get("oneOf")).and_then(Schema::as_array) {
        Some(ways) => ways.iter().flat_map(|way| list_alternatives(root, way)).collect(),
        None => vec![schema],
    }
}

/// Whether an unknown key is taken for a known one.
fn suggests_key(problem: &TomlError, known: &str) -> bool {
    matches!(problem, TomlError::UnknownKey { advice, .. } if advice.contains(&format!("`{known}`?")))
}

/// Key of a schema that says in words what it takes, where types alone do not.
const IN_WORDS: &str = "x-expected";

/// What a schema takes, in words.
pub(super) fn describe_expected(root: &Schema, schema: &Schema) -> String {
    let schema = resolve_reference(root, schema);
    if let Some(words) = schema.get(IN_WORDS).and_then(Schema::as_str) {
        return words.to_owned();
    }
    if let Some(all) = schema.get("anyOf").and_then(Schema::as_array) {
        let all: Vec<String> =
            all.iter().map(|way| describe_expected(root, way)).filter(|w| !w.is_empty()).collect();
        return all.join(" or ");
    }
    let ways = list_alternatives(root, schema);
    let choices: Vec<&str> = ways.iter().filter_map(|way| list_words(way)).flatten().collect();
    let quoted: Vec<String> = choices.iter().map(|word| format!("\"{word}\"")).collect();
    match quoted.as_slice() {
        [] => ways.iter().map(|way| describe_type(way)).collect::<Vec<_>>().join(" or "),
        [one] => one.clone(),
        many => format!("one of {}", many.join(", ")),
    }
}

/// Types of a schema without `null`: TOML has none.
fn list_types(schema: &Schema) -> Vec<&str> {
    let all: Vec<&str> = match &schema["type"] {
        Schema::String(one) => vec![one.as_str()],
        Schema::Array(many) => many.iter().filter_map(Schema::as_str).collect(),
        _ => Vec::new(),
    };
    all.into_iter().filter(|kind| *kind != "null").collect()
}

/// The words that a schema takes, where it takes some words alone.
fn list_words(schema: &Schema) -> Option<Vec<&str>> {
    if let Some(one) = schema.get("const") {
        return one.as_str().map(|word| vec![word]);
    }
    Some(schema.get("enum")?.as_array()?.iter().filter_map(Schema::as_str).collect())
}

/// Whether a value has the type of a schema, or is one of its words.
fn matches_schema(schema: &Schema, value: &DeValue<'_>) -> bool {
    if let Some(words) = list_words(schema) {
        return matches!(value, DeValue::String(text) if words.contains(&text.as_ref()));
    }
    let types = list_types(schema);
    if types.is_empty() {
        return schema.get("properties").is_none() && schema["type"].is_null();
    }
    types.iter().any(|kind| match value {
        DeValue::String(_) => *kind == "string",
        DeValue::Integer(number) => match *kind {
            "number" => true,
            "integer" => {
                // a negative count is refused here: the type has no place for it
                let least = schema.get("minimum").and_then(Schema::as_f64).unwrap_or(f64::NEG_INFINITY);
                number.as_str().parse::<f64>().map_or(true, |number| number >= least)
            }
            _ => false,
        },
        DeValue::Float(_) => *kind == "number",
        DeValue::Boolean(_) => *kind == "boolean",
        DeValue::Array(_) => *kind == "array",
        DeValue::Table(_) => *kind == "object",
        DeValue::Datetime(_) => false,
    })
}

/// What one way of a schema takes.
fn describe_type(schema: &Schema) -> String {
    let kinds = list_types(schema);
    let word = |kind: &&str| match *kind {
        "number" => "a number",
        "integer" if schema["minimum"].as_f64() == Some(0.0) => "a whole number of 0 or more",
        "integer" => "a whole number",
        "string" => "a text in quotes",
        "boolean" => "true or false",
        "array" => "a list in square brackets",
        "object" => "a table",
        _ => "another value",
    };
    kinds.iter().map(word).collect::<Vec<_>>().join(" or ")
}

/// A value in words.
fn describe_value(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => format!("the text \"{text}\""),
        DeValue::Integer(number) => number.as_str().to_owned(),
        DeValue::Float(number) => number.as_str().to_owned(),
        DeValue::Boolean(value) => value.to_string(),
        DeValue::Datetime(date) => format!("the date {date}"),
        DeValue::Array(list) => format!("a list of {}", list.len()),
        DeValue::Table(_) => "a table".to_owned(),
    }
}
