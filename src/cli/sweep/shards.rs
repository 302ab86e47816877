//! Runs a shard of a study, and writes the note that names the study to which the shards in a folder belong.

use super::LoadedStudy;
use super::solve::StudyPart;
use crate::checkpoint::Shard;
use crate::cli::prelude::*;
use crate::cli::shards::{SHARDS_FOLDER, scan_shard, shard_checkpoint, shard_files};
use crate::sweep::journal::SweepPoint;
use serde::{Deserialize, Serialize};
use std::fs;

/// File name of the note that names the study.
const NOTE: &str = "study.json";

/// Contents of the note that names the study to which the shards in a folder belong.
#[derive(Serialize, Deserialize)]
struct StudyNote {
    /// Path of the study, relative to the folder of the note.
    study: String,
}

impl LoadedStudy {
    /// Runs those points of a shard that no shard in the folder contains yet.
    pub(crate) fn solve_shard(&self, study: &Path, out: &Path, shard: Shard, global: &GlobalArgs) -> Outcome {
        let journal = shard_checkpoint(out, shard);
        files::check_path_free(&journal)?;
        let elsewhere = self.points_in_other_shards(out, shard)?;
        write_study_note(study, out)?;
        let part = StudyPart {
            shard,
            resume: journal.exists(),
            journal: &journal,
            elsewhere,
            advice: "the same command goes on",
            reports: true,
        };
        if !self.solve_part(&part, global)? {
            return Ok(CommandOutcome::StoppedEarly);
        }
        if !global.quiet {
            let count = shard.count_points(self.study.point_count());
            print_line!("shard {shard}: its {count} points are done, see {}", journal.display());
            print_line!("when every shard is: wiperlab collect {}", out.display());
        }
        Ok(CommandOutcome::Done)
    }

    /// For each point, whether a shard other than `own` contains it. Such a point is not computed again when
    /// a study is divided into another number of shards.
    fn points_in_other_shards(&self, out: &Path, own: Shard) -> Outcome<Vec<bool>> {
        let header = self.header();
        let mut held = vec![false; self.study.point_count()];
        for (shard, path) in shard_files(out)?.into_iter().filter(|(shard, _)| *shard != own) {
            scan_shard::<SweepPoint>(&path, &header, shard.overlaps(own), |found| {
                if let Some(held) = held.get_mut(found.record.index) {
                    *held = true;
                }
            })?;
        }
        Ok(held)
    }
}

/// Writes the note that names the study to which the shards belong.
fn write_study_note(study: &Path, out: &Path) -> Outcome<()> {
    let folder = out.join(SHARDS_FOLDER);
    let made = |error| Failure::Internal(format!("{}: cannot be made: {error}", folder.display()));
    fs::create_dir_all(&folder).map_err(made)?;
    // the path is relative, since a shared folder may have a different path on each machine
    let study = files::relative_path(&folder, study)?;
    let note = serde_json::to_string(&StudyNote { study }).map_err(Failure::internal)? + "\n";
    if fs::read_to_string(folder.join(NOTE)).is_ok_and(|found| found == note) {
        return Ok(());
    }
    files::write_unmarked(&folder, &[(NOTE, note.into_bytes())])
}

/// The study to which the shards in a folder belong.
pub(crate) fn find_study(out: &Path) -> Outcome<PathBuf> {
    let path = out.join(SHARDS_FOLDER).join(NOTE);
    let refused = |found: String| {
        Failure::at(
            path.display(),
            format!(
                "{found}, expected the note that `wiperlab sweep --shard` writes; name the study with --study"
            ),
        )
    };
    if !path.exists() {
        return Err(refused("found no such file".to_owned()));
    }
    let note: StudyNote = serde_json::from_str(&files::read_json(&path)?)
        .map_err(|error| refused(format!("cannot be read: {error}")))?;
    let study = files::resolve_path(&path, &note.study);
    Ok(study.canonicalize().unwrap_or(study))
}
