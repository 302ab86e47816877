//! A recording's own `trace.csv` is read back to the bit.

use proptest::prelude::*;
use wiperlab::import::source::ImportSource;
use wiperlab::import::{ImportOptions, import};
use wiperlab::recording::files::{HEADER, trace_csv};
use wiperlab::recording::{FrameGrid, Recording, Traces};

fn read(text: &str, rate_hz: Option<f64>) -> Result<wiperlab::import::source::Import, String> {
    let options =
        ImportOptions { name: "made".to_owned(), frame_rate_hz: rate_hz, ..ImportOptions::default() };
    import(&[ImportSource::without_companions("run7.csv", text.as_bytes().to_vec())], &options)
        .map_err(|error| error.to_string())
}

fn column(frames: usize) -> impl Strategy<Value = Vec<Option<f64>>> {
    proptest::collection::vec(proptest::option::weighted(0.7, -2.0..2.0_f64), frames)
}

fn recording(
    grid: FrameGrid,
    columns: [Vec<Option<f64>>; 4],
    confidence: Option<Vec<Option<f64>>>,
) -> Recording {
    let [mut tip_x_m, tip_y_m, head_x_m, head_y_m] = columns;
    tip_x_m[0] = Some(0.25); // (a table without any position is refused)
    let traces =
        Traces { tip_x_m, tip_y_m, head_x_m, head_y_m, tip_confidence: None, head_confidence: confidence };
    Recording::new("made", grid, traces, false).unwrap()
}

fn bits(recording: &Recording) -> Vec<Vec<Option<u64>>> {
    recording
        .traces()
        .columns()
        .map(|(_, column)| column.iter().map(|value| value.map(f64::to_bits)).collect())
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn import_of_a_trace_is_the_identity(
        (columns, confidence) in (2_usize..60).prop_flat_map(|n| ([column(n), column(n), column(n), column(n)], proptest::option::of(column(n)))),
        rate in 1.0..200_000.0_f64,
        start in -5.0..5.0_f64,
    ) {
        let grid = FrameGrid { start_s: start, frame_rate_hz: rate, frames: columns[0].len() };
        let written = recording(grid, columns, confidence);
        let found = read(&trace_csv(&written), Some(rate)).unwrap();
        prop_assert_eq!(found.report.format.as_str(), "wiperlab");
        prop_assert_eq!(found.recording.grid(), grid);
        prop_assert_eq!(bits(&found.recording), bits(&written));
        prop_assert_eq!(trace_csv(&found.recording), trace_csv(&written));
    }

    #[test]
    fn the_rate_of_a_trace_needs_no_option(tenths in 10_u32..2_000_000, frames in 3_usize..200) {
        let grid = FrameGrid { start_s: 0.0, frame_rate_hz: f64::from(tenths) / 10.0, frames };
        let columns = || std::array::from_fn(|_| vec![Some(0.5); frames]);
        let written = recording(grid, columns(), None);
        // (the error of an oscillator is added)
        let found = read(&trace_csv(&written), None).unwrap().recording;
        prop_assert_eq!(found.with_frame_rate_sd(None).unwrap(), written);
    }
}

#[test]
fn a_trace_says_everything_itself() {
    let text = include_str!("../fixtures/wiperlab/trace_with_confidence_and_gaps.csv");
    let found = read(text, None).unwrap();
    let (grid, traces) = (found.recording.grid(), found.recording.traces());
    assert_eq!((grid.start_s, grid.frame_rate_hz, grid.frames), (-0.001, 2000.0, 4));
    assert_eq!(traces.tip_x_m, [Some(0.0101), None, None, Some(0.0103)]);
    assert_eq!(traces.head_y_m, [Some(0.0), Some(0.0), None, None]);
    assert_eq!(traces.tip_confidence.as_deref(), Some(&[Some(0.99), Some(0.12), None, Some(0.98)][..]));
    assert_eq!(found.report.format, "wiperlab");
    let renamed = import(
        &[ImportSource::without_companions("data/run7/trace.csv", text.as_bytes().to_vec())],
        &ImportOptions::default(),
    )
    .unwrap_err()
    .to_string();
    assert!(
        renamed.contains("found the file name `trace.csv`") && renamed.contains("rename the export"),
        "{renamed}"
    );
}

#[test]
fn damaged_traces_are_refused_at_their_place() {
    let says = |rows: &str| read(&format!("{HEADER}\n{rows}"), None).unwrap_err();
    assert!(
        says("0,1,1,1,1\n0.1,x,1,1,1\n0.2,1,1,1,1\n")
            .starts_with("run7.csv:3: column tip_x_m: found `x`, expected a finite number")
    );
    assert!(
        says("0,1,1,1,1\n0.1,1,1,1\n0.2,1,1,1,1\n").starts_with("run7.csv:3:1: found 4 cells, expected 5")
    );
    assert!(says("0,1,1,1,1\n0,1,1,1,1\n").contains("expected a time after that of the row above"));
    let rate = read(&format!("{HEADER}\n0,1,1,1,1\n0.001,1,1,1,1\n0.002,1,1,1,1\n"), Some(25.0)).unwrap_err();
    assert!(rate.contains("--frame-rate-hz: found 25, but the column time_s of a trace.csv"), "{rate}");
    let extra = read(&format!("{HEADER},colour\n0,1,1,1,1,2\n0.001,1,1,1,1,2\n"), None).unwrap_err();
    assert!(
        extra.starts_with("run7.csv:1:1: found the header `time_s,tip_x_m,tip_y_m,head_x_m,head_y_m,colour`"),
        "{extra}"
    );
    let empty = read(&format!("{HEADER}\n0,,,,\n0.001,,,,\n"), None).unwrap_err();
    assert!(empty.starts_with("run7.csv: found no position of `tip` or `head`"), "{empty}");
}
