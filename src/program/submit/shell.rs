//! Words and programs of the POSIX shell.

use std::path::Path;

/// A word that the shell takes as it is.
pub fn quote_word(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+:,=@".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// A command line from its words.
pub fn join_words(words: &[String]) -> String {
    words.iter().map(|word| quote_word(word)).collect::<Vec<_>>().join(" ")
}

/// Whether a program is found on PATH.
pub fn is_program_on_path(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|folder| is_program(&folder.join(program)))
}

#[cfg(unix)]
fn is_program(path: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    path.metadata().is_ok_and(|found| found.is_file() && found.permissions().mode() & 0o111 != 0)
}

#[cfg(not(unix))]
fn is_program(path: &Path) -> bool {
    path.is_file() || path.with_extension("exe").is_file()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_reach_the_program_as_they_are() {
        for (word, written) in [
            ("/home/a/study.toml", "/home/a/study.toml"),
            ("a b", "'a b'"),
            ("it's", r"'it'\''s'"),
            ("$HOME `x` \"y\" \\", "'$HOME `x` \"y\" \\'"),
            ("Wischblätter", "'Wischblätter'"),
            ("", "''"),
            ("~a", "'~a'"),
        ] {
            assert_eq!(quote_word(word), written);
        }
        assert_eq!(join_words(&["sweep".into(), "a b".into(), "--out".into()]), "sweep 'a b' --out");
    }

    #[cfg(unix)]
    #[test]
    fn the_shell_reads_them_back() {
        let words =
            ["a b", "it's", "$HOME `x` \"y\" \\", "Wischblätter", "-x", "*", "a;b&c|d>e#f!g%h", "tab\t"];
        for word in words {
            let script = format!("printf %s {}", quote_word(word));
            let ran = std::process::Command::new("/bin/sh").args(["-c", &script]).output().unwrap();
            assert_eq!(String::from_utf8(ran.stdout).unwrap(), word);
        }
    }
}
