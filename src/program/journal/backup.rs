//! Old journals under numbered names: none is ever written over.

use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// Gives a file the next free name of its kind: `journal.jsonl` becomes `journal.previous-1.jsonl`.
pub fn set_aside(path: &Path) -> io::Result<PathBuf> {
    let (to, reserved) = reserve(path)?;
    drop(reserved);
    fs::rename(path, &to)?;
    Ok(to)
}

/// Writes these bytes, which stood in a file, under its next free name, and waits for the disk.
pub fn keep(path: &Path, bytes: &[u8]) -> io::Result<PathBuf> {
    let (to, mut file) = reserve(path)?;
    io::Write::write_all(&mut file, bytes)?;
    file.sync_all()?;
    Ok(to)
}

/// The first name that is free, as a new file: whoever comes at the same time finds it taken.
fn reserve(path: &Path) -> io::Result<(PathBuf, File)> {
    let mut number = 1;
    loop {
        let to = numbered(path, number);
        match File::create_new(&to) {
            Ok(file) => return Ok((to, file)),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => number += 1,
            Err(error) => return Err(error),
        }
    }
}

fn numbered(path: &Path, number: usize) -> PathBuf {
    let extension = path.extension().map_or_else(String::new, |e| format!(".{}", e.to_string_lossy()));
    path.with_extension(format!("previous-{number}{extension}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_backup_has_a_number_of_its_own() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal.jsonl");
        for content in ["a", "b", "c"] {
            fs::write(&path, content).unwrap();
            set_aside(&path).unwrap();
        }
        fs::remove_file(numbered(&path, 2)).unwrap();
        assert_eq!(keep(&path, b"d").unwrap(), folder.path().join("journal.previous-2.jsonl"));
        let read = |number| fs::read_to_string(numbered(&path, number)).unwrap();
        assert_eq!([read(1), read(2), read(3)], ["a", "d", "c"]);
        assert!(!path.exists());
    }
}
