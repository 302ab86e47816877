//! Finds all problems of a file: checks its tables and values against the schema of its format.

use super::hint::{describe_bad_line, describe_duplicate, suggest_value};
use super::{TomlError, line_and_column, suggest_key};
use crate::text::format_plain;
use serde_json::Value as Schema;
use std::ops::Range;
use toml::de::{DeTable, DeValue};

/// Maximum number of problems that are listed; a file with more is most likely of another kind.
const MOST_PROBLEMS: usize = 20;

/// The problems of a file, in the order of its lines; empty for a file that matches the schema.
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
    /// Problems found so far, each with its byte offset.
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
                    let names: Vec<&str> = known.into_iter().flatten().map(|(name, _)| &name[..]).collect();
                    let (line, column) = line_and_column(self.text, key.span().start);
                    let (file, key_path) = (self.file.to_owned(), path.join("."));
                    let advice = suggest_key(name, &names);
                    let unknown = TomlError::UnknownKey { file, line, column, key: key_path, advice };
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
            let meaning = of["description"].as_str().and_then(|words| words.lines().next());
            let meaning = meaning.unwrap_or_default().trim_end_matches('.');
            let path = path.iter().copied().chain([name]).collect::<Vec<_>>().join(".");
            let add = if meaning.is_empty() { String::new() } else { format!("; add it: {meaning}") };
            let expected = describe_expected(self.root, of);
            self.add_problem(span.start, format!("key `{path}`: found nothing, expected {expected}{add}"));
        }
    }

    fn check_value(&mut self, path: &[&str], value: &DeValue<'_>, schema: &'a Schema, span: Range<usize>) {
        let ways = list_alternatives(self.root, schema);
        let Some(way) = ways.iter().copied().find(|way| matches_schema(way, value)) else {
            let key = path.join(".");
            let name = path.last().copied().unwrap_or_default();
            let kinds: Vec<&str> = ways.iter().flat_map(|way| list_types(way)).collect();
            let words: Vec<&str> = ways.iter().filter_map(|way| list_words(way)).flatten().collect();
            let nearest = |word: &str| Some(suggest_key(word, &words)).filter(|hint| hint.ends_with('?'));
            let hint = match value {
                DeValue::String(word) if !words.is_empty() => nearest(word),
                _ => suggest_value(name, value, &kinds),
            };
            let hint = hint.map(|hint| format!("; {hint}")).unwrap_or_default();
            let (found, expected) = (describe_value(value), describe_expected(self.root, schema));
            let problem = format!("key `{key}`: found {found}, expected {expected}{hint}");
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

    /// Checks a number against the range of its key.
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
        let meaning = meaning.map(|meaning| format!(" ({meaning})")).unwrap_or_default();
        let key = path.join(".");
        let problem =
            format!("key `{key}`: found {written}, expected {expected}{meaning}; correct the value");
        self.add_problem(at, problem);
    }
}

/// The schema to which a schema refers; the schema itself if it is not a reference.
pub(super) fn resolve_reference<'a>(root: &'a Schema, schema: &'a Schema) -> &'a Schema {
    let pointer = schema["$ref"].as_str().and_then(|place| place.strip_prefix('#'));
    pointer.and_then(|pointer| root.pointer(pointer)).unwrap_or(schema)
}

/// The alternatives of a schema.
fn list_alternatives<'a>(root: &'a Schema, schema: &'a Schema) -> Vec<&'a Schema> {
    let schema = resolve_reference(root, schema);
    match schema.get("anyOf").or(schema.get("oneOf")).and_then(Schema::as_array) {
        Some(ways) => ways.iter().flat_map(|way| list_alternatives(root, way)).collect(),
        None => vec![schema],
    }
}

/// Whether the advice on an unknown key suggests the given known key.
fn suggests_key(problem: &TomlError, known: &str) -> bool {
    matches!(problem, TomlError::UnknownKey { advice, .. } if advice.contains(&format!("`{known}`?")))
}

/// Key of a schema that contains a description of the accepted values, for cases in which their types say too
/// little.
const IN_WORDS: &str = "x-expected";

/// Accepted values of a schema, in words.
pub(super) fn describe_expected(root: &Schema, schema: &Schema) -> String {
    let schema = resolve_reference(root, schema);
    if let Some(words) = schema.get(IN_WORDS).and_then(Schema::as_str) {
        return words.to_owned();
    }
    if let Some(all) = schema.get("anyOf").and_then(Schema::as_array) {
        let all = all.iter().map(|way| describe_expected(root, way)).filter(|w| !w.is_empty());
        return all.collect::<Vec<_>>().join(" or ");
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

/// Types of a schema, without `null`, which TOML does not have.
fn list_types(schema: &Schema) -> Vec<&str> {
    let all: Vec<&str> = match &schema["type"] {
        Schema::String(one) => vec![one.as_str()],
        Schema::Array(many) => many.iter().filter_map(Schema::as_str).collect(),
        _ => Vec::new(),
    };
    all.into_iter().filter(|kind| *kind != "null").collect()
}

/// The words that a schema accepts, if it accepts only certain words.
fn list_words(schema: &Schema) -> Option<Vec<&str>> {
    if let Some(one) = schema.get("const") {
        return one.as_str().map(|word| vec![word]);
    }
    Some(schema.get("enum")?.as_array()?.iter().filter_map(Schema::as_str).collect())
}

/// Whether a value has the type of a schema, or is one of the words that it accepts.
fn matches_schema(schema: &Schema, value: &DeValue<'_>) -> bool {
    if let Some(words) = list_words(schema) {
        return matches!(value, DeValue::String(text) if words.contains(&text.as_ref()));
    }
    let types = list_types(schema);
    if types.is_empty() {
        return schema.get("properties").is_none() && schema["type"].is_null();
    }
    let is_of = |kind: &&str| match (value, *kind) {
        (DeValue::String(_), "string")
        | (DeValue::Integer(_) | DeValue::Float(_), "number")
        | (DeValue::Boolean(_), "boolean")
        | (DeValue::Array(_), "array")
        | (DeValue::Table(_), "object") => true,
        // a negative count is refused here, since the Rust type of the field has no negative numbers
        (DeValue::Integer(number), "integer") => {
            let least = schema.get("minimum").and_then(Schema::as_f64).unwrap_or(f64::NEG_INFINITY);
            number.as_str().parse::<f64>().map_or(true, |number| number >= least)
        }
        _ => false,
    };
    types.iter().any(is_of)
}

/// Accepted values of one alternative, in words.
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
