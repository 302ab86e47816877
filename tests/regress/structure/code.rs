//! What the text of a file says of other files.

/// A name that a `use` brings in.
#[derive(Debug, Clone, PartialEq)]
pub struct Use {
    /// Segments as written.
    pub path: Vec<String>,
    /// The name in this file; `*` for everything.
    pub name: String,
    /// Whether others may use it from here.
    pub public: bool,
}

/// The text up to its tests, which stand at the end of a file.
pub fn before_tests(text: &str) -> &str {
    ["#[cfg(test)]\nmod ", "#[cfg(test)]\npub mod "]
        .iter()
        .filter_map(|tests| text.find(tests))
        .min()
        .map_or(text, |end| &text[..end])
}

/// The text with the inside of texts left out, and comments too unless they are to stay.
pub fn stripped(text: &str, comments_stay: bool) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let raw = rest.strip_prefix('r').map(|after| after.chars().take_while(|c| *c == '#').count());
        let length = if rest.starts_with("//") {
            let line = rest.find('\n').unwrap_or(rest.len());
            out.push_str(if comments_stay { &rest[..line] } else { "" });
            line
        } else if let Some(hashes) = raw.filter(|n| rest[1 + n..].starts_with('"') && !ends_in_name(&out)) {
            out.push_str("\"\"");
            let close = format!("\"{}", "#".repeat(hashes));
            let inside = hashes + 2;
            inside + rest[inside..].find(&close).map_or(rest.len() - inside, |at| at + close.len())
        } else if first == '"' {
            out.push_str("\"\"");
            quoted(rest)
        } else if let Some(length) = character(rest) {
            out.push_str("''");
            length
        } else {
            out.push(first);
            first.len_utf8()
        };
        // a text over several lines keeps them
        if !rest.starts_with("//") && length > 1 {
            out.extend(rest[..length].chars().filter(|c| *c == '\n'));
        }
        rest = &rest[length..];
    }
    out
}

fn ends_in_name(text: &str) -> bool {
    text.chars().next_back().is_some_and(is_name)
}

fn is_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Length of the text that a quote opens.
fn quoted(text: &str) -> usize {
    let mut escaped = false;
    for (i, c) in text.char_indices().skip(1) {
        match c {
            '"' if !escaped => return i + 1,
            _ => escaped = c == '\\' && !escaped,
        }
    }
    text.len()
}

/// Length of a character in quotes; a lifetime is none.
fn character(text: &str) -> Option<usize> {
    let inside = text.strip_prefix('\'')?;
    let length = match inside.strip_prefix('\\') {
        Some(escape) => 2 + escape.char_indices().skip(1).find(|(_, c)| *c == '\'')?.0,
        None => 1 + inside.chars().next()?.len_utf8(),
    };
    text[length..].starts_with('\'').then_some(length + 1)
}

/// The imports of a file, and its code without them.
pub fn uses(code: &str) -> (Vec<Use>, String) {
    let (mut found, mut rest) = (Vec::new(), String::new());
    let mut lines = code.lines();
    while let Some(line) = lines.next() {
        let bare = line.trim_start();
        let (public, tree) = match bare.strip_prefix("pub").and_then(|after| after.split_once("use ")) {
            Some((scope, tree)) if scope.trim().is_empty() || scope.trim().ends_with(')') => {
                (true, Some(tree))
            }
            _ => (false, bare.strip_prefix("use ")),
        };
        let Some(tree) = tree else {
            rest.push_str(line);
            rest.push('\n');
            continue;
        };
        let mut whole = tree.to_owned();
        while !whole.contains(';') {
            let Some(next) = lines.next() else { break };
            whole.push_str(next);
        }
        let whole: String = whole.split(';').next().unwrap_or_default().to_owned();
        branches(&whole, &[], public, &mut found);
    }
    (found, rest)
}

/// The names of a tree such as `a::{b, c::{self, d as e}}` under a prefix.
fn branches(tree: &str, prefix: &[String], public: bool, found: &mut Vec<Use>) {
    let tree = tree.trim();
    if let Some((head, inside)) = tree.split_once('{') {
        let prefix = [prefix, &segments(head)].concat();
        let inside = inside.trim_end().trim_end_matches('}');
        split_outside_braces(inside).into_iter().for_each(|part| branches(part, &prefix, public, found));
        return;
    }
    let (path, name) = tree.split_once(" as ").map_or((tree, None), |(path, name)| (path, Some(name.trim())));
    let mut path = [prefix, &segments(path)].concat();
    let is_glob = path.last().is_some_and(|last| last == "*");
    if path.len() > 1 && (is_glob || path.last().is_some_and(|last| last == "self")) {
        path.pop();
    }
    if let Some(last) = path.last().cloned() {
        let name = if is_glob { "*".to_owned() } else { name.map_or(last, str::to_owned) };
        found.push(Use { path, name, public });
    }
}

fn segments(path: &str) -> Vec<String> {
    path.split("::").map(str::trim).filter(|name| !name.is_empty()).map(str::to_owned).collect()
}

fn split_outside_braces(list: &str) -> Vec<&str> {
    let (mut depth, mut start, mut parts) = (0, 0, Vec::new());
    for (i, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&list[start..i]);
                start = i + 1;
            }
            _ => {}
        }
    }
    parts.push(&list[start..]);
    parts.into_iter().filter(|part| !part.trim().is_empty()).collect()
}

/// Every path of two or more segments.
pub fn paths(code: &str) -> Vec<Vec<String>> {
    let is_path = |c: char| is_name(c) || c == ':';
    code.split(|c| !is_path(c)).filter(|word| word.contains("::")).map(segments).collect()
}

/// Whether a name stands in the code by itself.
pub fn mentions(code: &str, name: &str) -> bool {
    code.split(|c| !is_name(c)).any(|word| word == name)
}

#[test]
fn imports_are_read_whole_and_texts_and_comments_are_not() {
    let text = "use a::{b, c::{self, d as e}};\npub(crate) use super::f;\nlet x = \"use g; // \\\" \"; // h::i\nlet y = ('\"', r#\"j::k\"#, l::m);\n";
    let (found, rest) = uses(&stripped(text, false));
    let named: Vec<_> = found.iter().map(|u| (u.path.join("::"), u.name.clone(), u.public)).collect();
    let expected =
        [("a::b", "b", false), ("a::c", "c", false), ("a::c::d", "e", false), ("super::f", "f", true)];
    assert_eq!(named, expected.map(|(path, name, public)| (path.to_owned(), name.to_owned(), public)));
    assert_eq!(paths(&rest), [["l".to_owned(), "m".to_owned()]]);
    assert!(mentions("a_b c", "c") && !mentions("a_b c", "b"));
}
