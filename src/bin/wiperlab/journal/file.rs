//! A journal on disk: locked, shortened by nothing but a torn line, and kept when a new one is begun.

use crate::failure::Failure;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use wiperlab::journal::{Journal, Kind, Record, Sink, kind_of, read};

/// Name of a journal in the folder of its fit or study.
pub const JOURNAL: &str = "journal.jsonl";

/// A journal on disk; each line is handed to the system before the computation goes on, so that killing the
/// program loses none.
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
    /// It is continued after this number of bytes.
    Cut(u64),
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
        let found: Option<Journal<R>> = read(&name, bytes).map_err(Failure::input)?;
        let record = R::KIND.record();
        match &found {
            None => warn_line!("warning: {name}: nothing to resume; starting over"),
            Some(found) if found.torn => warn_line!(
                "warning: {name}: the last line is incomplete and was dropped; its {record} is computed again"
            ),
            Some(_) => {}
        }
        let intact_bytes = found.as_ref().map_or(0, |found| found.intact_bytes as u64);
        Ok((Self { due: Some(Due::Cut(intact_bytes)), ..journal }, found))
    }

    /// Drops what is torn, also where nothing had to be appended.
    pub fn finish(mut self) -> Result<(), Failure> {
        self.prepare().map_err(|problem| Failure::Internal(format!("{}: {problem}", self.path.display())))
    }

    /// Does what is due.
    fn prepare(&mut self) -> Result<(), String> {
        let refused = |error: std::io::Error| error.to_string();
        match (self.due.take(), &self.file) {
            (Some(Due::Cut(length)), Some(file)) => file.set_len(length).map_err(refused),
            (Some(Due::SetAside), Some(_)) => {
                self.file = None;
                fs::rename(&self.path, self.path.with_extension("previous.jsonl")).map_err(refused)
            }
            _ => Ok(()),
        }
    }

    fn write(&mut self, line: &str) -> Result<(), String> {
        let refused = |error: std::io::Error| error.to_string();
        self.prepare()?;
        if self.file.is_none() {
            fs::create_dir_all(self.path.parent().unwrap_or(Path::new(""))).map_err(refused)?;
            let file = OpenOptions::new().create(true).append(true).open(&self.path).map_err(refused)?;
            lock(&file, self.kind)?;
            self.file = Some(file);
        }
        let Some(file) = &mut self.file else { return Ok(()) };
        file.write_all(line.as_bytes()).and_then(|()| file.flush()).map_err(refused)
    }
}

impl Sink for JournalFile {
    fn append(&mut self, line: &str) -> Result<(), String> {
        self.write(line).map_err(|problem| format!("{}: {problem}", self.path.display()))
    }
}

/// The file, if there is one, and its bytes.
fn locked(path: &Path, kind: Kind) -> Result<(Option<File>, Vec<u8>), Failure> {
    let refused = |problem: String| Failure::Input(format!("{}: {problem}", path.display()));
    let mut bytes = Vec::new();
    let mut file = match OpenOptions::new().read(true).append(true).open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok((None, bytes)),
        Err(error) => {
            return Err(refused(format!(
                "cannot be read and written: {error}; correct that, or move it away"
            )));
        }
    };
    lock(&file, kind).map_err(refused)?;
    file.read_to_end(&mut bytes).map_err(|error| refused(format!("cannot be read: {error}")))?;
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

/// Only a journal of the same kind, or what is left of one, gives way to a new one.
fn check_own(name: &str, bytes: &[u8], kind: Kind) -> Result<(), Failure> {
    if !bytes.contains(&b'\n') || kind_of(bytes) == Some(kind) {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "{name}: found a file that is no journal of a {kind}; choose another folder, or move it away"
    )))
}
