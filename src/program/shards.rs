//! Shards on disk: `FOLDER/shards/K-of-N.jsonl` next to the results of a study, each written by one program.

use crate::journal::{Found, Header, JournalError, Record, Shard, Stream};
use crate::program::failure::Failure;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// Folder of the shards in that of the results.
pub const SHARDS: &str = "shards";

/// Journal of a shard.
pub fn journal_of(folder: &Path, shard: Shard) -> PathBuf {
    folder.join(SHARDS).join(shard.name() + ".jsonl")
}

/// The shards in a folder of results, by number of shards and number.
pub fn shard_files(folder: &Path) -> Result<Vec<(Shard, PathBuf)>, Failure> {
    let folder = folder.join(SHARDS);
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

/// Shows `each` what another shard has written, where that is `wanted`; one of another problem or version is
/// refused, and one that is damaged is left to `wiperlab collect`.
pub fn look_into<R: Record>(
    path: &Path,
    header: &Header<R::Body>,
    wanted: bool,
    mut each: impl FnMut(Found<R>),
) -> Result<(), Failure> {
    let name = path.display().to_string();
    let Ok(file) = File::open(path) else { return Ok(()) };
    let look = || -> Result<(), JournalError> {
        let Some(mut journal) = Stream::<R, _>::open(&name, BufReader::new(file))? else { return Ok(()) };
        journal.header().check::<R>(&name, header)?;
        while wanted && let Some(found) = journal.record()? {
            each(found);
        }
        Ok(())
    };
    match look() {
        Err(refused @ (JournalError::OtherProblem { .. } | JournalError::OtherVersion { .. })) => {
            Err(Failure::input(refused))
        }
        Err(damaged) => {
            warn_line!("warning: {damaged}");
            Ok(())
        }
        Ok(()) => Ok(()),
    }
}

/// The number of shards of most files; of two, the larger.
pub fn usual(shards: &[(Shard, PathBuf)]) -> usize {
    let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
    shards.iter().for_each(|(shard, _)| *counts.entry(shard.of()).or_default() += 1);
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
        assert_eq!(usual(&shards(&[(0, 4), (1, 4), (0, 7)])), 4);
        assert_eq!(usual(&shards(&[(0, 4), (0, 7)])), 7);
    }
}
