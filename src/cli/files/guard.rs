//! Rules for overwriting. A command may overwrite files that it provably made itself, and other files only
//! with `--force`. A measured recording is never overwritten, except by a new import of the same exported
//! files.

use super::marker::{FolderMarker, OutputCommand, WritePolicy, hash_file};
use super::preserved_files::{FolderRecording, SIMULATION_SUMMARY, is_simulation_summary};
use crate::cli::failure::{Failure, Outcome};
use crate::recording::files::{DESCRIPTION_FILE, TRACE_FILE};
use std::fs;
use std::path::{Component, Path, PathBuf};

/// Refuses to replace files of a measured recording.
pub(crate) fn refuse_measured(folder: &Path, names: &[&str]) -> Outcome<()> {
    let (marker, _) = FolderMarker::load(folder)?;
    let FolderRecording::Measured { why, files, .. } = FolderRecording::detect(folder, &marker)? else {
        return Ok(());
    };
    let taken = names.iter().find(|name| files.iter().any(|file| file.eq_ignore_ascii_case(name)));
    taken
        .map_or(Ok(()), |name| Err(other_recording_failure(&folder.join(name), &why, "choose another place")))
}

fn other_recording_failure(path: &Path, why: &str, advice: &str) -> Failure {
    Failure::at(
        path.display(),
        format!(
            "found another recording, which {why}; expected none, as no measured recording is overwritten: {advice}"
        ),
    )
}

/// The state of a folder before a command writes into it.
#[derive(Debug)]
pub(crate) struct OutputGuard {
    folder: PathBuf,
    writer: WritePolicy,
    pub marker: FolderMarker,
    /// Reason why the marker of the folder cannot be read.
    unreadable: Option<String>,
}

impl OutputGuard {
    /// Refuses a folder whose recording the command would destroy or contradict by writing the files `names`.
    pub(crate) fn new(folder: &Path, writer: &WritePolicy, names: &[&str]) -> Outcome<Self> {
        let (marker, unreadable) = FolderMarker::load(folder)?;
        let guard = Self { folder: folder.to_owned(), writer: writer.clone(), marker, unreadable };
        guard.protect_recording(names)?;
        guard.refuse_contradiction(names)?;
        Ok(guard)
    }

    /// Refuses to overwrite the file `name`, unless the command provably made it, `--force` is given, or the
    /// new contents are identical. `coming` is the hash of the new contents, if known. Returns the hash of
    /// the existing file if the command made it.
    pub(crate) fn check_overwrite(&self, name: &str, coming: Option<&str>) -> Outcome<Option<String>> {
        let path = self.folder.join(name);
        let Some(found) = hash_file(&path)? else { return Ok(None) };
        let by = self.marker.maker_if_unchanged(name, &found);
        if by == Some(self.writer.maker) {
            return Ok(Some(found));
        }
        if self.writer.force || coming == Some(found.as_str()) {
            return Ok(None);
        }
        let what = match (by, self.marker.files.get(name)) {
            (Some(by), _) => format!("a file that `wiperlab {}` made", by.command_name()),
            (None, Some(made)) => {
                format!("a file that was changed since `wiperlab {}` made it", made.by.command_name())
            }
            (None, None) => "a file that no wiperlab command is known to have made".to_owned(),
        };
        let unreadable = self.unreadable.iter().map(|why| format!(" ({why})")).collect::<String>();
        let maker = self.writer.maker;
        Err(Failure::at(
            path.display(),
            format!(
                "found {what}{unreadable}, expected none or one that `wiperlab {}` made and nobody changed since; {}, or overwrite it with --force",
                maker.command_name(),
                maker.overwrite_advice()
            ),
        ))
    }

    /// Files to remove after the command has written `names`: unchanged files of the previous run of the
    /// command and, with `--force`, unchanged files of a recording that another command made.
    pub(crate) fn outdated_files(&self, names: &[&str]) -> Vec<String> {
        let maker = self.writer.maker;
        let of_last_run = |by: OutputCommand| by == maker && maker.replaces_last_run();
        let of_other = |by: OutputCommand| by != maker && by.makes_recordings() && maker.makes_recordings();
        let goes = |by: OutputCommand| of_last_run(by) || (self.writer.force && of_other(by));
        let listed =
            self.marker.files.iter().filter(|(name, made)| goes(made.by) && !names.contains(&name.as_str()));
        listed.filter(|(name, _)| self.is_unchanged(name)).map(|(name, _)| name.clone()).collect()
    }

    /// Whether a file that the marker lists is unchanged and is in the folder or a subfolder, not behind a
    /// symbolic link.
    fn is_unchanged(&self, name: &str) -> bool {
        let path = self.folder.join(name);
        let inside = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
        let linked = path.ancestors().take_while(|path| *path != self.folder).any(Path::is_symlink);
        let is_file = fs::symlink_metadata(&path).is_ok_and(|found| found.is_file());
        let is_own = |found: String| self.marker.maker_if_unchanged(name, &found).is_some();
        inside && !linked && is_file && hash_file(&path).is_ok_and(|found| found.is_some_and(is_own))
    }

    /// Protects a measured recording from being overwritten, except by a new import of the same exported
    /// files, which loses nothing.
    fn protect_recording(&self, names: &[&str]) -> Outcome<()> {
        let FolderRecording::Measured { why, exports, files } =
            FolderRecording::detect(&self.folder, &self.marker)?
        else {
            return Ok(());
        };
        let maker = self.writer.maker;
        let taken = names.iter().find(|name| files.iter().any(|file| file.eq_ignore_ascii_case(name)));
        let advice = match (maker, taken) {
            (OutputCommand::Import, _) if have_same_exports(&self.writer.exports, &exports) => {
                if self.writer.force {
                    return Ok(());
                }
                "choose another --out, or add --force to import the same exports again"
            }
            (OutputCommand::Import, _) => {
                "choose another --out, or move the folder away; --force replaces it only by an import of the same exports"
            }
            (maker, Some(_)) if !maker.makes_recordings() => {
                "choose another --out; --force does not replace it"
            }
            (maker, _) if maker.makes_recordings() => {
                "choose another --out, or move the folder away; --force does not replace it"
            }
            _ => return Ok(()),
        };
        let name = taken.filter(|name| self.folder.join(name).exists()).map_or(TRACE_FILE, |name| name);
        Err(other_recording_failure(&self.folder.join(name), &why, advice))
    }

    /// Refuses to write a trace into a folder whose description belongs to another recording.
    fn refuse_contradiction(&self, names: &[&str]) -> Outcome<()> {
        let other = match self.writer.maker {
            OutputCommand::Simulate => Some(DESCRIPTION_FILE).filter(|name| self.folder.join(name).exists()),
            OutputCommand::Import | OutputCommand::Twin => {
                Some(SIMULATION_SUMMARY).filter(|name| is_simulation_summary(&self.folder.join(name)))
            }
            _ => None,
        };
        let Some(other) = other.filter(|name| !names.contains(name)) else { return Ok(()) };
        if self.writer.force && self.is_unchanged(other) {
            return Ok(());
        }
        let advice = if self.is_unchanged(other) {
            "choose another --out, or replace that recording with --force"
        } else {
            "choose another --out, or move the folder away"
        };
        Err(Failure::Input(format!(
            "{}: found the description of another recording, expected none next to what `wiperlab {}` writes; {advice}",
            self.folder.join(other).display(),
            self.writer.maker.command_name()
        )))
    }
}

/// Whether two imports read the same exported files, in any order.
fn have_same_exports(some: &[String], others: &[String]) -> bool {
    let sorted = |hashes: &[String]| {
        let mut hashes = hashes.to_vec();
        hashes.sort();
        hashes
    };
    !some.is_empty() && sorted(some) == sorted(others)
}
