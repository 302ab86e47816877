//! The files of `src` and which of them use which.

use super::code::{self, Use};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Name of an import of everything.
const GLOB: &str = "*";
/// Module of the program.
const PROGRAM: &str = "cli";

/// A file of `src`.
pub struct SourceFile {
    /// From `src`, with `/`.
    pub path: String,
    /// Its module: the crate (`lib` or `main`), then names.
    pub module: Vec<String>,
    /// Lines before its tests.
    pub lines_before_tests: usize,
    /// Its text with texts emptied.
    pub without_texts: String,
    /// The same before its tests and without comments.
    pub code: String,
    /// What it imports or re-exports.
    pub uses: Vec<Use>,
}

impl SourceFile {
    /// Of a path from `src` and the text there.
    pub fn new(path: &str, text: &str) -> Self {
        let before_tests = code::before_tests(text);
        let code = code::stripped(before_tests, false);
        let (uses, code) = code::uses(&code);
        Self {
            path: path.to_owned(),
            module: module_of(path),
            lines_before_tests: before_tests.lines().count(),
            without_texts: code::stripped(text, true),
            code,
            uses,
        }
    }

    /// Its top-level module; `None` for the root.
    pub fn layer(&self) -> Option<&str> {
        (self.module[0] == "lib").then(|| self.module.get(1).map(String::as_str)).flatten()
    }

    /// Its module just below the crate; of the program, which is as large as the rest, the one below that.
    pub fn top_module(&self) -> (&str, &str) {
        let below = |n: usize| self.module.get(n).map_or("", String::as_str);
        if below(1) == PROGRAM { (below(1), below(2)) } else { (&self.module[0], below(1)) }
    }
}

fn module_of(path: &str) -> Vec<String> {
    let root = if path == "main.rs" { "main" } else { "lib" };
    let inside = path.trim_end_matches(".rs").trim_end_matches("/mod");
    let names = inside.split('/').filter(|name| !["lib", "main"].contains(name));
    std::iter::once(root).chain(names).map(str::to_owned).collect()
}

/// Every file of `src` but those of tests.
pub fn read_source_files() -> Vec<SourceFile> {
    read_files_below(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"))
}

/// The same of every package in `crates`; a path is from the `src` of its package.
pub fn read_leaf_packages() -> Vec<Vec<SourceFile>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates");
    let mut packages: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    packages.sort();
    packages.iter().map(|package| read_files_below(&package.join("src"))).collect()
}

/// The same of every package of the workspace.
pub fn read_workspace_files() -> Vec<SourceFile> {
    let python = Path::new(env!("CARGO_MANIFEST_DIR")).join("python/src");
    let own = [read_source_files(), read_files_below(&python)];
    read_leaf_packages().into_iter().chain(own).flatten().collect()
}

fn read_files_below(root: &Path) -> Vec<SourceFile> {
    let mut files = Vec::new();
    let mut folders = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.strip_prefix(root).unwrap().to_str().unwrap().replace('\\', "/");
            if path.is_dir() {
                folders.push(path);
            } else if name.ends_with(".rs")
                && !name.split('/').any(|part| part.trim_end_matches(".rs") == "tests")
            {
                files.push(SourceFile::new(&name, &std::fs::read_to_string(&path).unwrap()));
            }
        }
    }
    files.sort_by(|a, b| a.path.cmp(&b.path));
    files
}

/// Which file uses which, by place in the list. A name counts for the file that defines it, whoever
/// re-exports it; a re-export counts only where the file that makes it uses the name too.
pub fn find_edges(files: &[SourceFile]) -> Vec<(usize, usize)> {
    let tree = Tree { files, modules: files.iter().enumerate().map(|(i, f)| (&f.module[..], i)).collect() };
    let mut edges = BTreeSet::new();
    for (from, file) in files.iter().enumerate() {
        let imported = file.uses.iter().filter(|u| !u.public || code::mentions(&file.code, &u.name));
        let mentioned = code::paths(&file.code);
        let globs = tree.glob_imports(from);
        for path in imported.map(|u| &u.path).chain(&mentioned).chain(&globs) {
            edges.extend(tree.file_of(from, path, 0).filter(|to| *to != from).map(|to| (from, to)));
        }
    }
    edges.into_iter().collect()
}

struct Tree<'a> {
    files: &'a [SourceFile],
    modules: BTreeMap<&'a [String], usize>,
}

impl Tree<'_> {
    /// Paths of the re-exported names that a file mentions and has from `use ...::*`.
    fn glob_imports(&self, from: usize) -> Vec<Vec<String>> {
        let file = &self.files[from];
        let mut paths = Vec::new();
        for glob in file.uses.iter().filter(|u| u.name == GLOB) {
            let Some(module) = self.file_of(from, &glob.path, 0).filter(|module| *module != from) else {
                continue;
            };
            let exported = self.files[module].uses.iter().filter(|u| u.public && u.name != GLOB);
            let named = exported.filter(|u| code::mentions(&file.code, &u.name));
            paths.extend(named.map(|u| glob.path.iter().chain([&u.name]).cloned().collect()));
        }
        paths
    }

    /// The file that defines what a path in a file names.
    fn file_of(&self, from: usize, path: &[String], hops: usize) -> Option<usize> {
        const MOST_HOPS: usize = 8;
        let mut module = self.files[from].module.clone();
        let mut rest = path;
        loop {
            match rest.first().map(String::as_str) {
                Some("crate") => module.truncate(1),
                Some("self") => {}
                Some("super") => {
                    module.pop();
                }
                _ => break,
            }
            rest = &rest[1..];
        }
        let start = (rest.len(), module.clone());
        while let Some(name) = rest.first() {
            module.push(name.clone());
            if !self.modules.contains_key(&module[..]) {
                module.pop();
                break;
            }
            rest = &rest[1..];
        }
        if rest.len() == path.len() && (rest.len(), &module) == (start.0, &start.1) {
            return None; // neither a path from a root nor one into a child
        }
        let file = *self.modules.get(&module[..])?;
        let exported = rest.first().and_then(|name| self.files[file].uses.iter().find(|u| u.name == *name));
        match exported {
            Some(found) if hops < MOST_HOPS => self.file_of(file, &found.path, hops + 1),
            _ => Some(file),
        }
    }
}

#[test]
fn who_uses_whom_is_read_from_the_text() {
    let made = [
        ("lib.rs", "pub mod a;\npub mod b;\n"),
        ("a.rs", "mod inner;\npub use inner::Thing;\nuse crate::b::{Other, deep::{self, Deepest}};\n"),
        (
            "a/inner.rs",
            "// use super::Nothing;\npub struct Thing;\nconst TEXT: &str = \"crate::b\";\n#[cfg(test)]\nmod tests {\n    use crate::b::Other;\n}\n",
        ),
        ("b.rs", "pub mod deep;\npub struct Other;\nfn f() { deep::go(); let x = 'a'; }\n"),
        ("b/deep.rs", "pub struct Deepest(super::super::a::Thing);\n"),
        ("b/all.rs", "pub use crate::a::Thing;\npub use super::Other;\n"),
        ("c.rs", "use crate::b::all::*;\nstruct New(Thing);\n"),
        ("main.rs", "use wiperlab::a::Thing;\n"),
    ];
    let files: Vec<SourceFile> = made.iter().map(|(path, text)| SourceFile::new(path, text)).collect();
    let found: Vec<_> = find_edges(&files)
        .into_iter()
        .map(|(from, to)| (&files[from].path[..], &files[to].path[..]))
        .collect();
    assert_eq!(
        found,
        [
            ("a.rs", "b.rs"),
            ("a.rs", "b/deep.rs"),
            ("b.rs", "b/deep.rs"),
            ("b/deep.rs", "a/inner.rs"),
            ("c.rs", "a/inner.rs"),
            ("c.rs", "b/all.rs"),
        ]
    );
}
