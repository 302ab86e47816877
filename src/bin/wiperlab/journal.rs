//! `wiperlab journal`, and the journal of a fit on disk.

use crate::failure::{Failure, Outcome};
use crate::files;
use crate::global::Global;
use clap::{Args, Subcommand};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use wiperlab::fit::journal::{self, Journal, Sink};

#[derive(Debug, Args)]
pub struct JournalArgs {
    #[command(subcommand)]
    pub command: JournalCommand,
}

#[derive(Debug, Subcommand)]
pub enum JournalCommand {
    /// Put journals of one problem together, such as those of several machines or seeds
    ///
    /// The first journal says which seed the merged one belongs to: put the result beside a job with that
    /// seed as journal.jsonl and go on with `wiperlab fit JOB --resume`. Evaluations of other seeds then
    /// count as known: they are not made again, local searches start from the best of them, and the best
    /// point may be one of them.
    Merge(MergeArgs),
}

#[derive(Debug, Args)]
pub struct MergeArgs {
    /// Journals (fits/NAME/journal.jsonl) of the same job, scenes, data and version; seeds and budgets may
    /// differ
    #[arg(required = true, num_args = 2.., value_name = "JOURNAL")]
    pub journals: Vec<PathBuf>,
    /// Where the merged journal is written; a new file
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
}

impl JournalArgs {
    pub fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        match &self.command {
            JournalCommand::Merge(args) => args.run(global),
        }
    }
}

impl MergeArgs {
    fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        let Some(name) = self.out.file_name().and_then(|name| name.to_str()) else {
            return Err(Failure::Input(format!(
                "--out: found {}, expected the name of a new file",
                self.out.display()
            )));
        };
        if self.out.exists() {
            let out = self.out.display();
            return Err(Failure::Input(format!(
                "{out}: exists, and no journal is written over another one; choose a new file for --out, or move {out} away"
            )));
        }
        let files: Vec<String> = self.journals.iter().map(|path| path.display().to_string()).collect();
        let journals = self.journals.iter().map(|path| journal_of(path)).collect::<Result<Vec<_>, _>>()?;
        let named: Vec<(&str, &Journal)> = files.iter().map(String::as_str).zip(&journals).collect();
        let merged = journal::merge(&named).map_err(Failure::input)?;
        files::write_all(self.out.parent().unwrap_or(Path::new("")), &[(name, merged.text.into_bytes())])?;
        if !global.quiet {
            for ((file, journal), new) in named.iter().zip(&merged.new) {
                print_line!(
                    "{file}: seed {}, {} evaluations, {new} of them new",
                    journal.header.seed,
                    journal.entries.len()
                );
            }
            let seed = journals.first().map_or(0, |journal| journal.header.seed);
            print_line!(
                "{}: {} evaluations, to be resumed by a job with seed = {seed}",
                self.out.display(),
                merged.new.iter().sum::<usize>()
            );
        }
        Ok(Outcome::Done)
    }
}

/// A journal that is merged; a last line that is torn is dropped, and said.
fn journal_of(path: &Path) -> Result<Journal, Failure> {
    let name = path.display().to_string();
    let journal = journal::read(&name, files::read(path)?).map_err(Failure::input)?;
    let journal = journal.ok_or_else(|| {
        Failure::Input(format!("{name}: found no complete line, expected a journal; leave it out"))
    })?;
    if journal.torn {
        warn_line!("warning: {name}: the last line is incomplete and was dropped");
    }
    Ok(journal)
}

/// The journal of a fit on disk; each line is handed to the system before the next evaluation, so that
/// killing the program loses none.
pub struct JournalFile {
    path: PathBuf,
    /// There is none before the first line of a new journal.
    file: Option<File>,
    /// What has to be done with what is there, before the first line is appended.
    due: Option<Due>,
}

/// What is done with a journal that is there.
#[derive(Clone, Copy)]
enum Due {
    /// It is kept under another name: hours of work should not be lost because `--resume` was forgotten.
    SetAside,
    /// It is continued behind so many bytes.
    Cut(u64),
}

/// Where the journal before the last one is kept.
const PREVIOUS: &str = "journal.previous.jsonl";

impl JournalFile {
    /// The journal at `path`, or where it will be; nothing is changed before the first line.
    pub fn new(path: &Path) -> Result<Self, Failure> {
        let file = match OpenOptions::new().read(true).append(true).open(path) {
            Ok(file) => Some(file),
            Err(error) if error.kind() == ErrorKind::NotFound => None,
            Err(error) => {
                return Err(Failure::Input(format!(
                    "{}: cannot be read and written: {error}; correct that, or move it away",
                    path.display()
                )));
            }
        };
        file.iter()
            .try_for_each(lock)
            .map_err(|problem| Failure::Input(format!("{}: {problem}", path.display())))?;
        Ok(Self { path: path.to_owned(), file, due: Some(Due::SetAside) })
    }

    /// What the file holds, to go on from there; without any, the fit starts anew.
    pub fn resumed(&mut self) -> Result<Option<Journal>, Failure> {
        let name = self.path.display().to_string();
        let mut bytes = Vec::new();
        if let Some(file) = &mut self.file {
            file.read_to_end(&mut bytes)
                .map_err(|error| Failure::Input(format!("{name}: cannot be read: {error}")))?;
        }
        let journal = journal::read(&name, bytes).map_err(Failure::input)?;
        match &journal {
            None => warn_line!("warning: {name}: nothing to resume; starting anew"),
            Some(journal) if journal.torn => warn_line!(
                "warning: {name}: the last line is incomplete and was dropped; its evaluation is made again"
            ),
            Some(_) => {}
        }
        self.due = Some(Due::Cut(journal.as_ref().map_or(0, |journal| journal.intact_bytes as u64)));
        Ok(journal)
    }

    /// Drops what is torn, also where nothing had to be appended.
    pub fn finish(mut self) -> Result<(), Failure> {
        self.prepare().map_err(|problem| Failure::Internal(format!("{}: {problem}", self.path.display())))
    }

    /// Does what is due.
    fn prepare(&mut self) -> Result<(), String> {
        let said = |error: std::io::Error| error.to_string();
        match (self.due.take(), &self.file) {
            (Some(Due::Cut(length)), Some(file)) => file.set_len(length).map_err(said),
            (Some(Due::SetAside), Some(_)) => {
                self.file = None;
                std::fs::rename(&self.path, self.path.with_file_name(PREVIOUS)).map_err(said)
            }
            _ => Ok(()),
        }
    }

    fn write(&mut self, line: &str) -> Result<(), String> {
        let said = |error: std::io::Error| error.to_string();
        self.prepare()?;
        if self.file.is_none() {
            let file = OpenOptions::new().create(true).append(true).open(&self.path).map_err(said)?;
            lock(&file)?;
            self.file = Some(file);
        }
        self.file
            .as_mut()
            .map_or(Ok(()), |file| file.write_all(line.as_bytes()).and_then(|()| file.flush()))
            .map_err(said)
    }
}

impl Sink for JournalFile {
    fn append(&mut self, line: &str) -> Result<(), String> {
        self.write(line).map_err(|problem| format!("{}: {problem}", self.path.display()))
    }
}

/// Two fits that append to one file would tear each other's lines. File systems without locks are taken as
/// they are.
fn lock(file: &File) -> Result<(), String> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err("another fit is writing this journal; wait until it has ended, or copy the job to a folder of its own".to_owned()),
        _ => Ok(()),
    }
}
