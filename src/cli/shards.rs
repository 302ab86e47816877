//! Shards on the disk: `FOLDER/shards/K-of-N.jsonl` next to the results of a study; each shard is written by
//! one program.

use super::prelude::*;
use crate::checkpoint::{
    CheckpointError, CheckpointHeader, CheckpointReader, CheckpointRecord, Shard, StoredRecord,
};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufReader;

/// Name of the folder of the shards within the folder of the results.
pub(crate) const SHARDS_FOLDER: &str = "shards";

/// Path of the journal of a shard.
pub(crate) fn shard_checkpoint(folder: &Path, shard: Shard) -> PathBuf {
    folder.join(SHARDS_FOLDER).join(shard.file_stem() + ".jsonl")
}

/// The shards in a folder of results, sorted first by the total number of shards (N), then by the number of
/// the shard (K).
pub(crate) fn shard_files(folder: &Path) -> Outcome<Vec<(Shard, PathBuf)>> {
    let folder = folder.join(SHARDS_FOLDER);
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let unread = |error| Failure::at(folder.display(), format!("cannot be read: {error}"));
    let mut shards = Vec::new();
    for entry in fs::read_dir(&folder).map_err(unread)? {
        let name = entry.map_err(unread)?.file_name();
        let shard =
            name.to_str().and_then(|name| name.strip_suffix(".jsonl")).and_then(Shard::from_file_stem);
        shards.extend(shard.map(|shard| (shard, folder.join(&name))));
    }
    shards.sort_by_key(|(shard, _)| (shard.total(), shard.number()));
    Ok(shards)
}

/// Reads the journal of another shard. If `wanted`, calls `each` with every record. A journal of another
/// problem or program version is refused; a damaged one only causes a warning, since `wiperlab collect`
/// reports the damage.
pub(crate) fn scan_shard<R: CheckpointRecord>(
    path: &Path,
    header: &CheckpointHeader<R::Body>,
    wanted: bool,
    mut each: impl FnMut(StoredRecord<R>),
) -> Outcome<()> {
    let name = path.display().to_string();
    let Ok(file) = File::open(path) else { return Ok(()) };
    let look = || -> Result<(), CheckpointError> {
        let Some(mut journal) = CheckpointReader::<R, _>::open(&name, BufReader::new(file))? else {
            return Ok(());
        };
        journal.header().check_matches::<R>(&name, header)?;
        while wanted && let Some(found) = journal.next_record()? {
            each(found);
        }
        Ok(())
    };
    match look() {
        Err(refused @ (CheckpointError::OtherProblem { .. } | CheckpointError::OtherVersion { .. })) => {
            Err(Failure::input(refused))
        }
        Err(damaged) => {
            warn_line!("warning: {damaged}");
            Ok(())
        }
        Ok(()) => Ok(()),
    }
}

/// The total number of shards (N) that occurs most often in the names of the files. If two totals occur
/// equally often, the larger one.
pub(crate) fn usual_shard_count(shards: &[(Shard, PathBuf)]) -> usize {
    let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
    shards.iter().for_each(|(shard, _)| *counts.entry(shard.total()).or_default() += 1);
    counts.into_iter().max_by_key(|(of, files)| (*files, *of)).map_or(1, |(of, _)| of)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_usual_number_of_shards_is_that_of_most_files() {
        let shards = |list: &[(usize, usize)]| -> Vec<(Shard, PathBuf)> {
            list.iter().map(|(at, of)| (Shard::new(*at, *of).unwrap(), PathBuf::new())).collect()
        };
        assert_eq!(usual_shard_count(&shards(&[(0, 4), (1, 4), (0, 7)])), 4);
        assert_eq!(usual_shard_count(&shards(&[(0, 4), (0, 7)])), 7);
    }
}
