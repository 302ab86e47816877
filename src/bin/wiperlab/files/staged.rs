//! Files that appear all together or not at all: written next to their places under temporary names, then
//! renamed.

use super::unwritable;
use crate::failure::Failure;
use crate::interrupt;
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::NamedTempFile;

/// How passing names begin and end.
const PASSING: (&str, &str) = (".wiperlab-", ".tmp");
/// A file on its way is locked microseconds after it is made, and the lock goes with the program. One that is
/// older than this and not locked belongs to a program that was killed.
const ABANDONED: Duration = Duration::from_secs(60);

/// Stages every file next to its place, then renames them all; folders that were made in vain are removed.
pub fn place<'a, R: Read>(folder: &Path, files: impl Iterator<Item = (&'a str, R)>) -> Result<(), Failure> {
    let files: Vec<(PathBuf, R)> = files.map(|(name, contents)| (folder.join(name), contents)).collect();
    files.iter().try_for_each(|(path, _)| check_free(path))?;
    let within: BTreeSet<PathBuf> =
        files.iter().filter_map(|(path, _)| path.parent()).map(Path::to_owned).collect();
    let mut made = Vec::new();
    within
        .iter()
        .try_for_each(|folder| make(folder, &mut made))
        .and_then(|()| stage_and_rename(files))
        .inspect_err(|_| {
            for folder in made.iter().rev() {
                // only an empty one goes; the failure itself is reported
                let _ = fs::remove_dir(folder);
            }
        })?;
    within.iter().for_each(|folder| clear(folder));
    Ok(())
}

/// Refuses a place that something else than a file takes, or that no file can take: asked of all before any
/// gets its name, so that none is left alone.
pub fn check_free(path: &Path) -> Result<(), Failure> {
    let taken = |at: &Path, found: &str, expected: &str| {
        let at = at.display();
        Err(Failure::Input(format!(
            "{at}: is {found}, expected {expected} or nothing; remove it or choose another folder"
        )))
    };
    let found = fs::symlink_metadata(path);
    match path.parent() {
        _ if path.is_dir() => taken(path, "a folder", "a file"),
        Some(within) if within.exists() && !within.is_dir() => taken(within, "a file", "a folder"),
        // (a name that is too long, for instance)
        _ => found
            .err()
            .filter(|error| error.kind() != ErrorKind::NotFound)
            .map_or(Ok(()), |error| Err(unwritable(path, &error))),
    }
}

/// Makes a folder and what is missing of the way to it, and adds those to `made`, the outermost first.
fn make(folder: &Path, made: &mut Vec<PathBuf>) -> Result<(), Failure> {
    let missing: Vec<&Path> =
        folder.ancestors().take_while(|path| !path.as_os_str().is_empty() && !path.exists()).collect();
    made.extend(missing.into_iter().rev().map(Path::to_owned));
    fs::create_dir_all(folder).map_err(|error| unwritable(folder, &error))
}

fn stage_and_rename<R: Read>(files: Vec<(PathBuf, R)>) -> Result<(), Failure> {
    let staged = files
        .into_iter()
        .map(|(path, contents)| {
            Ok((stage(&path, contents).map_err(|error| unwritable(&path, &error))?, path))
        })
        .collect::<Result<Vec<_>, Failure>>()?;
    flush(&staged)?;
    let whole = interrupt::whole();
    for (file, path) in staged {
        file.persist(&path).map_err(|e| unwritable(&path, &e.error))?;
    }
    whole.placed();
    Ok(())
}

/// The file under a temporary name next to its place, locked where the file system can.
fn stage(path: &Path, mut contents: impl Read) -> io::Result<NamedTempFile> {
    let within = path.parent().unwrap_or(Path::new(""));
    let mut builder = tempfile::Builder::new();
    builder.prefix(PASSING.0).suffix(PASSING.1).permissions(readable_by_all());
    let mut file = interrupt::passing(|| builder.tempfile_in(within))?;
    let _ = file.as_file().try_lock();
    io::copy(&mut contents, file.as_file_mut())?;
    Ok(file)
}

/// Removes what programs that were killed left in a folder on its way.
fn clear(folder: &Path) {
    let passing = |name: &str| name.starts_with(PASSING.0) && name.ends_with(PASSING.1);
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if passing(&entry.file_name().to_string_lossy()) && is_abandoned(&entry.path()) {
            let _ = fs::remove_file(entry.path()); // (it does no harm; the next command tries again)
        }
    }
}

fn is_abandoned(path: &Path) -> bool {
    let is_old = |found: &fs::Metadata| {
        found.is_file() && found.modified().is_ok_and(|at| at.elapsed().is_ok_and(|age| age > ABANDONED))
    };
    fs::symlink_metadata(path).is_ok_and(|found| is_old(&found))
        && File::open(path).is_ok_and(|file| file.try_lock().is_ok())
}

/// Flushes files to the disk side by side: one commit of the file system then serves many, where one after
/// the other would wait for one each.
fn flush(staged: &[(NamedTempFile, PathBuf)]) -> Result<(), Failure> {
    const AT_ONCE: usize = 64;
    let flushed = |(file, path): &(NamedTempFile, PathBuf)| {
        file.as_file().sync_all().map_err(|error| unwritable(path, &error))
    };
    staged.chunks(AT_ONCE).try_for_each(|files| {
        std::thread::scope(|scope| {
            let waiting: Vec<_> = files.iter().map(|file| scope.spawn(move || flushed(file))).collect();
            let stopped = |_| Err(Failure::Internal("a file could not be flushed to the disk".to_owned()));
            waiting.into_iter().try_for_each(|handle| handle.join().unwrap_or_else(stopped))
        })
    })
}

/// What a new file gets from an ordinary program (the user's mask still applies); temporary files are private
/// otherwise.
#[cfg(unix)]
fn readable_by_all() -> fs::Permissions {
    std::os::unix::fs::PermissionsExt::from_mode(0o666)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::SystemTime;

    fn placed(folder: &Path, names: &[&str]) -> Result<(), Failure> {
        place(folder, names.iter().map(|name| (*name, name.as_bytes())))
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn what_a_killed_program_left_goes_and_what_others_hold_or_wrote_stays() {
        let folder = tempfile::tempdir().unwrap();
        let old = SystemTime::now() - 2 * ABANDONED;
        let left = |name: &str, modified: SystemTime| {
            let file = File::create(folder.path().join(name)).unwrap();
            file.set_modified(modified).unwrap();
            file
        };
        left(".wiperlab-left.tmp", old);
        left(".wiperlab-young.tmp", SystemTime::now());
        left(".tmpofanother", old);
        left("mine.tmp", old);
        let held = left(".wiperlab-held.tmp", old);
        held.lock().unwrap();
        placed(folder.path(), &["a"]).unwrap();
        assert_eq!(
            names(folder.path()),
            [".tmpofanother", ".wiperlab-held.tmp", ".wiperlab-young.tmp", "a", "mine.tmp"]
        );
    }

    #[test]
    fn a_file_on_its_way_is_held() {
        let folder = tempfile::tempdir().unwrap();
        let file = stage(&folder.path().join("a"), &b"a"[..]).unwrap();
        file.as_file().set_modified(SystemTime::now() - 2 * ABANDONED).unwrap();
        assert!(!is_abandoned(file.path()));
        assert!(
            names(folder.path()).iter().all(|name| name.starts_with(PASSING.0) && name.ends_with(PASSING.1))
        );
    }

    #[test]
    fn a_place_that_is_taken_is_refused_before_anything_is_written() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("z")).unwrap();
        let refused = placed(folder.path(), &["a", "paper/b", "z"]).unwrap_err();
        assert!(
            matches!(&refused, Failure::Input(words) if words.contains("/z: is a folder, expected a file or nothing")),
            "{refused}"
        );
        File::create(folder.path().join("paper")).unwrap();
        let refused = placed(folder.path(), &["a", "paper/b"]).unwrap_err();
        assert!(
            matches!(&refused, Failure::Input(words) if words.contains("/paper: is a file, expected a folder or nothing")),
            "{refused}"
        );
        assert_eq!(names(folder.path()), ["paper", "z"]);
    }

    #[test]
    fn folders_that_were_made_in_vain_go() {
        struct Broken;
        impl Read for Broken {
            fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
                Err(io::Error::other("no space left"))
            }
        }
        let folder = tempfile::tempdir().unwrap();
        let failed = place(&folder.path().join("deep/er"), [("a", Broken), ("paper/b", Broken)].into_iter())
            .unwrap_err();
        assert!(
            matches!(&failed, Failure::Internal(words) if words.contains("deep/er/a: cannot be written: no space left")),
            "{failed}"
        );
        assert_eq!(names(folder.path()), [""; 0]);
    }
}
