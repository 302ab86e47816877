//! The names that the text of a file defines.

const TYPE_WORDS: [&str; 4] = ["struct ", "enum ", "trait ", "union "];
const PARTICIPLE_ENDS: [&str; 8] = ["ed", "ing", "en", "own", "ept", "aid", "aught", "eld"];

/// Types of a file's code, those inside functions aside.
pub fn defined_types(code: &str) -> Vec<String> {
    const DEEPEST_INDENT: usize = 4; // an inline module
    let lines = code.lines().filter(|line| line.len() - line.trim_start().len() <= DEEPEST_INDENT);
    let items = lines.map(|line| without_visibility(line.trim_start()));
    let names =
        items.filter_map(|item| TYPE_WORDS.iter().find_map(|word| item.strip_prefix(word)).map(leading_name));
    names.filter(|name| !name.is_empty()).collect()
}

/// Functions and methods of a file's code.
pub fn defined_functions(code: &str) -> Vec<String> {
    let bodies = code.split("fn ").zip(code.split("fn ").skip(1));
    let whole = |before: &str| !before.ends_with(|c: char| c.is_alphanumeric() || c == '_');
    let names = bodies.filter(|(before, _)| whole(before)).map(|(_, after)| leading_name(after));
    names.filter(|name| !name.is_empty()).collect()
}

/// Whether one lower-case word ends as a participle does.
pub fn looks_like_participle(name: &str) -> bool {
    name.chars().all(|c| c.is_ascii_lowercase())
        && PARTICIPLE_ENDS.iter().any(|end| name.len() > end.len() && name.ends_with(end))
}

fn without_visibility(item: &str) -> &str {
    let Some(rest) = item.strip_prefix("pub") else { return item };
    let rest = match rest.strip_prefix('(') {
        Some(scope) => scope.split_once(')').map_or("", |(_, rest)| rest),
        None => rest,
    };
    rest.strip_prefix(' ').unwrap_or(item)
}

fn leading_name(text: &str) -> String {
    text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
}

#[test]
fn names_are_read_from_the_text() {
    let code = "pub(crate) struct One<T>(T);\nenum Two {}\nmod m {\n    pub trait Three {}\n}\nfn f() {\n        struct Local;\n}\nimpl One<f64> {\n    pub const fn worn(&self) -> impl Fn(f64) {}\n}\n";
    assert_eq!(defined_types(code), ["One", "Two", "Three"]);
    assert_eq!(defined_functions(code), ["f", "worn"]);
    let words = ["worn", "known", "kept", "settled", "fit_model", "made_good", "ed"];
    assert_eq!(words.map(looks_like_participle), [false, true, true, true, false, false, false]);
}
