//! Reads this program's own `trace.csv`, in metres and seconds with y upwards. Every number is read back
//! exactly as it was written (bit for bit).

use crate::import::format::*;
use crate::recording::files::{HEADER, YAxis, parse_trace_csv};

pub(super) const FORMAT: FormatParser =
    FormatParser { name: "wiperlab", recognises: recognise_export, read: read_export };

fn recognise_export(document: &Document) -> Option<String> {
    let first = document.text.lines().next()?.trim();
    first.starts_with(HEADER).then(|| "line 1 is the header of a trace.csv".to_owned())
}

fn read_export<'a>(document: &'a Document<'a>, _options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
    let (grid, traces) = parse_trace_csv(document.file, document.text)?;
    let column = |values: Vec<Option<f64>>| values.into_iter().collect::<Column>();
    let track = |name: &str, x, y, confidence: Option<Vec<Option<f64>>>| Track {
        name: name.to_owned(),
        clock: 0,
        x: column(x),
        y: Some(column(y)),
        confidence: confidence.map(column),
        ..Track::default()
    };
    let clock = Clock {
        lines: clock_lines((0..grid.frames).map(|frame| frame + 2)),
        cell: 0,
        frame: Some((0..grid.frames).map(|frame| Some(frame as f64)).collect()),
        time: Some((0..grid.frames).map(|frame| Some(grid.time_s(frame))).collect()),
        ..Clock::default()
    };
    let why = || "a trace.csv is in metres, seconds of the recording itself, and y upwards".to_owned();
    let source = "the column time_s of a trace.csv, which holds times of the recording itself";
    let note = "whether a camera took it stands in its recording.toml, not here: give --twin if none did";
    Ok(TrackFile {
        clocks: vec![clock],
        tracks: vec![
            track("tip", traces.tip_x_m, traces.tip_y_m, traces.tip_confidence),
            track("head", traces.head_x_m, traces.head_y_m, traces.head_confidence),
        ],
        facts: Facts {
            y_axis: Some((YAxis::Up, why())),
            unit: Some((CoordinateUnit::Metres(1.0), why())),
            frame_rate_hz: Some((grid.frame_rate_hz, source.to_owned())),
            time: TimeUnit::Seconds(1.0),
            ..Facts::default()
        },
        notes: vec![note.to_owned()],
        ..TrackFile::for_document(document)
    })
}
