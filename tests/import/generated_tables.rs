//! Tables drawn at random from units, clocks, layouts, options and damage: each is either read correctly or
//! refused.

use proptest::prelude::*;
use std::fmt::Write;
use wiperlab::import::source::{Import, ImportSource};
use wiperlab::import::{ColumnMap, CoordinateScale, ImportOptions, TimeColumn, import};
use wiperlab::recording::files::YAxis;
use wiperlab::recording::quality::Severity;

/// A drawn table and the options of its import.
#[derive(Debug, Clone)]
struct Drawn {
    rows: usize,
    rate_hz: f64,
    /// Symbol of the clock's unit, and the length of this unit, s; `None` for frame numbers.
    clock: Option<(&'static str, f64)>,
    /// Symbol of the unit of tip and of head, and the length of this unit, m. If the symbol is empty, the
    /// file does not state the unit.
    units: [(&'static str, f64); 2],
    naming: usize,
    unit_place: usize,
    settings: usize,
    delimiter: char,
    route: usize,
    declared_scale: Option<CoordinateScale>,
    declared_rate: Option<f64>,
    time: Option<TimeColumn>,
    damage: usize,
    /// Row that the damage affects.
    damaged_row: usize,
}

/// Length of a pixel, m.
const PIXEL_M: f64 = 2e-5;
const UNITS: [(&str, f64); 6] =
    [("m", 1.0), ("mm", 1e-3), ("cm", 1e-2), ("um", 1e-6), ("px", PIXEL_M), ("", 1e-3)];
const CLOCKS: [Option<(&str, f64)>; 5] =
    [None, Some(("s", 1.0)), Some(("ms", 1e-3)), Some(("us", 1e-6)), Some(("", 1.0))];
const SCALES: [Option<CoordinateScale>; 5] = [
    None,
    Some(CoordinateScale::Unit(1e-3)),
    Some(CoordinateScale::Unit(1.0)),
    Some(CoordinateScale::MetresPerPixel(PIXEL_M)),
    Some(CoordinateScale::Unit(1e-2)),
];

fn drawn() -> impl Strategy<Value = Drawn> {
    let table = (
        30_usize..60,
        prop::sample::select(vec![60.0, 500.0, 1000.0, 2000.0]),
        prop::sample::select(CLOCKS.to_vec()),
    );
    let units = (prop::sample::select(UNITS.to_vec()), prop::sample::select(UNITS.to_vec()), any::<bool>());
    let layout = (0_usize..4, 0_usize..4, 0_usize..3, prop::sample::select(vec![',', ';', '\t']), 0_usize..3);
    let scale = prop::sample::select(SCALES.to_vec());
    let rate = prop::sample::select(vec![Some(1.0), Some(1.0), Some(1.004), Some(1.05), None]);
    let time = prop::sample::select(vec![None, None, Some(TimeColumn::Real), Some(TimeColumn::Milliseconds)]);
    let damage = (0_usize..9, 3_usize..28);
    (table, units, layout, scale, rate, time, damage).prop_map(
        |(table, units, layout, scale, rate, time, damage)| {
            let (rows, rate_hz, clock) = table;
            Drawn {
                rows,
                rate_hz,
                clock,
                units: [units.0, if units.2 { units.0 } else { units.1 }],
                naming: layout.0,
                unit_place: layout.1,
                settings: layout.2,
                delimiter: layout.3,
                route: layout.4,
                declared_scale: scale,
                declared_rate: rate.map(|factor| factor * rate_hz),
                time,
                damage: damage.0,
                damaged_row: damage.1,
            }
        },
    )
}

impl Drawn {
    /// Positions in a row, m: x and y of the tip, x and y of the head.
    fn position_m(&self, row: usize) -> [f64; 4] {
        let t = row as f64;
        [
            0.001 * t + 1e-4 * (0.9 * t).sin(),
            2e-5 * (1.7 * t).cos() + 1e-4,
            0.001 * t + 2e-5 * (0.4 * t).cos(),
            0.012 + 1e-5 * (1.1 * t).sin(),
        ]
    }

    fn names(&self) -> (String, [String; 4]) {
        let clock = match self.clock {
            None => "frame".to_owned(),
            Some((unit, _)) if self.unit_place != 3 && !unit.is_empty() => format!("time ({unit})"),
            Some(_) => "time".to_owned(),
        };
        let name = |point: &str, axis: &str, unit: &str| {
            let base = match self.naming {
                0 => format!("{point}_{axis}"),
                1 => format!("{axis}_{point}"),
                2 => format!("{point} {axis}"),
                _ => format!("{point}.{axis}"),
            };
            match self.unit_place {
                _ if unit.is_empty() => base,
                0 => format!("{base} ({unit})"),
                1 => format!("{base} [{unit}]"),
                2 => format!("{base}_{unit}"),
                _ => base,
            }
        };
        let [tip, head] = self.units;
        (
            clock,
            [
                name("tip", "x", tip.0),
                name("tip", "y", tip.0),
                name("head", "x", head.0),
                name("head", "y", head.0),
            ],
        )
    }

    /// Time or frame number of a row as the file writes it.
    fn clock_text(&self, row: usize) -> String {
        let time_s = row as f64 / self.rate_hz;
        match self.clock {
            None => row.to_string(),
            Some((_, unit_s)) => format!("{:.6}", time_s / unit_s),
        }
    }

    /// Whether the file has a row of units below the names; the names then contain no units.
    fn has_units_row(&self) -> bool {
        self.unit_place == 3
            && self.units.iter().all(|unit| !unit.0.is_empty())
            && self.clock.is_some_and(|clock| !clock.0.is_empty())
    }

    /// Whether the file states the unit of the tip and that of the head.
    fn stated(&self) -> [bool; 2] {
        let in_names = self.unit_place < 3;
        self.units.map(|unit| !unit.0.is_empty() && (in_names || self.has_units_row()))
    }

    fn text(&self) -> String {
        let d = self.delimiter;
        let (clock, names) = self.names();
        let mut text = String::new();
        for line in 0..self.settings {
            writeln!(text, "Setting {line}{d}{:.3}{d}{d}{d}", 0.5 + line as f64).unwrap();
        }
        writeln!(text, "{clock}{d}{}", names.join(&d.to_string())).unwrap();
        if self.has_units_row() {
            let ([tip, head], clock) = (self.units, self.clock.map_or("", |clock| clock.0));
            writeln!(text, "{clock}{d}{}{d}{}{d}{}{d}{}", tip.0, tip.0, head.0, head.0).unwrap();
        }
        let mut lines: Vec<String> = (0..self.rows)
            .map(|row| {
                let place = self.position_m(row);
                let cells: Vec<String> =
                    (0..4).map(|at| format!("{:.9}", place[at] / self.units[at / 2].1)).collect();
                format!("{}{d}{}", self.clock_text(row), cells.join(&d.to_string()))
            })
            .collect();
        let at = self.damaged_row;
        match self.damage {
            1 => lines.insert(at, lines[at].clone()),
            2 => lines.swap(at, at + 1),
            3 => drop(lines.remove(at)),
            4 => lines[at] = lines[at].replacen(d, &format!("x{d}"), 1),
            5 => lines[at] = lines[at].rsplit_once(d).unwrap().0.to_owned(),
            6 => lines[0] = lines[0].replacen(&self.clock_text(0), &format!("{}.4", 3 * at), 1),
            _ => {}
        }
        text + &lines.join("\n") + "\n"
    }

    fn options(&self) -> ImportOptions {
        let (clock, names) = self.names();
        let key = match (self.clock, self.time) {
            (None, _) => "frame",
            (Some(("", _)), Some(TimeColumn::Milliseconds)) => "time-ms",
            (Some(_), _) => "time",
        };
        let [a, b, c, e] = &names;
        let columns = match self.route {
            0 => None,
            1 => Some(format!("{key}=1,tip-x=2,tip-y=3,head-x=4,head-y=5")),
            _ => Some(format!("{key}={clock},tip-x={a},tip-y={b},head-x={c},head-y={e}")),
        };
        ImportOptions {
            name: "drawn".to_owned(),
            y_axis: Some(YAxis::Up),
            scale: self.declared_scale,
            frame_rate_hz: self.declared_rate,
            time: self.time,
            columns: columns.map(|columns| ColumnMap::parse(&columns).unwrap()),
            ..ImportOptions::default()
        }
    }

    /// Length of the unit of a point's coordinates that the import should use, m; `None` if file and options
    /// contradict each other or do not state the unit.
    fn expected_unit(&self, point: usize) -> Option<f64> {
        let (symbol, length_m) = self.units[point];
        let scale = self.declared_scale;
        match (self.stated()[point], symbol, scale) {
            (true, "px", Some(CoordinateScale::MetresPerPixel(metres))) => Some(metres),
            (true, "px", _) => None,
            (true, _, None | Some(CoordinateScale::MetresPerPixel(_))) => Some(length_m),
            (true, _, Some(CoordinateScale::Unit(metres))) => (metres == length_m).then_some(length_m),
            (false, _, Some(CoordinateScale::MetresPerPixel(metres) | CoordinateScale::Unit(metres))) => {
                Some(metres)
            }
            (false, _, None) => None,
        }
    }

    /// Describes the first error in the result of an import; `None` if the result is right.
    fn find_error(&self, found: &Import) -> Option<String> {
        let Some(units) = self.expected_unit(0).zip(self.expected_unit(1)) else {
            return Some("contradicting or missing units were read".to_owned());
        };
        if [1, 2, 4, 5].contains(&self.damage) {
            return Some(format!("damage {} was read", self.damage));
        }
        let grid = found.recording.grid();
        // if the file does not state the unit of the clock, it is seconds or the unit that the option states
        let unit_s = self.clock.map_or(1.0, |clock| clock.1);
        let read_s = match self.time {
            _ if self.unit_is_written() => unit_s,
            Some(TimeColumn::Milliseconds) => 1e-3,
            _ => 1.0,
        };
        let in_file_hz = self.rate_hz * unit_s / read_s;
        let rate_hz = self.declared_rate.unwrap_or(in_file_hz);
        // a first time that is wrong by a small part of a frame counts as jitter; a line through all times then
        // has another slope
        let moved_frames = (3 * self.damaged_row) as f64 * unit_s * self.rate_hz;
        let by_damage =
            if self.damage == 6 { 8.0 * moved_frames / (self.rows * self.rows) as f64 } else { 0.0 };
        if (grid.frame_rate_hz / rate_hz - 1.0).abs() > 1e-5 + by_damage {
            return Some(format!("rate {}, expected {rate_hz}", grid.frame_rate_hz));
        }
        let apart = (in_file_hz / rate_hz - 1.0).abs();
        let told = found
            .report
            .findings
            .iter()
            .any(|finding| finding.check.name() == "implied-rate" && finding.severity > Severity::Note);
        if self.clock.is_some() && apart > 2e-3 && !told {
            return Some(format!("rates {in_file_hz} and {rate_hz} differ without a word"));
        }
        let traces = found.recording.traces();
        let columns = [&traces.tip_x_m, &traces.tip_y_m, &traces.head_x_m, &traces.head_y_m];
        if grid.frames != self.rows {
            return Some(format!("{} frames", grid.frames));
        }
        for row in 0..self.rows {
            for (at, column) in columns.iter().enumerate() {
                let unit = if at < 2 { units.0 } else { units.1 };
                let expected = self.position_m(row)[at] / self.units[at / 2].1 * unit;
                let lost = self.damage == 3 && row == self.damaged_row;
                match column[row] {
                    None if lost => {}
                    Some(x) if !lost && (x - expected).abs() <= 1e-9 * unit + 1e-12 * expected.abs() => {}
                    other => return Some(format!("row {row}, column {at}: {other:?}, expected {expected}")),
                }
            }
        }
        None
    }

    /// Whether the file states the unit of its clock.
    fn unit_is_written(&self) -> bool {
        self.clock.is_none_or(|clock| !clock.0.is_empty() && (self.unit_place != 3 || self.has_units_row()))
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, ..ProptestConfig::default() })]

    #[test]
    fn drawn_tables_are_read_right_or_refused(drawn in drawn()) {
        let text = drawn.text();
        let source = ImportSource::without_companions("drawn.csv", text.clone().into_bytes());
        if let Ok(found) = import(&[source], &drawn.options()) {
            let error = drawn.find_error(&found);
            prop_assert!(error.is_none(), "{}\n{}\n{:?}", error.unwrap_or_default(), &text[..text.len().min(400)], found.report.lines());
        }
    }
}

/// All tables without damage and contradiction are read. So an import that refuses every table fails.
#[test]
fn sound_tables_are_read() {
    let (mut sound, mut read) = (0, 0);
    for index in 0..UNITS.len() * CLOCKS.len() * 36 {
        let unit = UNITS[index % UNITS.len()];
        let clock = CLOCKS[index / UNITS.len() % CLOCKS.len()];
        let layout = index / (UNITS.len() * CLOCKS.len());
        let drawn = Drawn {
            rows: 40,
            rate_hz: 1000.0,
            clock,
            units: [unit, unit],
            naming: layout % 4,
            unit_place: layout % 3,
            settings: layout % 2,
            delimiter: [',', ';', '\t'][layout % 3],
            route: layout / 12,
            declared_scale: match unit.0 {
                "px" => Some(CoordinateScale::MetresPerPixel(PIXEL_M)),
                "" => Some(CoordinateScale::Unit(unit.1)),
                _ => None,
            },
            declared_rate: Some(1000.0),
            time: None,
            damage: 0,
            damaged_row: 5,
        };
        sound += 1;
        let source = ImportSource::without_companions("drawn.csv", drawn.text().into_bytes());
        match import(&[source], &drawn.options()) {
            Ok(found) => {
                read += 1;
                assert_eq!(drawn.find_error(&found), None, "{}", drawn.text());
            }
            Err(error) => println!("{error}\n{}", &drawn.text()[..200]),
        }
    }
    assert_eq!(read, sound);
}
