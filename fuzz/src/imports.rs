//! What must hold of every file, however damaged: an import is refused with a message, or it gives a
//! recording that its own `trace.csv` gives back to the bit. Anything else (a panic, a hang, memory out of
//! proportion) is found by the fuzzer itself.

use wiperlab::import::source::{Import, ImportSource};
use wiperlab::import::{ColumnMap, CoordinateScale, ImportOptions, TimeColumn, import};
use wiperlab::recording::files::{YAxis, read_recording, trace_csv};

/// Names that the seeds give to the tip, and to the head where the format has names of its own.
const POINTS: [(&str, &str); 3] = [("tip", "head"), ("0", "1"), ("1", "2")];

/// Reads `data` as `format` in every way that a user may ask for it.
pub fn check(format: &str, data: &[u8]) {
    for time in [None, Some(TimeColumn::Frames), Some(TimeColumn::Real)] {
        for (tip, head) in POINTS {
            let mut options = options(format, time);
            (options.tip, options.head) = (Some(tip.to_owned()), Some(head.to_owned()));
            if let Ok(found) =
                import(&[ImportSource::without_companions("seed.csv", data.to_vec())], &options)
            {
                check_import(&found);
                break;
            }
        }
    }
}

fn options(format: &str, time: Option<TimeColumn>) -> ImportOptions {
    ImportOptions {
        name: "fuzzed".to_owned(),
        format: Some(format.to_owned()),
        frame_rate_hz: Some(1000.0),
        scale: Some(CoordinateScale::Unit(1.0)),
        y_axis: Some(YAxis::Down),
        columns: (format == "generic").then(|| {
            ColumnMap::parse("time=1,tip-x=2,tip-y=3,head-x=4,head-y=5").expect("these are columns")
        }),
        time,
        ..ImportOptions::default()
    }
}

/// The recording's files are written and read back.
fn check_import(found: &Import) {
    let description = found.file.to_toml().expect("a description can be written");
    let parsed =
        wiperlab::recording::files::RecordingFile::parse("recording.toml", &description).expect("and read");
    let text = trace_csv(&found.recording);
    let back = read_recording("fuzzed", "trace.csv", &text, Some(&parsed)).expect("a trace reads back");
    assert_eq!(back.grid().frames, found.recording.grid().frames);
    assert_eq!(back.traces(), found.recording.traces());
}
