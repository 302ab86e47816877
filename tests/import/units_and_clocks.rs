//! Units and clocks of columns are read in the same way whether the header names the columns or `--columns`
//! names or numbers them. The tests write all their files themselves.

use std::fmt::Write;
use wiperlab::import::source::{Import, ImportSource};
use wiperlab::import::{ColumnMap, CoordinateScale, ImportOptions, TimeColumn, import};
use wiperlab::recording::files::YAxis;

/// A blade that moves at 100 mm/s while its tip oscillates at 61 Hz: tip x and y, head x and y, m.
fn position_m(time_s: f64) -> [f64; 4] {
    let head = 0.1 * time_s;
    [head + 2e-4 * (std::f64::consts::TAU * 61.0 * time_s).sin(), 1e-5, head, 0.012]
}

/// A table with `rows` rows at `rate_hz`. `time` gives the text in the time column of a row. `units_m` has
/// the lengths of the units of tip and head coordinates, m.
fn table(
    header: &str,
    rows: usize,
    time: impl Fn(usize) -> String,
    units_m: [f64; 2],
    rate_hz: f64,
) -> String {
    let mut text = format!("{header}\n");
    for row in 0..rows {
        let [tip_x, tip_y, head_x, head_y] = position_m(row as f64 / rate_hz);
        let [tip, head] = units_m;
        writeln!(
            text,
            "{},{:.6},{:.6},{:.6},{:.6}",
            time(row),
            tip_x / tip,
            tip_y / tip,
            head_x / head,
            head_y / head
        )
        .unwrap();
    }
    text
}

fn options(columns: Option<&str>) -> ImportOptions {
    ImportOptions {
        name: "made".to_owned(),
        y_axis: Some(YAxis::Up),
        columns: columns.map(|text| ColumnMap::parse(text).unwrap()),
        ..ImportOptions::default()
    }
}

fn at_rate(rate_hz: f64, columns: Option<&str>) -> ImportOptions {
    ImportOptions { frame_rate_hz: Some(rate_hz), ..options(columns) }
}

fn in_mm(options: ImportOptions) -> ImportOptions {
    ImportOptions { scale: Some(CoordinateScale::Unit(1e-3)), ..options }
}

fn read(text: &str, options: &ImportOptions) -> Import {
    read_as("run.csv", text, options)
}

fn read_as(name: &str, text: &str, options: &ImportOptions) -> Import {
    let source = ImportSource::without_companions(name, text.as_bytes().to_vec());
    import(&[source], options).unwrap_or_else(|error| panic!("{error}\n{}", &text[..text.len().min(300)]))
}

fn refused(text: &str, options: &ImportOptions) -> String {
    let source = ImportSource::without_companions("run.csv", text.as_bytes().to_vec());
    import(&[source], options).map_or_else(|error| error.to_string(), |found| panic!("{:?}", found.report))
}

/// Asserts that the recording contains the motion of [`position_m`] at `rate_hz`, within the rounding of the
/// file.
fn assert_positions(found: &Import, rate_hz: f64) {
    let (grid, traces) = (found.recording.grid(), found.recording.traces());
    assert!((grid.frame_rate_hz / rate_hz - 1.0).abs() < 1e-9, "{}", grid.frame_rate_hz);
    for frame in 0..grid.frames {
        let made = [&traces.tip_x_m, &traces.tip_y_m, &traces.head_x_m, &traces.head_y_m];
        for (column, expected) in made.into_iter().zip(position_m(frame as f64 / rate_hz)) {
            assert!((column[frame].unwrap() - expected).abs() < 2e-8, "frame {frame}: {:?}", column[frame]);
        }
    }
}

const BY_NUMBER: &str = "time=1,tip-x=2,tip-y=3,head-x=4,head-y=5";

#[test]
fn columns_of_different_units_are_each_converted_by_every_route() {
    let seconds = |row: usize| format!("{:.4}", row as f64 / 2000.0);
    let names = "time (s),tip x (mm),tip y (mm),head x (cm),head y (cm)";
    let text = table(names, 200, seconds, [1e-3, 1e-2], 2000.0);
    let by_name = "time=time (s),tip-x=tip x (mm),tip-y=tip y (mm),head-x=head x (cm),head-y=head y (cm)";
    for columns in [None, Some(BY_NUMBER), Some(by_name)] {
        assert_positions(&read(&text, &at_rate(2000.0, columns)), 2000.0);
        let says = refused(&text, &in_mm(at_rate(2000.0, columns)));
        assert!(
            says.starts_with("--scale: found `units of 0.001 m`") && says.contains("head x (cm)"),
            "{says}"
        );
    }
    // a length per pixel applies only to the columns in pixels
    let names = "time (s),tip x (px),tip y (px),head x (cm),head y (cm)";
    let text = table(names, 200, seconds, [2e-5, 1e-2], 2000.0);
    let scale = Some(CoordinateScale::MetresPerPixel(2e-5));
    for columns in [None, Some(BY_NUMBER)] {
        assert_positions(&read(&text, &ImportOptions { scale, ..at_rate(2000.0, columns) }), 2000.0);
        let says = refused(&text, &in_mm(at_rate(2000.0, columns)));
        assert!(says.contains("--scale"), "{says}");
        let says = refused(&text, &at_rate(2000.0, columns));
        assert!(says.contains("--scale S"), "{says}");
    }
}

#[test]
fn a_header_says_the_unit_of_the_times_to_every_route() {
    let text = |name: &str| {
        let names = format!("{name},tip x [mm],tip y [mm],head x [mm],head y [mm]");
        table(&names, 300, |row| format!("{:.1}", row as f64 * 0.5), [1e-3; 2], 2000.0)
    };
    let real = |columns| ImportOptions { time: Some(TimeColumn::Real), ..options(columns) };
    for name in ["Time [ms]", "time_ms", "t (ms)"] {
        for columns in [None, Some(BY_NUMBER), Some("time-ms=1,tip-x=2,tip-y=3,head-x=4,head-y=5")] {
            assert_positions(&read(&text(name), &real(columns)), 2000.0);
            let stated = ImportOptions { time: Some(TimeColumn::Milliseconds), ..options(columns) };
            assert_positions(&read(&text(name), &stated), 2000.0);
        }
    }
    // statements that contradict each other
    let says = refused(&text("time (s)"), &real(Some("time-ms=1,tip-x=2,head-x=4")));
    assert!(
        says.contains("--columns time-ms=1: found another unit (column 1 is called `time (s)`)"),
        "{says}"
    );
    let stated = ImportOptions { time: Some(TimeColumn::Milliseconds), ..options(None) };
    let says = refused(&text("time (s)"), &stated);
    assert!(says.starts_with("--time: found `ms`, expected the unit that run.csv gives"), "{says}");
}

#[test]
fn a_quantity_that_is_no_position_is_no_position() {
    let seconds = |row: usize| format!("{:.4}", row as f64 / 2000.0);
    for (unit, at) in [("m/s^2", 2), ("mm/s", 2), ("deg", 2), ("N", 2), ("Hz", 2)] {
        let names = format!("time (s),tip x ({unit}),tip y (mm),head x (mm),head y (mm)");
        let says =
            refused(&table(&names, 20, seconds, [1e-3; 2], 2000.0), &in_mm(at_rate(2000.0, Some(BY_NUMBER))));
        assert!(
            says.contains(&format!("--columns tip-x={at}: found a unit that is no length")),
            "{unit}: {says}"
        );
    }
    let names = "time (mm),tip x (mm),tip y (mm),head x (mm),head y (mm)";
    let says = refused(&table(names, 20, seconds, [1e-3; 2], 2000.0), &at_rate(2000.0, Some(BY_NUMBER)));
    assert!(says.contains("(column 1: `time (mm)`), expected s, ms"), "{says}");
}

#[test]
fn a_row_of_units_below_the_names_is_read_by_every_route() {
    let seconds = |row: usize| format!("{:.1}", row as f64 * 0.5);
    let names = "t,tip_x,tip_y,head_x,head_y\nms,mm,mm,cm,cm";
    let text = table(names, 100, seconds, [1e-3, 1e-2], 2000.0);
    for columns in [None, Some(BY_NUMBER), Some("time=t,tip-x=tip_x,tip-y=tip_y,head-x=head_x,head-y=head_y")]
    {
        assert_positions(&read(&text, &at_rate(2000.0, columns)), 2000.0);
    }
}

#[test]
fn settings_stray_cells_and_aligned_names_are_no_obstacle() {
    let seconds = |row: usize| format!("{:.4}", row as f64 / 2000.0);
    let plain = table("time,ax,ay,bx,by", 60, seconds, [1e-3; 2], 2000.0);
    let numbered = in_mm(at_rate(2000.0, Some(BY_NUMBER)));
    for settings in ["Interval,0.0005,,,\n", "Version 3,,,,\nInterval,0.0005,,,\nFrames,60,2,,\n\n"] {
        assert_positions(&read(&format!("{settings}{plain}"), &numbered), 2000.0);
    }
    // a column whose first cell is blank
    let mut speed = String::from("time,x,y,speed\n");
    for row in 0..40 {
        let [x, y, ..] = position_m(f64::from(row) / 2000.0);
        let last = if row == 0 { String::new() } else { format!("{:.3}", 100.0) };
        writeln!(speed, "{:.4},{:.6},{:.6},{last}", f64::from(row) / 2000.0, 1e3 * x, 1e3 * y).unwrap();
    }
    for columns in ["time=1,tip-x=2,tip-y=3", "time=time,tip-x=x,tip-y=y"] {
        let found = read(&speed, &in_mm(at_rate(2000.0, Some(columns))));
        assert_eq!(found.recording.grid().frames, 40);
    }
    // column names that are aligned with blanks, above numbers that are separated by tabs
    let mut tracker = String::from("weight\nt       x       y\n");
    for row in 0..60 {
        let [x, y, ..] = position_m(f64::from(row) / 2000.0);
        writeln!(tracker, "{:.9E}\t{:.9E}\t{:.9E}", f64::from(row) / 2000.0, x, y).unwrap();
    }
    let metres = ImportOptions {
        scale: Some(CoordinateScale::Unit(1.0)),
        tip: Some("weight".to_owned()),
        ..at_rate(2000.0, None)
    };
    let found = read_as("run.txt", &tracker, &metres);
    assert_eq!((found.report.format.as_str(), found.recording.grid().frames), ("tracker", 60));
    // column names that follow the name of their data set
    let names = "Film: Time (s),Film: X Lip (m),Film: Y Lip (m),Film: X Arm (m),Film: Y Arm (m),Film: X Velocity Lip (m/s)";
    let text: String = table(names, 60, seconds, [1.0; 2], 2000.0);
    let text: String = text
        .lines()
        .enumerate()
        .map(|(row, line)| if row == 0 { format!("{line}\n") } else { format!("{line},0.1\n") })
        .collect();
    let points =
        ImportOptions { tip: Some("Lip".to_owned()), head: Some("Arm".to_owned()), ..at_rate(2000.0, None) };
    let found = read(&text, &points);
    assert_eq!(found.recording.traces().head_y_m[3], Some(0.012));
}

#[test]
fn rates_that_differ_by_more_than_their_errors_are_a_caution_with_both() {
    let seconds = |row: usize| format!("{:.6}", row as f64 / 2000.0);
    let names = "t,tip_x,tip_y,head_x,head_y";
    let text = table(names, 600, seconds, [1e-3; 2], 2000.0);
    let rate_caution = |found: &Import| {
        let rates = found.report.findings.iter().filter(|finding| finding.check.name() == "implied-rate");
        let said: Vec<String> = rates
            .filter(|f| f.severity > wiperlab::recording::quality::Severity::Note)
            .map(|f| f.found.clone())
            .collect();
        said.join("; ")
    };
    let found = read(&text, &in_mm(at_rate(1983.0, None)));
    let said = rate_caution(&found);
    assert!(
        said.contains("1983 +- 0.09915") && said.contains("2000 +- 0.1") && said.contains("0.85 %"),
        "{said}"
    );
    assert!(!found.report.lines().join("\n").contains("rounded"), "{:?}", found.report.lines());
    assert_eq!(rate_caution(&read(&text, &in_mm(at_rate(2000.0, None)))), "");
    let refusal = refused(&text, &in_mm(at_rate(1900.0, None)));
    assert!(refusal.contains("imply 2000.000000 frames/s, but --frame-rate-hz says 1900"), "{refusal}");
}

#[test]
fn equal_steps_of_few_digits_know_their_rate_coarsely() {
    // a camera of 30 frames/s, whose program rounds the step to 33 ms and then adds up the steps
    let text = table(
        "t,tip_x,tip_y,head_x,head_y",
        300,
        |row| format!("{:.3}", row as f64 * 0.033),
        [1e-3; 2],
        30.0,
    );
    let found = read(&text, &in_mm(at_rate(30.0, None)));
    assert_positions(&found, 30.0);
    assert!(
        found.report.findings.iter().all(|f| !f.found.contains("hey differ by")),
        "{:?}",
        found.report.findings
    );
    let real = ImportOptions { time: Some(TimeColumn::Real), ..in_mm(options(None)) };
    let said = read(&text, &real).report.lines().join("\n");
    assert!(
        said.contains("caution: the times of run.csv imply 30.3 frames/s") && said.contains("1.5 % only"),
        "{said}"
    );
    // steps of 4 ms may be those of 250 or of 240 frames/s, steps of 20 ms only those of 50
    let steps_of = |step_s: f64, digits: usize| {
        let time = |row| format!("{:.digits$}", row as f64 * step_s);
        read(&table("t,tip_x,tip_y,head_x,head_y", 300, time, [1e-3; 2], 30.0), &real)
            .report
            .lines()
            .join("\n")
    };
    assert!(steps_of(0.004, 3).contains("known to 4.1 % only"));
    assert!(!steps_of(0.02, 3).contains("% only"));
    // with four digits, a step of 240 frames/s is 0.0042
    assert!(!steps_of(0.004, 4).contains("% only"));
    // 25 frames/s differs from the rate of the steps by more than half of the last digit
    assert!(refused(&text, &in_mm(at_rate(25.0, None))).contains("--frame-rate-hz says 25"));
}

#[test]
fn a_row_that_is_there_twice_is_said_to_be() {
    let text = table("frame,tip_x,tip_y,head_x,head_y", 90, |row| row.to_string(), [1e-3; 2], 1000.0);
    let mut lines: Vec<&str> = text.lines().collect();
    lines.insert(41, lines[40]);
    let says = refused(&(lines.join("\n") + "\n"), &in_mm(at_rate(1000.0, None)));
    assert!(says.starts_with("run.csv:42:1: column frame: found `39`"), "{says}");
    assert!(says.contains("the row is there twice; keep one of the two lines"), "{says}");
    assert!(!says.contains("frame=row"), "{says}");
}

#[test]
fn a_first_row_in_another_unit_of_time_is_refused() {
    let time = |row: usize| if row == 0 { "0.2".to_owned() } else { format!("{:.1}", 200.0 + row as f64) };
    let text = table("time_ms,tip_x,tip_y,head_x,head_y", 200, time, [1e-3; 2], 1000.0);
    let says = refused(&text, &in_mm(at_rate(1000.0, None)));
    assert!(says.starts_with("run.csv:2:1: ") && says.contains("the first row stands alone"), "{says}");
    // a point that was digitised some frames before the others is on their grid
    let time = |row: usize| if row == 0 { "0.0".to_owned() } else { format!("{:.1}", 200.0 + row as f64) };
    let text = table("time_ms,tip_x,tip_y,head_x,head_y", 200, time, [1e-3; 2], 1000.0);
    assert_eq!(read(&text, &in_mm(at_rate(1000.0, None))).recording.grid().frames, 400);
}

#[test]
fn a_clock_that_is_passed_over_for_rows_is_named_if_it_is_uneven() {
    let uneven = |row: usize| format!("{:.4}", row as f64 * 0.02 + 0.004 * (row as f64 * 0.3).sin());
    let even = |row: usize| format!("{:.4}", row as f64 * 0.02);
    let rows = Some("frame=row,tip-x=2,tip-y=3,head-x=4,head-y=5");
    let names = "time_s,tip_x,tip_y,head_x,head_y";
    let found = |time: &dyn Fn(usize) -> String| {
        let text = table(names, 300, time, [1e-3; 2], 50.0);
        read(&text, &in_mm(at_rate(50.0, rows))).report.lines().join("\n")
    };
    assert!(
        found(&uneven).contains("serious: --columns frame=row takes every row for a frame"),
        "{}",
        found(&uneven)
    );
    assert!(!found(&even).contains("frame=row"), "{}", found(&even));
}

#[test]
fn files_of_measurements_are_refused_by_name() {
    let metres = in_mm(at_rate(1000.0, None));
    let labview =
        "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\n***End_of_Header***\n0\t1\t2\n";
    assert!(refused(labview, &metres).contains("a measurement file of LabVIEW (.lvm)"));
    let universal = "    -1\n    58\nNONE\n         1    100    1\n    -1\n";
    assert!(refused(universal, &metres).contains("a universal file of vibration measurements"));
}

/// Times of rows that follow no rate, s: steps of 18 to 22 ms that drift.
fn uneven_time_s(row: usize) -> f64 {
    let row = row as f64;
    0.02 * row + 0.011 * (0.013 * row).sin() + 0.0008 * (2.1 * row).sin()
}

#[test]
fn times_that_are_no_grid_are_kept() {
    let names = "time_s,tip_x,tip_y,head_x,head_y";
    let mut text = format!("{names}\n");
    for row in 0..400 {
        let [tip_x, tip_y, head_x, head_y] = position_m(uneven_time_s(row)).map(|place| place * 1e3);
        let time_s = uneven_time_s(row);
        writeln!(text, "{time_s:.5},{tip_x:.6},{tip_y:.6},{head_x:.6},{head_y:.6}").unwrap();
    }
    for columns in [None, Some(BY_NUMBER)] {
        for options in
            [at_rate(50.0, columns), ImportOptions { time: Some(TimeColumn::Real), ..options(columns) }]
        {
            let found = read(&text, &in_mm(options));
            let times = found.recording.frame_times_s().expect("true times");
            for (row, time_s) in times.iter().enumerate() {
                assert!((time_s - uneven_time_s(row)).abs() < 1e-5, "row {row}: {time_s}");
                let tip = found.recording.traces().tip_x_m[row].unwrap();
                assert!((tip - position_m(uneven_time_s(row))[0]).abs() < 1e-8, "row {row}");
            }
        }
    }
    // a declared rate that is far from the rate of the steps is refused: the rate or the unit of the times is
    // wrong
    assert!(refused(&text, &in_mm(at_rate(500.0, None))).contains("--frame-rate-hz says 500"));
    // a single time off an otherwise even grid is refused as damaged
    let even = table(
        names,
        100,
        |row| format!("{:.4}", if row == 50 { 1.008 } else { row as f64 * 0.02 }),
        [1e-3; 2],
        50.0,
    );
    assert!(
        refused(&even, &in_mm(at_rate(50.0, None))).starts_with("run.csv:52:1: column time: found `1.008`")
    );
    // if the file has frame numbers, they are used, and a finding says that the times are uneven
    let numbered: String = text
        .lines()
        .enumerate()
        .map(|(row, line)| match row {
            0 => format!("frame,{line}\n"),
            row => format!("{},{line}\n", row - 1),
        })
        .collect();
    let found = read(&numbered, &in_mm(at_rate(50.0, None)));
    assert!(found.recording.frame_times_s().is_none());
    let said = found.report.lines().join("\n");
    assert!(said.contains("caution: run.csv: the times follow no even rate"), "{said}");
    let followed = "time=2,tip-x=3,tip-y=4,head-x=5,head-y=6";
    assert!(read(&numbered, &in_mm(at_rate(50.0, Some(followed)))).recording.frame_times_s().is_some());
}

#[test]
fn the_uncertainty_of_the_rate_is_part_of_the_recording() {
    let seconds = |row: usize| format!("{:.6}", row as f64 / 2000.0);
    let text = table("t,tip_x,tip_y,head_x,head_y", 600, seconds, [1e-3; 2], 2000.0);
    let sd = |options: ImportOptions| read(&text, &in_mm(options)).recording.frame_rate_sd_hz();
    // the error is that of an oscillator, 50 parts in a million, for a declared rate and for equal steps of a
    // round rate
    assert!((sd(at_rate(2000.0, None)).unwrap() - 0.1 / 3_f64.sqrt()).abs() < 1e-12);
    let real = ImportOptions { time: Some(TimeColumn::Real), ..options(None) };
    assert!((sd(real).unwrap() - 0.1 / 3_f64.sqrt()).abs() < 1e-9);
}

#[test]
fn units_of_times_in_every_spelling_are_read_or_refused_by_every_route() {
    let real = |columns| ImportOptions { time: Some(TimeColumn::Real), ..options(columns) };
    let text = |name: &str, unit_s: f64| {
        let names = format!("{name},tip x [mm],tip y [mm],head x [mm],head y [mm]");
        let time = |row: usize| format!("{:.12}", row as f64 / 2000.0 / unit_s);
        table(&names, 300, time, [1e-3; 2], 2000.0)
    };
    for (name, unit_s) in [
        ("t/ms", 1e-3),
        ("Zeit/ms", 1e-3),
        ("time_min", 60.0),
        ("t/min", 60.0),
        ("time (hours)", 3600.0),
        ("time_h", 3600.0),
        ("time/us", 1e-6),
        ("time_millis", 1e-3),
        ("time [0.1 ms]", 1e-4),
        ("time [0.7 s]", 0.7),
    ] {
        for columns in [None, Some(BY_NUMBER)] {
            let found = read(&text(name, unit_s), &real(columns));
            let rate_hz = found.recording.grid().frame_rate_hz;
            assert!((rate_hz / 2000.0 - 1.0).abs() < 1e-4, "{name}: {rate_hz}");
        }
    }
    for name in ["time (1/100 s)", "time x1000 (s)", "time_s_x1000", "sec/100", "ticks", "time (fortnights)"]
    {
        for columns in [None, Some(BY_NUMBER)] {
            let says = refused(&text(name, 1.0), &real(columns));
            assert!(says.starts_with("run.csv:1:1: ") && says.contains(name), "{name}: {says}");
        }
    }
    // a time whose unit is not known is left out beside frame numbers and beside other times
    for (names, second) in [("frame,ticks", 1.0), ("time_s,ticks", 1.0 / 2000.0), ("time_s,speed mm/s", 5e-4)]
    {
        let names = format!("{names},tip x [mm],tip y [mm],head x [mm],head y [mm]");
        let both = |row: usize| format!("{:.4},{}", row as f64 * second, 7 * row);
        assert_positions(&read(&table(&names, 60, both, [1e-3; 2], 2000.0), &at_rate(2000.0, None)), 2000.0);
    }
    let names = "t,tip_x,tip_y,head_x,head_y\nticks,mm,mm,mm,mm";
    let ticks = table(names, 60, |row| row.to_string(), [1e-3; 2], 2000.0);
    let says = refused(&ticks, &real(None));
    assert!(says.contains("(column 1: `t`, `ticks`)"), "{says}");
}

#[test]
fn units_of_lengths_in_every_spelling_are_read_and_contradictions_are_refused() {
    let seconds = |row: usize| format!("{:.4}", row as f64 / 2000.0);
    let text = |unit: &str, unit_m: f64| {
        let names: Vec<String> =
            ["tip x", "tip y", "head x", "head y"].map(|name| unit.replace("NAME", name)).into();
        table(&format!("time_s,{}", names.join(",")), 200, seconds, [unit_m; 2], 2000.0)
    };
    for (unit, unit_m) in [
        ("NAME/mm", 1e-3),
        ("NAME (0.1 mm)", 1e-4),
        ("NAME (nm)", 1e-9),
        ("NAME (dm)", 0.1),
        ("NAME (ft)", 0.3048),
    ] {
        for columns in [None, Some(BY_NUMBER)] {
            let found = read(&text(unit, unit_m), &at_rate(2000.0, columns));
            let [x, ..] = position_m(100.0 / 2000.0);
            assert!(
                (found.recording.traces().tip_x_m[100].unwrap() - x).abs() < 1e-6 * unit_m.max(0.1),
                "{unit}"
            );
            let says = refused(
                &text(unit, unit_m),
                &ImportOptions { scale: Some(CoordinateScale::Unit(0.01)), ..at_rate(2000.0, columns) },
            );
            assert!(says.starts_with("--scale: "), "{unit}: {says}");
        }
    }
    let names = "time_s,tip x (cm),tip y (cm),head x (cm),head y (cm)\ns,mm,mm,mm,mm";
    for columns in [None, Some(BY_NUMBER)] {
        let says = refused(&table(names, 20, seconds, [1e-3; 2], 2000.0), &at_rate(2000.0, columns));
        assert!(says.contains("column 2 is called `tip x (cm)`, but line 2 gives `mm` for it"), "{says}");
    }
    // a setting above the table names the unit of all columns
    let names = "Length Units,mm,,,\nt,tip_x,tip_y,head_x,head_y";
    let with_setting = table(names, 200, seconds, [1e-3; 2], 2000.0);
    for columns in [None, Some(BY_NUMBER)] {
        assert_positions(&read(&with_setting, &at_rate(2000.0, columns)), 2000.0);
        let scale = Some(CoordinateScale::Unit(0.01));
        let says = refused(&with_setting, &ImportOptions { scale, ..at_rate(2000.0, columns) });
        assert!(says.contains("line 1: `Length Units` is `mm`"), "{says}");
    }
}

#[test]
fn frame_numbers_and_times_that_part_are_refused_at_their_row() {
    let names = "frame,time_s,tip_x,tip_y,head_x,head_y";
    let text = |clocks: &dyn Fn(usize) -> (usize, f64)| {
        let both = |row: usize| {
            let (frame, time_s) = clocks(row);
            format!("{frame},{time_s:.6}")
        };
        table(names, 200, both, [1e-3; 2], 1000.0)
    };
    let real = || in_mm(ImportOptions { time: Some(TimeColumn::Real), ..options(None) });
    // a pause that only the times show, and lost frames that only the numbers show
    let pause = |row: usize| (row, row as f64 / 1000.0 + if row < 50 { 0.0 } else { 0.0204 });
    let lost = |row: usize| (row + if row < 50 { 0 } else { 20 }, row as f64 / 1000.0);
    for clocks in [&pause as &dyn Fn(usize) -> (usize, f64), &lost] {
        for options in [real(), in_mm(at_rate(1000.0, None))] {
            let says = refused(&text(clocks), &options);
            assert!(says.starts_with("run.csv:52:1: found a step of "), "{says}");
            assert!(says.contains("expected frame numbers and times that agree"), "{says}");
        }
    }
    // lost frames in both, and times that are rounded to whole frames
    let both = |row: usize| {
        let frame = row + if row < 50 { 0 } else { 20 };
        (frame, frame as f64 / 1000.0)
    };
    assert_eq!(read(&text(&both), &real()).recording.grid().frames, 220);
    for (rate_hz, digit) in [(1500.0, 1e-4), (1300.0, 1e-3)] {
        let lost = |row: usize| {
            let frame = row + if row < 50 { 0 } else { 120 };
            (frame, (frame as f64 / rate_hz / digit).round() * digit)
        };
        assert_eq!(read(&text(&lost), &in_mm(at_rate(rate_hz, None))).recording.grid().frames, 320);
    }
    let coarse = |row: usize| (row, (row as f64 / 1300.0 * 1e3).round() / 1e3);
    assert!((read(&text(&coarse), &real()).recording.grid().frame_rate_hz / 1300.0 - 1.0).abs() < 0.01);
}

#[test]
fn a_long_gap_in_rounded_times_keeps_its_frames() {
    for rate_hz in [700.0, 1500.0, 7000.0] {
        let mut text = String::from("time_s,tip_x,head_x\n");
        for frame in (0..40).chain(340..380) {
            let time_s = f64::from(frame) / rate_hz;
            writeln!(
                text,
                "{time_s:.5},{:.6},{:.6}",
                1e3 * position_m(time_s)[0],
                1e3 * position_m(time_s)[2]
            )
            .unwrap();
        }
        for options in
            [ImportOptions { time: Some(TimeColumn::Real), ..options(None) }, at_rate(rate_hz, None)]
        {
            let grid = read(&text, &in_mm(options)).recording.grid();
            assert_eq!(grid.frames, 380, "{rate_hz}");
            assert!((grid.frame_rate_hz / rate_hz - 1.0).abs() < 1e-9, "{}", grid.frame_rate_hz);
        }
    }
}

#[test]
fn separators_of_thousands_are_refused_in_every_delimiter() {
    let numbers = [900, 940, 980, 1020, 1060, 1100, 1140, 1180];
    let text = |delimiter: &str, separate: &dyn Fn(i32) -> String| {
        let row =
            |(frame, x): (usize, &i32)| [frame.to_string(), separate(*x), separate(x + 7000)].join(delimiter);
        let rows: Vec<String> = numbers.iter().enumerate().map(row).collect();
        format!("{}\n{}\n", ["frame", "tip_x_um", "head_x_um"].join(delimiter), rows.join("\n"))
    };
    let grouped = |mark: &'static str| {
        move |x: i32| if x < 1000 { x.to_string() } else { format!("{}{mark}{:03}", x / 1000, x % 1000) }
    };
    for (delimiter, mark) in [(";", ","), ("\t", ","), (";", "."), ("\t", "."), ("\t", " "), (";", "\u{a0}")]
    {
        let says = refused(&text(delimiter, &grouped(mark)), &at_rate(1000.0, None));
        assert!(says.starts_with("run.csv:"), "{delimiter:?} {mark:?}: {says}");
    }
    // decimals of three digits next to whole numbers
    let decimals = |x: i32| {
        if x % 100 == 0 { (x / 100).to_string() } else { format!("{},{:03}", x / 100, x % 100 * 10) }
    };
    let found = read(&text(";", &decimals), &at_rate(1000.0, None));
    assert_eq!(found.recording.traces().tip_x_m[1], Some(9.4e-6));
    // exponents as Fortran writes them
    let fortran = |x: i32| format!("{x}.0D-03");
    let found = read(&text(",", &fortran), &at_rate(1000.0, None));
    assert!((found.recording.traces().tip_x_m[1].unwrap() - 9.4e-7).abs() < 1e-20);
}

#[test]
fn a_column_that_names_objects_is_not_left_out_in_silence() {
    let mut text = String::from("frame,x,y,shot\n");
    for (object, at) in [(0, 0.0), (1, 49.0)] {
        for row in 0..30 {
            writeln!(text, "{},{:.3},{:.3},{object}", 30 * object + row, at + 0.01 * f64::from(row), 5.0)
                .unwrap();
        }
    }
    let plain = in_mm(ImportOptions { tip: Some("run".to_owned()), ..at_rate(1000.0, None) });
    let says = refused(&text, &plain);
    assert!(says.starts_with("run.csv:32:1: column 4 (`shot`) is not read, but the point jumps"), "{says}");
    let chosen = ImportOptions {
        tip: Some("1".to_owned()),
        ..in_mm(at_rate(1000.0, Some("frame=1,x=2,y=3,track=4")))
    };
    assert_eq!(read(&text, &chosen).recording.grid().frames, 30);
    let left_out =
        ImportOptions { tip: Some("run".to_owned()), ..in_mm(at_rate(1000.0, Some("frame=1,x=2,y=3"))) };
    let found = read(&text, &left_out);
    assert!(found.report.findings.iter().any(|finding| finding.found.contains("`shot`")));
    // a column of another kind does not jump with the point
    let phases: String = text
        .lines()
        .enumerate()
        .map(|(row, line)| match row {
            0 => format!("{line}\n"),
            _ => format!("{},{},5.0,{}\n", row - 1, 0.01 * row as f64, row / 20),
        })
        .collect();
    assert_eq!(read(&phases, &plain).recording.grid().frames, 60);
}
