use super::*;
use crate::cli::files::marker::hash_file;
use crate::cli::files::marker::{OutputCommand, Overwrite};
use std::time::SystemTime;
use tempfile::TempDir;

/// Writes files whose contents are their names.
fn placed(folder: &Path, names: &[&str]) -> Outcome<()> {
    let files: Vec<(&str, &str)> = names.iter().map(|name| (*name, *name)).collect();
    staged(folder, OutputCommand::Spectrum, &files)?.commit()
}

fn staged(folder: &Path, maker: OutputCommand, files: &[(&str, &str)]) -> Outcome<OutputStaging> {
    let names: Vec<&str> = files.iter().map(|(name, _)| *name).collect();
    let mut staging = OutputStaging::new(folder, &WritePolicy::new(maker, Overwrite::default()), &names)?;
    for (name, text) in files {
        staging.stage_file(name, text.as_bytes())?;
    }
    Ok(staging)
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn text(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).unwrap()
}

/// Simulates a program that is killed after it has renamed `renamed` of its files.
fn killed(staging: OutputStaging, renamed: usize) {
    let (guard, writer) = staging.guard.as_ref().unwrap();
    MarkerUpdate::new(&staging.folder, guard, writer, &staging.files).unwrap().write_pending().unwrap();
    rename_staged(staging.files.into_iter().take(renamed).collect()).unwrap();
}

const OLD: [(&str, &str); 3] = [("a", "old a"), ("b", "old b"), ("gone", "old")];
const NEW: [(&str, &str); 3] = [("a", "new a"), ("b", "new b"), ("c", "new c")];

#[test]
fn a_command_that_was_killed_between_two_names_goes_on_without_force() {
    for renamed in 0..=NEW.len() {
        let folder = TempDir::new().unwrap();
        let at = folder.path();
        staged(at, OutputCommand::Sweep, &OLD).unwrap().commit().unwrap();
        killed(staged(at, OutputCommand::Sweep, &NEW).unwrap(), renamed);
        for (i, ((name, new), (_, old))) in NEW.iter().zip(OLD).enumerate().take(2) {
            assert_eq!(text(at, name), if i < renamed { *new } else { old }, "old or new, and whole");
        }
        staged(at, OutputCommand::Sweep, &NEW).unwrap().commit().unwrap();
        assert_eq!(names(at), [MARKER_FILE, "a", "b", "c"], "what the earlier run alone made is gone");
        let (marker, _) = FolderMarker::load(at).unwrap();
        assert!(marker.files.values().all(|made| made.replaces.is_none()) && marker.files.len() == 3);
    }
}

#[test]
fn what_a_killed_command_left_is_no_licence_for_others() {
    let folder = TempDir::new().unwrap();
    let at = folder.path();
    staged(at, OutputCommand::Sweep, &OLD).unwrap().commit().unwrap();
    killed(staged(at, OutputCommand::Sweep, &NEW).unwrap(), 1);
    fs::write(at.join("b"), "mine").unwrap();
    let refused = staged(at, OutputCommand::Sweep, &NEW).unwrap().commit().unwrap_err().to_string();
    assert!(
        refused.contains("/b: found a file that was changed since `wiperlab sweep` made it"),
        "{refused}"
    );
    let refused = staged(at, OutputCommand::Fit, &[("a", "x")]).unwrap().commit().unwrap_err().to_string();
    assert!(refused.contains("/a: found a file that `wiperlab sweep` made, expected"), "{refused}");
    assert_eq!((text(at, "a"), text(at, "b")), ("new a".to_owned(), "mine".to_owned()));
}

#[test]
fn a_loss_of_power_leaves_every_file_old_or_new_and_a_torn_marker_proves_nothing() {
    let folder = TempDir::new().unwrap();
    let at = folder.path();
    staged(at, OutputCommand::Sweep, &OLD).unwrap().commit().unwrap();
    // power fails before any renaming: the temporary files may be damaged, but none of them is an output
    let staging = staged(at, OutputCommand::Sweep, &NEW).unwrap();
    for (i, staged) in staging.files.iter().enumerate() {
        let file = File::options().write(true).open(staged.file.path()).unwrap();
        if i % 2 == 0 { file.set_len(2).unwrap() } else { fs::write(staged.file.path(), [0; 5]).unwrap() }
    }
    assert_eq!(
        (text(at, "a"), text(at, "b"), text(at, "gone")),
        ("old a".into(), "old b".into(), "old".into())
    );
    drop(staging);
    assert_eq!(names(at), [MARKER_FILE, "a", "b", "gone"]);
    // the marker is replaced as a whole; but even if it were cut short or filled with zeros, the program
    // would only require `--force`
    let whole = fs::read(at.join(MARKER_FILE)).unwrap();
    for torn in [&whole[..whole.len() / 2], &vec![0; whole.len()], b""] {
        fs::write(at.join(MARKER_FILE), torn).unwrap();
        let refused = staged(at, OutputCommand::Sweep, &NEW).unwrap().commit().unwrap_err().to_string();
        assert!(
            refused.contains("a file that no wiperlab command is known to have made (")
                && refused.contains("cannot be read"),
            "{refused}"
        );
    }
    fs::write(at.join(MARKER_FILE), &whole).unwrap();
    // an output whose last block was lost after the renaming is detected
    fs::write(at.join("a"), "old").unwrap();
    assert!(staged(at, OutputCommand::Sweep, &NEW).unwrap().commit().is_err());
}

#[test]
fn the_same_outputs_have_the_same_marker() {
    let (one, other) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    placed(one.path(), &["a", "paper/b"]).unwrap();
    placed(other.path(), &["a"]).unwrap();
    placed(other.path(), &["paper/b", "a"]).unwrap();
    assert_eq!(text(one.path(), MARKER_FILE), text(other.path(), MARKER_FILE));
    let (marker, _) = FolderMarker::load(one.path()).unwrap();
    assert_eq!(hash_file(&one.path().join("a")).unwrap().unwrap(), marker.files["a"].sha256);
}

#[test]
fn a_marker_leads_out_of_no_folder() {
    let folder = TempDir::new().unwrap();
    let at = folder.path().join("out");
    fs::write(folder.path().join("mine"), "a").unwrap();
    placed(&at, &["a"]).unwrap();
    let listing_others = text(&at, MARKER_FILE).replace("\"a\":", "\"../mine\":");
    fs::write(at.join(MARKER_FILE), listing_others).unwrap();
    fs::remove_file(at.join("a")).unwrap();
    placed(&at, &["b"]).unwrap();
    assert_eq!(text(folder.path(), "mine"), "a");
}

#[test]
fn what_a_killed_program_left_goes_and_what_others_hold_or_wrote_stays() {
    let folder = TempDir::new().unwrap();
    let old = SystemTime::now() - 2 * ABANDONED_AFTER;
    let left = |name: &str, modified: SystemTime| {
        let file = File::create(folder.path().join(name)).unwrap();
        file.set_modified(modified).unwrap();
        file
    };
    left(".wiperlab-left.tmp", old);
    left(".wiperlab-young.tmp", SystemTime::now());
    left(".tmpofanother", old);
    left("mine.tmp", old);
    let held = left(".wiperlab-held.tmp", old);
    held.lock().unwrap();
    placed(folder.path(), &["a"]).unwrap();
    assert_eq!(
        names(folder.path()),
        [".tmpofanother", ".wiperlab-held.tmp", ".wiperlab-young.tmp", MARKER_FILE, "a", "mine.tmp"]
    );
}

#[test]
fn a_file_on_its_way_is_held() {
    let folder = TempDir::new().unwrap();
    let (file, _) = write_temporary(&folder.path().join("a"), &b"a"[..], None).unwrap();
    file.as_file().set_modified(SystemTime::now() - 2 * ABANDONED_AFTER).unwrap();
    assert!(!is_abandoned(file.path()));
    assert!(
        names(folder.path())
            .iter()
            .all(|name| name.starts_with(TEMPORARY_NAME.0) && name.ends_with(TEMPORARY_NAME.1))
    );
}

#[test]
fn a_place_that_is_taken_is_refused_before_anything_is_written() {
    let folder = TempDir::new().unwrap();
    fs::create_dir(folder.path().join("z")).unwrap();
    let refused = placed(folder.path(), &["a", "paper/b", "z"]).unwrap_err();
    assert!(
        matches!(&refused, Failure::Input(words) if words.contains("/z: is a folder, expected a file or nothing")),
        "{refused}"
    );
    File::create(folder.path().join("paper")).unwrap();
    let refused = placed(folder.path(), &["a", "paper/b"]).unwrap_err();
    assert!(
        matches!(&refused, Failure::Input(words) if words.contains("/paper: is a file, expected a folder or nothing")),
        "{refused}"
    );
    assert_eq!(names(folder.path()), ["paper", "z"]);
}

#[test]
fn a_write_that_fails_leaves_what_was_there_and_no_folder_made_in_vain() {
    struct Broken;
    impl Read for Broken {
        fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
            Err(io::Error::other("no space left"))
        }
    }
    let folder = TempDir::new().unwrap();
    let writer = WritePolicy::new(OutputCommand::Spectrum, Overwrite::default());
    for at in [folder.path().join("deep/er"), folder.path().join("known")] {
        if at.ends_with("known") {
            placed(&at, &["a"]).unwrap();
        }
        let before = (at.exists().then(|| (names(&at), text(&at, "a"), text(&at, MARKER_FILE))),);
        let mut staging = OutputStaging::new(&at, &writer, &["a", "paper/b"]).unwrap();
        staging.stage_file("a", &b"other"[..]).unwrap();
        let failed = staging.stage_file("paper/b", io::Read::chain(&b"half"[..], Broken)).unwrap_err();
        assert!(
            matches!(&failed, Failure::Internal(words) if words.contains("paper/b: cannot be written: no space left")),
            "{failed}"
        );
        drop(staging);
        assert_eq!((at.exists().then(|| (names(&at), text(&at, "a"), text(&at, MARKER_FILE))),), before);
    }
    assert_eq!(names(folder.path()), ["known"]);
}
