//! A journal on disk: locked, shortened by nothing but a torn line, and kept when a new one is begun.
//!
//! Every append waits until the disk has the lines (`fdatasync`), and a new file also until the disk has its
//! name. What was counted or reported survives a power failure.

use super::backup::set_aside;
use crate::failure::Failure;
use crate::files;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use wiperlab::journal::{Journal, Kind, Record, Sink, has_whole_line, kind_of, read};

/// Name of a journal in the folder of its fit or study.
pub const JOURNAL: &str = "journal.jsonl";

/// A journal on disk.
pub struct JournalFile {
    path: PathBuf,
    /// `None` before the first line of a new journal.
    file: Option<File>,
    /// What has to be done with what is there, before the first line is appended.
    due: Option<Due>,
    kind: Kind,
}

/// What is done with a journal that is there.
#[derive(Clone, Copy)]
enum Due {
    /// It is kept under another name: hours of work should not be lost because `--resume` was forgotten.
    SetAside,
    /// It is continued after this number of bytes, and a line end where the last line has none.
    Continue { intact_bytes: u64, unended: bool },
}

impl JournalFile {
    /// The journal at `path`, or where it will be, and what it holds if it is to be resumed; nothing is
    /// changed before the first line.
    pub fn open<R: Record>(path: &Path, resume: bool) -> Result<(Self, Option<Journal<R>>), Failure> {
        let name = path.display().to_string();
        let (file, bytes) = locked(path, R::KIND)?;
        let journal = Self { path: path.to_owned(), file, due: Some(Due::SetAside), kind: R::KIND };
        if !resume {
            check_own(&name, &bytes, R::KIND)?;
            return Ok((journal, None));
        }
        let found: Option<Journal<R>> = read(&name, &bytes).map_err(Failure::input)?;
        let due = match &found {
            None => {
                let lack = if bytes.is_empty() { "" } else { "no complete header, so " };
                warn_line!("warning: {name}: {lack}nothing to resume; starting over");
                let empty = Due::Continue { intact_bytes: 0, unended: false };
                if bytes.is_empty() { empty } else { Due::SetAside }
            }
            Some(found) => {
                warn_of(&name, found);
                let Journal { intact_bytes, unended, .. } = *found;
                let intact_bytes = intact_bytes as u64;
                if found.is_unchecked() { Due::SetAside } else { Due::Continue { intact_bytes, unended } }
            }
        };
        Ok((Self { due: Some(due), ..journal }, found))
    }

    /// Drops what is torn, also where nothing had to be appended.
    pub fn finish(mut self) -> Result<(), Failure> {
        self.prepare().map_err(|problem| Failure::Internal(format!("{}: {problem}", self.path.display())))
    }

    /// Does what is due.
    fn prepare(&mut self) -> Result<(), String> {
        let refused = |error: std::io::Error| error.to_string();
        match (self.due.take(), &mut self.file) {
            (Some(Due::Continue { intact_bytes, unended }), Some(file)) => {
                file.set_len(intact_bytes).map_err(refused)?;
                if unended { file.write_all(b"\n").map_err(refused) } else { Ok(()) }
            }
            (Some(Due::SetAside), Some(_)) => {
                self.file = None;
                let kept = set_aside(&self.path).map_err(refused)?;
                warn_line!("{}: the old journal is kept as {}", self.path.display(), kept.display());
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn write(&mut self, lines: &str) -> Result<(), String> {
        let refused = |error: std::io::Error| error.to_string();
        self.prepare()?;
        let file = match &mut self.file {
            Some(file) => file,
            none => none.insert(begin(&self.path, self.kind)?),
        };
        file.write_all(lines.as_bytes()).and_then(|()| file.sync_data()).map_err(refused)
    }
}

impl Sink for JournalFile {
    fn append(&mut self, lines: &str) -> Result<(), String> {
        self.write(lines).map_err(|problem| format!("{}: {problem}", self.path.display()))
    }
}

/// A new journal, whose name the disk has.
fn begin(path: &Path, kind: Kind) -> Result<File, String> {
    let refused = |error: std::io::Error| error.to_string();
    let folder = path.parent().unwrap_or(Path::new(""));
    fs::create_dir_all(folder).map_err(refused)?;
    let file = OpenOptions::new().create(true).append(true).open(path).map_err(refused)?;
    lock(&file, kind)?;
    sync_folder(folder);
    Ok(file)
}

/// Waits until the disk has the names in a folder, where the system can.
fn sync_folder(folder: &Path) {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let _ = File::open(folder).and_then(|folder| folder.sync_all()); // (Windows opens no folder)
}

fn warn_of<R: Record>(name: &str, found: &Journal<R>) {
    let record = R::KIND.record();
    if found.torn {
        warn_line!(
            "warning: {name}: the last line is incomplete and was dropped; its {record} is computed again"
        );
    }
    if found.is_unchecked() {
        warn_line!("warning: {name}: {}", unchecked(R::KIND));
    }
}

/// What a journal of layout 2 lacks, in words.
pub fn unchecked(kind: Kind) -> String {
    format!(
        "a journal of layout 2, whose lines have no checksums: a digit that was changed in what {} gave cannot be found",
        match kind {
            Kind::Fit => "an evaluation",
            Kind::Trace => "an iterate",
            Kind::Sweep => "a point",
        }
    )
}

/// The file, if there is one, and its bytes.
pub fn locked(path: &Path, kind: Kind) -> Result<(Option<File>, Vec<u8>), Failure> {
    let refused = |problem: String| Failure::Input(format!("{}: {problem}", path.display()));
    let file = match OpenOptions::new().read(true).append(true).open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok((None, Vec::new())),
        Err(error) => {
            return Err(refused(format!(
                "cannot be read and written: {error}; correct that, or move it away"
            )));
        }
    };
    if !file.metadata().is_ok_and(|found| found.is_file()) {
        return Err(refused("found no regular file, expected a journal; move it away".to_owned()));
    }
    lock(&file, kind).map_err(refused)?;
    let bytes = files::read_open(path, &file)?;
    Ok((Some(file), bytes))
}

/// Two programs that append to one file would tear each other's lines. File systems without locks are taken
/// as they are.
fn lock(file: &File, kind: Kind) -> Result<(), String> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(format!(
            "another {kind} is writing this journal; wait until it has ended, or use a folder of its own"
        )),
        _ => Ok(()),
    }
}

/// Only a journal of the same kind of input, or what is left of one, gives way to a new one: a job may turn
/// from features to traces.
fn check_own(name: &str, bytes: &[u8], kind: Kind) -> Result<(), Failure> {
    if !has_whole_line(bytes) || kind_of(bytes).is_some_and(|found| found.input() == kind.input()) {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "{name}: found a file that is no journal of a {kind}; choose another folder, or move it away"
    )))
}
