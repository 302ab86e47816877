//! Chooses the tracks of the lip tip and of the head, by `--point` or by their names.

use crate::import::error::{ImportError, ImportResult};
use crate::import::options::ImportOptions;
use crate::import::reader::track_file::TrackFile;
use crate::recording::quality::{Check, QualityFinding, Severity};
use crate::toml_file::suggest_key;
use std::collections::HashMap;

/// Maximum number of track names in an error message; a file of detections has thousands of tracks.
const MOST_NAMES: usize = 30;

/// Index of the file that contains a track, and index of the track in that file.
pub(crate) type TrackIndex = (usize, usize);

/// Adds `#1`, `#2`, ... to the names of tracks of one file that have the same name, so that each can be
/// chosen. Every such name gives a finding.
pub(crate) fn number_repeated_names(exports: &mut [TrackFile]) {
    for export in exports {
        let mut count: HashMap<String, usize> = HashMap::new();
        for track in &export.tracks {
            *count.entry(track.name.clone()).or_default() += 1;
        }
        let mut numbers: HashMap<String, usize> = HashMap::new();
        let mut repeated: Vec<String> = vec![];
        for track in export.tracks.iter_mut().filter(|track| count.get(&track.name).is_some_and(|n| *n > 1)) {
            let number = numbers.entry(track.name.clone()).or_default();
            *number += 1;
            if *number == 1 {
                repeated.push(track.name.clone());
            }
            track.name = format!("{}#{number}", track.name);
        }
        export.findings.extend(repeated.iter().map(|name| {
            let times = count.get(name).copied().unwrap_or_default();
            let found = format!(
                "{}: {times} tracks are called `{name}`: here they are `{name}#1` to `{name}#{times}`",
                export.file
            );
            let advice = "choose one with --point, or give each track a name of its own and export again";
            QualityFinding::advise((Check::TrackNames, Severity::Caution), (times as f64, ""), found, advice)
        }));
    }
}

/// Chooses the tracks of tip and head: those that `--point` names, or else those called `tip` and `head`.
pub(crate) fn choose_tracks(
    exports: &[TrackFile],
    options: &ImportOptions,
) -> ImportResult<[Option<TrackIndex>; 2]> {
    let named = [("tip", &options.tip), ("head", &options.head)];
    if named.iter().all(|(_, name)| name.is_none()) {
        return choose_by_default(exports);
    }
    let find_named = |(point, name): (&'static str, &Option<String>)| {
        name.as_deref().map(|name| find_track(exports, point, name)).transpose()
    };
    let [tip, head] = named;
    let chosen = [find_named(tip)?, find_named(head)?];
    if chosen[0].is_some() && chosen[0] == chosen[1] {
        let (found, expected) = (options.head.clone().unwrap_or_default(), "another track than for the tip");
        return Err(ImportError::point("head", found, expected, list_tracks(exports)));
    }
    let [tip, head] = chosen;
    // (if several tracks are called `point`, none of them is chosen)
    let only =
        |point: &str| Some(tracks_called(exports, point)).filter(|found| found.len() == 1)?.first().copied();
    let left = |point, other: Option<TrackIndex>| only(point).filter(|track| Some(*track) != other);
    Ok([tip.or_else(|| left("tip", head)), head.or_else(|| left("head", tip))])
}

/// Tracks called `name`; if there are none, those whose name differs from it only in case.
fn tracks_called(exports: &[TrackFile], name: &str) -> Vec<TrackIndex> {
    let exact = matching_tracks(exports, |_, track| track == name);
    if !exact.is_empty() {
        return exact;
    }
    matching_tracks(exports, |_, track| track.eq_ignore_ascii_case(name))
}

/// Chooses the tracks called `tip` and `head`; used if no `--point` is given.
fn choose_by_default(exports: &[TrackFile]) -> ImportResult<[Option<TrackIndex>; 2]> {
    let [tip, head] = [tracks_called(exports, "tip"), tracks_called(exports, "head")];
    if tip.len() > 1 || head.len() > 1 || (tip.is_empty() && head.is_empty()) {
        let expected = "--point tip=NAME and --point head=NAME, or tracks called tip and head";
        let found = "no track named for it".to_owned();
        return Err(ImportError::point("tip", found, expected, list_tracks(exports)));
    }
    Ok([tip.first().copied(), head.first().copied()])
}

/// Finds a track by its name, by `FILE:NAME`, or by `FILE` if the file contains only one track.
fn find_track(exports: &[TrackFile], point: &'static str, name: &str) -> ImportResult<TrackIndex> {
    let file_is = |export: &TrackFile, file: &str| {
        export.file == file || export.file_name() == file || export.stem == file
    };
    let by_name = matching_tracks(exports, |_, track| track == name);
    let by_both = matching_tracks(exports, |export, track| {
        let file = name.strip_suffix(track).and_then(|file| file.strip_suffix(':'));
        file.is_some_and(|file| file_is(export, file))
    });
    let by_file = matching_tracks(exports, |export, _| export.tracks.len() == 1 && file_is(export, name));
    let found = [by_name, by_both, by_file].into_iter().find(|found| !found.is_empty()).unwrap_or_default();
    match found.as_slice() {
        [one] => Ok(*one),
        [] => {
            let names: Vec<&str> =
                exports.iter().flat_map(|export| export.tracks.iter().map(|t| t.name.as_str())).collect();
            let advice = suggest_track(name, &names) + &list_tracks(exports);
            Err(ImportError::point(point, format!("`{name}`"), "the name of a track", advice))
        }
        _ => {
            let found = format!("`{name}` {} times", found.len());
            Err(ImportError::point(point, found, "one track; write FILE:NAME", list_tracks(exports)))
        }
    }
}

fn matching_tracks(exports: &[TrackFile], accept: impl Fn(&TrackFile, &str) -> bool) -> Vec<TrackIndex> {
    let all = exports.iter().enumerate().flat_map(|(file, export)| {
        export.tracks.iter().enumerate().map(move |(track, t)| (file, track, export, t))
    });
    let accepted = all.filter(|(_, _, export, track)| accept(export, &track.name));
    accepted.map(|(file, track, _, _)| (file, track)).collect()
}

/// The question `did you mean ...?` with the most similar of `names`, followed by a blank; empty if no name
/// is similar to `name`.
fn suggest_track(name: &str, names: &[&str]) -> String {
    let suggestion = suggest_key(name, names);
    if suggestion.starts_with("did") { suggestion + " " } else { String::new() }
}

/// Advice for a point (`tip` or `head`) for which no track was found; `None` if no other track remains.
pub(crate) fn unchosen_advice(
    exports: &[TrackFile],
    chosen: &[Option<TrackIndex>; 2],
    point: &str,
) -> Option<String> {
    let free: Vec<&str> = matching_tracks(exports, |_, _| true)
        .into_iter()
        .filter(|track| !chosen.contains(&Some(*track)))
        .map(|(file, track)| exports[file].tracks[track].name.as_str())
        .collect();
    let hint = suggest_track(point, &free);
    (!free.is_empty()).then(|| format!("{hint}{}: name it with --point {point}=NAME", list_tracks(exports)))
}

/// Text that lists the names of all tracks, each with its file if there are several files.
fn list_tracks(exports: &[TrackFile]) -> String {
    let full = |export: &TrackFile, name: &str| {
        if exports.len() > 1 { format!("{}:{name}", export.file_name()) } else { name.to_owned() }
    };
    let names: Vec<String> = exports
        .iter()
        .flat_map(|export| export.tracks.iter().map(|track| full(export, &track.name)))
        .collect();
    let shown = names[..names.len().min(MOST_NAMES)].join(", ");
    let left_out = names.len().saturating_sub(MOST_NAMES);
    let more = if left_out > 0 { format!(" and {left_out} more") } else { String::new() };
    format!("tracks found: {shown}{more}")
}
