//! A journal on disk. It is locked while it is open. A crash loses at most an incomplete last line. If a new
//! journal is begun, the old one is kept under another name.
//!
//! Every append waits until its lines are on the disk (`fdatasync`), and the creation of a journal waits
//! until its name is on the disk. Therefore every record that was counted or reported survives a power
//! failure.

use super::prelude::*;
use crate::checkpoint::{
    CheckpointEnd, CheckpointError, CheckpointFile, CheckpointHeader, CheckpointKind, CheckpointReader,
    CheckpointRecord, CheckpointSink, StoredRecord, detect_kind, has_whole_line,
};
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, BufRead, BufReader, ErrorKind, Read, Write};

/// Name of a journal in the folder of its fit or study.
pub(crate) const CHECKPOINT_FILE: &str = "journal.jsonl";

/// Maximum number of bytes that are read of the first line of an existing file.
const MAX_HEADER_BYTES: u64 = 1 << 24;

/// A journal on disk.
pub(crate) struct CheckpointWriter {
    path: PathBuf,
    /// The file; `None` before the first line of a new journal.
    file: Option<File>,
    /// Pending action on the existing file, carried out before the first line is appended.
    due: Option<PendingAction>,
    kind: CheckpointKind,
}

/// A journal open for writing and, if it is resumed, its contents.
type OpenedCheckpoint<T> = Outcome<(CheckpointWriter, Option<T>)>;

/// Function that visits the records of a journal one by one.
type RecordVisitor<'a, R> = dyn FnMut(StoredRecord<R>) -> Result<(), CheckpointError> + 'a;

/// What is done with an existing journal before the first line is appended.
#[derive(Clone, Copy)]
enum PendingAction {
    /// Rename the journal, so that hours of work are not lost if `--resume` was forgotten.
    SetAside,
    /// Continue after this number of bytes, and add a line end if the last line has none.
    Continue { intact_bytes: usize, unended: bool },
}

impl CheckpointWriter {
    /// Opens the journal at `path` and, if it is resumed, reads its contents. Nothing on disk changes before
    /// the first line is appended.
    pub(crate) fn open<R: CheckpointRecord>(
        path: &Path,
        resume: bool,
    ) -> OpenedCheckpoint<CheckpointFile<R>> {
        Self::open_with(path, resume, |file, stream| {
            files::check_data_size(path, file)?;
            let journal = stream.read_all().map_err(Failure::input)?;
            let end = journal.end;
            Ok((journal, end))
        })
    }

    /// Like [`Self::open`], for a journal larger than memory: the function `each` visits the records one by
    /// one, and only the header is returned.
    pub(crate) fn open_each<R: CheckpointRecord>(
        path: &Path,
        resume: bool,
        each: &mut RecordVisitor<R>,
    ) -> OpenedCheckpoint<CheckpointHeader<R::Body>> {
        Self::open_with(path, resume, |_, mut stream: CheckpointReader<R, _>| {
            let header = stream.header().clone();
            while let Some(found) = stream.next_record().map_err(Failure::input)? {
                each(found).map_err(Failure::input)?;
            }
            Ok((header, stream.end()))
        })
    }

    /// Locks the journal. If the journal is resumed and has a header, the function `take` reads the records.
    fn open_with<R: CheckpointRecord, T>(
        path: &Path,
        resume: bool,
        take: impl FnOnce(&File, CheckpointReader<R, BufReader<&File>>) -> Outcome<(T, CheckpointEnd)>,
    ) -> OpenedCheckpoint<T> {
        let name = path.display().to_string();
        let due = Some(PendingAction::SetAside);
        let mut opened =
            Self { path: path.to_owned(), file: lock_existing(path, R::KIND)?, due, kind: R::KIND };
        let refused = |error: io::Error| Failure::Input(format!("{name}: cannot be read: {error}"));
        let Some(file) = &opened.file else {
            if resume {
                opened.plan_resume(&name, true, None);
            }
            return Ok((opened, None));
        };
        if !resume {
            let mut start = Vec::new();
            BufReader::new(file.take(MAX_HEADER_BYTES)).read_until(b'\n', &mut start).map_err(refused)?;
            check_same_kind(&name, &start, R::KIND)?;
            return Ok((opened, None));
        }
        let is_empty = file.metadata().map_err(refused)?.len() == 0;
        let stream = CheckpointReader::<R, _>::open(&name, BufReader::new(file)).map_err(Failure::input)?;
        let Some(stream) = stream else {
            opened.plan_resume(&name, is_empty, None);
            return Ok((opened, None));
        };
        let (taken, end) = take(file, stream)?;
        opened.plan_resume(&name, is_empty, Some(end));
        Ok((opened, Some(taken)))
    }

    /// Plans how a resumed journal is continued after `end`; `end` is `None` if the journal has no complete
    /// header.
    fn plan_resume(&mut self, name: &str, is_empty: bool, end: Option<CheckpointEnd>) {
        self.due = Some(match end {
            None => {
                let lack = if is_empty { "" } else { "no complete header, so " };
                warn_line!("warning: {name}: {lack}nothing to resume; starting over");
                let empty = PendingAction::Continue { intact_bytes: 0, unended: false };
                if is_empty { empty } else { PendingAction::SetAside }
            }
            Some(CheckpointEnd { intact_bytes, torn, unended }) => {
                if torn {
                    let record = self.kind.record();
                    warn_line!(
                        "warning: {name}: the last line is incomplete and was dropped; its {record} is computed again"
                    );
                }
                PendingAction::Continue { intact_bytes, unended }
            }
        });
    }

    /// Removes an incomplete last line, or renames the old journal, even if no line was appended.
    pub(crate) fn finish(mut self) -> Outcome<()> {
        self.apply_pending()
            .map_err(|problem| Failure::Internal(format!("{}: {problem}", self.path.display())))
    }

    /// Carries out the pending action on the existing journal.
    fn apply_pending(&mut self) -> Result<(), String> {
        let refused = |error: io::Error| error.to_string();
        match (self.due.take(), &mut self.file) {
            (Some(PendingAction::Continue { intact_bytes, unended }), Some(file)) => {
                file.set_len(intact_bytes as u64).map_err(refused)?;
                if unended { file.write_all(b"\n").map_err(refused) } else { Ok(()) }
            }
            (Some(PendingAction::SetAside), Some(_)) => {
                self.file = None;
                let kept = set_aside(&self.path).map_err(refused)?;
                warn_line!("{}: the old journal is kept as {}", self.path.display(), kept.display());
                Ok(())
            }
            _ => Ok(()),
        }
    }
}

impl CheckpointSink for CheckpointWriter {
    fn append(&mut self, lines: &str) -> Result<(), String> {
        self.apply_pending()
            .and_then(|()| {
                let file = match &mut self.file {
                    Some(file) => file,
                    none => none.insert(create_checkpoint(&self.path, self.kind)?),
                };
                let written = file.write_all(lines.as_bytes()).and_then(|()| file.sync_data());
                written.map_err(|error| error.to_string())
            })
            .map_err(|problem| format!("{}: {problem}", self.path.display()))
    }
}

/// Creates a journal, and waits until its name is on the disk.
fn create_checkpoint(path: &Path, kind: CheckpointKind) -> Result<File, String> {
    let refused = |error: io::Error| error.to_string();
    let folder = path.parent().unwrap_or(Path::new(""));
    fs::create_dir_all(folder).map_err(refused)?;
    let file = OpenOptions::new().create(true).append(true).open(path).map_err(refused)?;
    lock_file(&file, kind)?;
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let _ = File::open(folder).and_then(|folder| folder.sync_all()); // Windows cannot open folders

    Ok(file)
}

/// Opens and locks the file, if it exists.
fn lock_existing(path: &Path, kind: CheckpointKind) -> Outcome<Option<File>> {
    let refused = |problem: String| Failure::at(path.display(), problem);
    let file = match OpenOptions::new().read(true).append(true).open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(e) => {
            return Err(refused(format!("cannot be read and written: {e}; correct that, or move it away")));
        }
    };
    if !file.metadata().is_ok_and(|found| found.is_file()) {
        return Err(refused("found no regular file, expected a journal; move it away".to_owned()));
    }
    lock_file(&file, kind).map_err(refused)?;
    Ok(Some(file))
}

/// Locks a journal, because the lines of two programs that append to one file would be mixed. On a file
/// system without locks, nothing prevents this.
fn lock_file(file: &File, kind: CheckpointKind) -> Result<(), String> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(format!(
            "another {kind} is writing this journal; wait until it has ended, or write to another folder"
        )),
        _ => Ok(()),
    }
}

/// Refuses to replace an existing file by a new journal. Allowed are a file whose first line is incomplete,
/// and a journal of the same kind.
fn check_same_kind(name: &str, bytes: &[u8], kind: CheckpointKind) -> Outcome<()> {
    if !has_whole_line(bytes) || detect_kind(bytes) == Some(kind) {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "{name}: found a file that is no journal of a {kind}; choose another folder, or move it away"
    )))
}

/// Renames a journal to the next free name, such as `journal.previous-1.jsonl`. No journal is overwritten.
fn set_aside(path: &Path) -> io::Result<PathBuf> {
    let mut number = 1;
    loop {
        let to = numbered_path(path, number);
        // creating the file reserves the name, in case another program wants to use it
        match File::create_new(&to) {
            Ok(_) => {
                fs::rename(path, &to)?;
                return Ok(to);
            }
            Err(error) if error.kind() == ErrorKind::AlreadyExists => number += 1,
            Err(error) => return Err(error),
        }
    }
}

fn numbered_path(path: &Path, number: usize) -> PathBuf {
    let extension = path.extension().map_or_else(String::new, |e| format!(".{}", e.to_string_lossy()));
    path.with_extension(format!("previous-{number}{extension}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_old_journal_has_a_number_of_its_own() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(CHECKPOINT_FILE);
        let set_aside = |content| {
            fs::write(&path, content).unwrap();
            set_aside(&path).unwrap()
        };
        ["a", "b", "c"].into_iter().for_each(|content| drop(set_aside(content)));
        fs::remove_file(numbered_path(&path, 2)).unwrap();
        assert_eq!(set_aside("d"), folder.path().join("journal.previous-2.jsonl"));
        let read = |number| fs::read_to_string(numbered_path(&path, number)).unwrap();
        assert_eq!([read(1), read(2), read(3)], ["a", "d", "c"]);
        assert!(!path.exists());
    }
}
