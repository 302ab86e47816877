//! Shards of a study in its folder: `DIR/shards/K-of-N.jsonl`, each written by one program, and which study
//! they are of.

use super::problem::Problem;
use super::solve::Part;
use crate::failure::{Failure, Outcome};
use crate::files;
use crate::global::Global;
use serde::{Deserialize, Serialize};
use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Component, Path, PathBuf};
use wiperlab::journal::{JournalError, Stream};
use wiperlab::sweep::Shard;
use wiperlab::sweep::journal::Point;

/// Folder of the shards in that of the study.
pub const SHARDS: &str = "shards";
/// Which study they are of.
const NOTE: &str = "study.json";

/// What the note says.
#[derive(Serialize, Deserialize)]
struct Note {
    /// Path of the study from the folder of the results, with `/`; absolute where there is no such way.
    study: String,
}

impl Problem {
    /// Runs what no shard in the folder holds of a shard.
    pub fn solve_shard(
        &self,
        study: &Path,
        out: &Path,
        shard: Shard,
        global: &Global,
    ) -> Result<Outcome, Failure> {
        let folder = out.join(SHARDS);
        let journal = folder.join(shard.name() + ".jsonl");
        files::check_free(&journal)?;
        let elsewhere = self.elsewhere(out, &journal)?;
        note(study, out)?;
        let part = Part {
            shard,
            resume: journal.exists(),
            journal: &journal,
            elsewhere,
            advice: "the same command goes on".to_owned(),
            reports: true,
        };
        if !self.solve_part(&part, global)? {
            return Ok(Outcome::StoppedEarly);
        }
        if !global.quiet {
            let count = shard.count(self.study.points());
            print_line!("shard {shard}: its {count} points are done, see {}", journal.display());
            print_line!("when every shard is: wiperlab collect {}", out.display());
        }
        Ok(Outcome::Done)
    }

    /// Which points the other shards hold: they need not be done again when a study is divided anew. A shard
    /// that is damaged is left to `collect`, and one of another study is refused.
    fn elsewhere(&self, out: &Path, own: &Path) -> Result<Vec<bool>, Failure> {
        let header = self.header();
        let mut held = vec![false; self.study.points()];
        for (_, path) in shard_files(out)?.into_iter().filter(|(_, path)| path != own) {
            let name = path.display().to_string();
            let Ok(file) = File::open(&path) else { continue };
            match note_held(&name, BufReader::new(file), &header, &mut held) {
                Err(refused @ (JournalError::OtherProblem { .. } | JournalError::OtherVersion { .. })) => {
                    return Err(Failure::input(refused));
                }
                Err(damaged) => warn_line!("warning: {damaged}"),
                Ok(()) => {}
            }
        }
        Ok(held)
    }
}

fn note_held(
    name: &str,
    from: BufReader<File>,
    header: &wiperlab::sweep::journal::Header,
    held: &mut [bool],
) -> Result<(), JournalError> {
    let Some(mut journal) = Stream::<Point, _>::open(name, from)? else { return Ok(()) };
    journal.header().check::<Point>(name, header)?;
    while let Some(found) = journal.record()? {
        if let Some(held) = held.get_mut(found.record.index) {
            *held = true;
        }
    }
    Ok(())
}

/// The shards in the folder of a study, by number of shards and number.
pub fn shard_files(out: &Path) -> Result<Vec<(Shard, PathBuf)>, Failure> {
    let folder = out.join(SHARDS);
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let unread = |error| Failure::Input(format!("{}: cannot be read: {error}", folder.display()));
    let mut shards = Vec::new();
    for entry in fs::read_dir(&folder).map_err(unread)? {
        let name = entry.map_err(unread)?.file_name();
        let shard = name.to_str().and_then(|name| name.strip_suffix(".jsonl")).and_then(Shard::named);
        shards.extend(shard.map(|shard| (shard, folder.join(&name))));
    }
    shards.sort_by_key(|(shard, _)| (shard.of(), shard.at()));
    Ok(shards)
}

/// Says which study the shards are of, for whoever collects them.
fn note(study: &Path, out: &Path) -> Result<(), Failure> {
    let folder = out.join(SHARDS);
    let made = |error| Failure::Internal(format!("{}: cannot be made: {error}", folder.display()));
    fs::create_dir_all(&folder).map_err(made)?;
    let absolute = |path: &Path| {
        path.canonicalize()
            .map_err(|error| Failure::Input(format!("{}: cannot be found: {error}", path.display())))
    };
    let study = way(&absolute(out)?, &absolute(study)?);
    let note = serde_json::to_string(&Note { study }).map_err(Failure::internal)? + "\n";
    if fs::read_to_string(folder.join(NOTE)).is_ok_and(|found| found == note) {
        return Ok(());
    }
    files::write_all(&folder, &[(NOTE, note.into_bytes())])
}

/// The study whose shards are in a folder.
pub fn study_of(out: &Path) -> Result<PathBuf, Failure> {
    let path = out.join(SHARDS).join(NOTE);
    let refused = |found: String| {
        Failure::Input(format!(
            "{}: {found}, expected the note that `wiperlab sweep --shard` writes; name the study with --study",
            path.display()
        ))
    };
    if !path.exists() {
        return Err(refused("found no such file".to_owned()));
    }
    let note: Note = serde_json::from_str(&files::read_json(&path)?)
        .map_err(|error| refused(format!("cannot be read: {error}")))?;
    let study = out.join(note.study);
    Ok(study.canonicalize().unwrap_or(study))
}

/// The way from a folder to a file, both absolute: a folder that several machines share may have another
/// place on each.
fn way(from: &Path, to: &Path) -> String {
    let common = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    if !from.components().take(common).any(|part| matches!(part, Component::Normal(_))) {
        return to.to_string_lossy().into_owned();
    }
    let up = from.components().skip(common).map(|_| "..".to_owned());
    let down = to.components().skip(common).map(|part| part.as_os_str().to_string_lossy().into_owned());
    up.chain(down).collect::<Vec<_>>().join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_to_a_study_holds_where_both_are_moved_together() {
        let of = |from: &str, to: &str| way(Path::new(from), Path::new(to));
        assert_eq!(of("/share/a/out", "/share/a/study.toml"), "../study.toml");
        assert_eq!(of("/share/a/out/x", "/share/b/study.toml"), "../../../b/study.toml");
        assert_eq!(of("/share/a", "/share/a/study.toml"), "study.toml");
        assert_eq!(of("/share/a", "/home/study.toml"), "/home/study.toml");
    }
}
