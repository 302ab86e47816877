//! What must hold of every file that the program reads besides tracking exports: it is refused with a
//! message, or what was read can be used, and written and read back it is the same.

use wiperlab::checkpoint::{
    CheckpointFile, CheckpointRecord, append_checksum, format_header_line, format_record_line,
    read_checkpoint,
};
use wiperlab::fit::checkpoint::FitRecord;
use wiperlab::fit::job::Job;
use wiperlab::fit::result::FitResult;
use wiperlab::recording::files::{RecordingFile, read_recording, trace_csv};
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::twin::spec::TwinSpec;
use wiperlab::sweep::Study;
use wiperlab::sweep::journal::SweepPoint;

/// A reader, and the committed files, from the root of the project, from which its inputs grow.
pub struct Reader {
    /// Name on the command line.
    pub name: &'static str,
    /// Committed files of this kind.
    pub seeds: &'static [&'static str],
    /// Reads a text; panics where something does not hold.
    pub check: fn(&str),
}

/// Every reader of files that people write or that the program wrote.
pub const READERS: [Reader; 8] = [
    Reader {
        name: "scene",
        seeds: &[
            "data/scenes/actual-blade.toml",
            "data/scenes/light-blade-strokes.toml",
            "data/scenes/light-blade.toml",
        ],
        check: scene,
    },
    Reader {
        name: "job",
        seeds: &["fits/actual-blade-twin/job.toml", "fits/published-experiment/job.toml"],
        check: job,
    },
    Reader {
        name: "study",
        seeds: &["data/sweeps/flip.toml", "data/sweeps/friction.toml", "data/sweeps/speed-preload.toml"],
        check: study,
    },
    Reader { name: "twin", seeds: &["data/twins/actual-blade.toml"], check: twin },
    Reader { name: "recording", seeds: &["data/actual-blade-twin/recording.toml"], check: recording },
    Reader { name: "trace", seeds: &["fuzz/seeds/trace.csv"], check: trace },
    Reader {
        name: "journal",
        seeds: &["fuzz/seeds/journal-of-a-fit.jsonl", "fuzz/seeds/journal-of-a-study.jsonl"],
        check: journals,
    },
    Reader {
        name: "result",
        seeds: &["fits/actual-blade-twin/result.json", "fits/published-experiment/result.json"],
        check: result,
    },
];

fn scene(text: &str) {
    if let Ok(scene) = Scene::parse("scene.toml", text) {
        let _ = scene.title();
        assert!(scene.start_s < scene.run.stop_s);
    }
}

fn job(text: &str) {
    if let Ok(job) = Job::parse("job.toml", text) {
        assert!(!job.parameters.is_empty() && !job.targets.is_empty());
    }
}

fn study(text: &str) {
    if let Ok(study) = Study::parse("sweep.toml", text) {
        assert!(study.point_count() > 0 && !study.maps.is_empty());
    }
}

fn twin(text: &str) {
    if let Ok(spec) = TwinSpec::parse("twin.toml", text) {
        assert!(spec.camera.frame_rate_hz > 0.0);
    }
}

fn recording(text: &str) {
    if let Ok(file) = RecordingFile::parse("recording.toml", text) {
        let written = file.to_toml().expect("a description can be written");
        let back = RecordingFile::parse("recording.toml", &written).expect("and read");
        assert_eq!(back.to_toml().expect("twice"), written);
    }
}

fn trace(text: &str) {
    if let Ok(recording) = read_recording("fuzzed", "trace.csv", text, None) {
        let written = trace_csv(&recording);
        let back = read_recording("fuzzed", "trace.csv", &written, None).expect("a trace reads back");
        assert_eq!(back.traces(), recording.traces());
    }
}

fn journals(text: &str) {
    // as it is, and with new checksums: else nearly every change would end at the first of them
    for text in [text.to_owned(), resealed(text)] {
        journal::<FitRecord>(&text);
        journal::<SweepPoint>(&text);
    }
}

fn resealed(text: &str) -> String {
    let content = |line: &str| line.rsplit_once(",\"sha256\":").map(|(content, _)| format!("{content}}}"));
    text.lines()
        .map(|line| content(line).map_or(line.to_owned(), |line| append_checksum(&line)) + "\n")
        .collect()
}

fn journal<R: CheckpointRecord + PartialEq + std::fmt::Debug>(text: &str)
where
    R::Body: PartialEq + std::fmt::Debug,
{
    let Ok(Some(found)) = read_checkpoint::<R>("journal.jsonl", text) else { return };
    let lines = found.records.iter().map(format_record_line);
    let written = format_header_line(&found.header) + &lines.collect::<String>();
    let back: CheckpointFile<R> =
        read_checkpoint("journal.jsonl", &written).expect("reads back").expect("has a header");
    assert_eq!((back.header, back.records), (found.header, found.records));
}

fn result(text: &str) {
    let _ = FitResult::parse("result.json", text);
    // and with a new hash: else every change would end there
    if let Ok(result) = serde_json::from_str::<FitResult>(text) {
        let written = result.to_json();
        assert_eq!(FitResult::parse("result.json", &written).expect("reads back").to_json(), written);
    }
}
