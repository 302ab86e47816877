//! Files that appear all together or not at all: they are written under temporary names and then renamed.
//!
//! Order of the steps: all files are flushed to the disk before any of them gets its name. Then the folder's
//! marker is written and flushed; it lists the new files and those that they replace. Then the files are
//! renamed one by one, and their names are flushed. Finally a marker is written that lists only the files now
//! in the folder. Thus a reader finds each file complete, either old or new, even after a power failure, and
//! the next run of the command can prove which files a command made.

use super::guard::{OutputGuard, refuse_measured};
use super::marker::{CsvDialect, FolderMarker, HashingReader, MARKER_FILE, MarkedFile, WritePolicy};
use super::write_failure;
use crate::cli::failure::{Failure, Outcome};
use crate::cli::interrupt;
use crate::recording::files::TRACE_FILE;
use crate::text::is_hashed_as_bytes;
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Read, Seek};
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::NamedTempFile;

/// Prefix and suffix of temporary names.
const TEMPORARY_NAME: (&str, &str) = (".wiperlab-", ".tmp");
/// An unlocked temporary file that is older than this was left by a program that was killed. A running
/// program locks a temporary file within microseconds of its creation, and keeps it locked until the program
/// ends.
const ABANDONED_AFTER: Duration = Duration::from_secs(60);

/// Files of a command under temporary names. If the value is dropped before [`OutputStaging::commit`], the
/// files are removed.
pub(crate) struct OutputStaging {
    folder: PathBuf,
    guard: Option<(OutputGuard, WritePolicy)>,
    files: Vec<StagedFile>,
    made: CreatedFolders,
}

/// A file under a temporary name.
struct StagedFile {
    name: String,
    path: PathBuf,
    file: NamedTempFile,
    sha256: String,
}

impl OutputStaging {
    /// Prepares the files `names`; refuses whatever [`OutputGuard`] refuses.
    pub(crate) fn new(folder: &Path, writer: &WritePolicy, names: &[&str]) -> Outcome<Self> {
        let guard = OutputGuard::new(folder, writer, names)?;
        Ok(Self { guard: Some((guard, writer.clone())), ..Self::new_unguarded(folder, names)? })
    }

    /// Prepares files that are not listed in the marker; the caller ensures that they replace nothing of
    /// value.
    pub(crate) fn new_unmarked(folder: &Path, names: &[&str]) -> Outcome<Self> {
        refuse_measured(folder, names)?;
        Self::new_unguarded(folder, names)
    }

    fn new_unguarded(folder: &Path, names: &[&str]) -> Outcome<Self> {
        names.iter().try_for_each(|name| check_path_free(&folder.join(name)))?;
        Ok(Self {
            folder: folder.to_owned(),
            guard: None,
            files: Vec::new(),
            made: CreatedFolders::default(),
        })
    }

    /// Writes a file under a temporary name and returns the hash of its contents.
    pub(crate) fn stage_file(&mut self, name: &str, contents: impl Read) -> Outcome<String> {
        self.stage_with_hash(name, contents, None)
    }

    /// Writes bytes whose SHA-256 is known under a temporary name.
    pub(crate) fn stage_hashed_file(&mut self, name: &str, bytes: &[u8], sha256: &str) -> Outcome<String> {
        let hash = is_hashed_as_bytes(bytes).then(|| sha256.to_owned());
        self.stage_with_hash(name, bytes, hash)
    }

    fn stage_with_hash(&mut self, name: &str, contents: impl Read, hash: Option<String>) -> Outcome<String> {
        let path = self.folder.join(name);
        self.made.create(path.parent().unwrap_or(Path::new("")))?;
        let dialect = self.guard.as_ref().map_or(CsvDialect::Plain, |(_, writer)| writer.csv);
        let is_converted = name.ends_with(".csv") && name != TRACE_FILE && dialect != CsvDialect::Plain;
        let staged = if is_converted {
            write_temporary_table(&path, contents, dialect)
        } else {
            write_temporary(&path, contents, hash)
        };
        let (file, sha256) = staged.map_err(|error| write_failure(&path, &error))?;
        self.files.push(StagedFile { name: name.to_owned(), path, file, sha256: sha256.clone() });
        Ok(sha256)
    }

    /// Renames all files, or none.
    pub(crate) fn commit(self) -> Outcome<()> {
        let (made, files) = (self.made, self.files); // folders must be dropped after the files in them
        let (folder, guard) = (self.folder, self.guard);
        flush_files(&files)?;
        let within: BTreeSet<PathBuf> =
            files.iter().filter_map(|staged| staged.path.parent()).map(Path::to_owned).collect();
        match guard {
            None => rename_staged(files)?,
            Some((guard, writer)) => {
                let plan = MarkerUpdate::new(&folder, &guard, &writer, &files)?;
                plan.write_pending()?;
                rename_staged(files)?;
                sync_folders(&within)?;
                plan.write_final()?;
            }
        }
        sync_folders(&within)?;
        made.keep()?;
        within.iter().for_each(|folder| remove_abandoned(folder));
        Ok(())
    }
}

fn rename_staged(files: Vec<StagedFile>) -> Outcome<()> {
    let mut whole = interrupt::lock_renames();
    whole.expect_outputs();
    for staged in files {
        staged.file.persist(&staged.path).map_err(|e| write_failure(&staged.path, &e.error))?;
    }
    whole.forget_temporaries();
    Ok(())
}

/// The markers of a folder: before, during and after the renaming of files.
struct MarkerUpdate<'a> {
    folder: &'a Path,
    before: &'a FolderMarker,
    /// Lists the hashes of the new and of the replaced contents of every file, so that this marker is valid
    /// before, during and after the renaming.
    pending: FolderMarker,
    after: FolderMarker,
    outdated: Vec<String>,
}

impl<'a> MarkerUpdate<'a> {
    fn new(
        folder: &'a Path,
        guard: &'a OutputGuard,
        writer: &WritePolicy,
        files: &[StagedFile],
    ) -> Outcome<Self> {
        let names: Vec<&str> = files.iter().map(|staged| staged.name.as_str()).collect();
        let outdated = guard.outdated_files(&names);
        let mut meanwhile = guard.marker.clone();
        for staged in files {
            let own = guard.check_overwrite(&staged.name, Some(&staged.sha256))?;
            let made = MarkedFile {
                by: writer.maker,
                version: env!("CARGO_PKG_VERSION").to_owned(),
                replaces: own.filter(|found| *found != staged.sha256),
                sha256: staged.sha256.clone(),
            };
            meanwhile.files.insert(staged.name.clone(), made);
        }
        let mut after = meanwhile.clone();
        after.files.retain(|name, _| !outdated.contains(name));
        after.files.iter_mut().filter(|(name, _)| names.contains(&name.as_str())).for_each(|(_, made)| {
            made.replaces = None;
        });
        Ok(Self { folder, before: &guard.marker, pending: meanwhile, after, outdated })
    }

    fn write_pending(&self) -> Outcome<()> {
        if self.pending == *self.before { Ok(()) } else { self.write_marker(&self.pending) }
    }

    /// Removes outdated files, then writes the final marker.
    fn write_final(&self) -> Outcome<()> {
        for path in self.outdated.iter().map(|name| self.folder.join(name)) {
            if let Err(error) = fs::remove_file(&path) {
                warn_line!(
                    "warning: {}: left from an earlier run, and cannot be removed: {error}",
                    path.display()
                );
            }
        }
        if self.after == self.pending { Ok(()) } else { self.write_marker(&self.after) }
    }

    fn write_marker(&self, marker: &FolderMarker) -> Outcome<()> {
        let path = self.folder.join(MARKER_FILE);
        let text = serde_json::to_string_pretty(marker).map_err(Failure::internal)? + "\n";
        let written = write_temporary(&path, text.as_bytes(), None).and_then(|(file, _)| {
            file.as_file().sync_all()?;
            file.persist(&path).map_err(io::Error::from)
        });
        written.map_err(|error| write_failure(&path, &error))?;
        sync_folders(&BTreeSet::from([self.folder.to_owned()]))
    }
}

/// Flushes folders to the disk, so that the names of new files survive a power failure. Does nothing on file
/// systems that cannot flush folders.
fn sync_folders(folders: &BTreeSet<PathBuf>) -> Outcome<()> {
    #[cfg(unix)]
    for folder in folders {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let unknown =
            |error: &io::Error| matches!(error.kind(), ErrorKind::InvalidInput | ErrorKind::Unsupported);
        match File::open(folder).and_then(|folder| folder.sync_all()) {
            Err(error) if !unknown(&error) => return Err(write_failure(folder, &error)),
            _ => {}
        }
    }
    Ok(())
}

/// Folders that were created for files. When the value is dropped, folders that are still empty are removed.
#[derive(Default)]
struct CreatedFolders(Vec<PathBuf>);

impl CreatedFolders {
    /// Creates a folder with its missing parents, and records the created folders, the outermost first.
    fn create(&mut self, folder: &Path) -> Outcome<()> {
        let is_missing = |path: &&Path| !path.as_os_str().is_empty() && !path.exists();
        let mut missing: Vec<PathBuf> =
            folder.ancestors().take_while(is_missing).map(Path::to_owned).collect();
        missing.reverse();
        self.0.extend_from_slice(&missing);
        interrupt::track_new_folders(missing, || fs::create_dir_all(folder))
            .map_err(|error| write_failure(folder, &error))
    }

    /// Keeps the folders, and flushes their names to the disk.
    fn keep(mut self) -> Outcome<()> {
        let parents = std::mem::take(&mut self.0);
        sync_folders(&parents.iter().filter_map(|made| made.parent()).map(Path::to_owned).collect())
    }
}

impl Drop for CreatedFolders {
    fn drop(&mut self) {
        for folder in self.0.iter().rev() {
            // this removes only an empty folder; the failure that left it empty is reported elsewhere
            let _ = fs::remove_dir(folder);
        }
    }
}

/// Refuses a path at which something other than a file exists, or that cannot be the path of a file. All
/// paths are checked before the first file is renamed, so that the files appear together.
pub(crate) fn check_path_free(path: &Path) -> Outcome<()> {
    let taken = |at: &Path, found: &str, expected: &str| {
        let at = at.display();
        let problem =
            format!("is {found}, expected {expected} or nothing; remove it or choose another folder");
        Err(Failure::at(at, problem))
    };
    let found = fs::symlink_metadata(path);
    match path.parent() {
        _ if path.is_dir() => taken(path, "a folder", "a file"),
        Some(within) if within.exists() && !within.is_dir() => taken(within, "a file", "a folder"),
        // for example a name that is too long
        _ => match found {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(write_failure(path, &error)),
            _ => Ok(()),
        },
    }
}

/// Size of the buffer through which a file is copied, in bytes.
const COPIED_BYTES: usize = 1 << 16;

/// Writes a file under a temporary name and locks it, if the file system can; returns the file with its hash,
/// which is computed unless it is given.
fn write_temporary(
    path: &Path,
    mut contents: impl Read,
    hash: Option<String>,
) -> io::Result<(NamedTempFile, String)> {
    let within = path.parent().unwrap_or(Path::new(""));
    let mut builder = tempfile::Builder::new();
    builder.prefix(TEMPORARY_NAME.0).suffix(TEMPORARY_NAME.1).permissions(readable_by_all());
    let mut file = interrupt::track_temporary_file(|| builder.tempfile_in(within))?;
    let _ = file.as_file().try_lock();
    if let Some(hash) = hash {
        io::copy(&mut contents, file.as_file_mut())?;
        return Ok((file, hash));
    }
    let mut contents = io::BufReader::with_capacity(COPIED_BYTES, HashingReader::new(contents));
    io::copy(&mut contents, file.as_file_mut())?;
    Ok((file, contents.into_inner().hash.finish()))
}

/// Like [`write_temporary`], but converts a plain table to another dialect.
fn write_temporary_table(
    path: &Path,
    plain: impl Read,
    dialect: CsvDialect,
) -> io::Result<(NamedTempFile, String)> {
    let mut converted = tempfile::tempfile_in(path.parent().unwrap_or(Path::new("")))?;
    dialect.convert_table(plain, io::BufWriter::new(&mut converted))?;
    converted.rewind()?;
    write_temporary(path, converted, None)
}

/// Removes temporary files left by programs that were killed.
fn remove_abandoned(folder: &Path) {
    let passing = |name: &str| name.starts_with(TEMPORARY_NAME.0) && name.ends_with(TEMPORARY_NAME.1);
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if passing(&entry.file_name().to_string_lossy()) && is_abandoned(&entry.path()) {
            let _ = fs::remove_file(entry.path()); // a failure is harmless; the next command tries again
        }
    }
}

fn is_abandoned(path: &Path) -> bool {
    let is_old = |found: &fs::Metadata| {
        found.is_file()
            && found.modified().is_ok_and(|at| at.elapsed().is_ok_and(|age| age > ABANDONED_AFTER))
    };
    fs::symlink_metadata(path).is_ok_and(|found| is_old(&found))
        && File::open(path).is_ok_and(|file| file.try_lock().is_ok())
}

/// Flushes files to the disk in parallel, since the file system can commit many of them at once.
fn flush_files(staged: &[StagedFile]) -> Outcome<()> {
    const AT_ONCE: usize = 64;
    let flushed = |staged: &StagedFile| {
        staged.file.as_file().sync_all().map_err(|error| write_failure(&staged.path, &error))
    };
    staged.chunks(AT_ONCE).try_for_each(|files| {
        std::thread::scope(|scope| {
            let waiting: Vec<_> = files.iter().map(|file| scope.spawn(move || flushed(file))).collect();
            let stopped = |_| Err(Failure::Internal("a file could not be flushed to the disk".to_owned()));
            waiting.into_iter().try_for_each(|handle| handle.join().unwrap_or_else(stopped))
        })
    })
}

/// Permissions of an ordinary new file, reduced by the mask (umask) of the user; temporary files are private
/// by default.
#[cfg(unix)]
fn readable_by_all() -> fs::Permissions {
    std::os::unix::fs::PermissionsExt::from_mode(0o666)
}

#[cfg(test)]
mod tests;
