//! Whatever a program wrote is read exactly, and whatever happened to its file afterwards is read right or
//! refused.

use crate::exports::{Exporter, Motion, exporters};
use proptest::prelude::*;
use wiperlab::import::import;
use wiperlab::import::source::{Import, ImportSource};

/// Positions with three decimals, of which some are lost; no point sits on the origin, which some programs
/// write for a lost one.
fn motions() -> impl Strategy<Value = Motion> {
    let coordinate = (1_i32..2_000_000).prop_map(|thousandths| f64::from(thousandths) / 1000.0);
    let point = proptest::option::weighted(0.85, (coordinate.clone(), coordinate));
    let frame = (point.clone(), point)
        .prop_map(|(tip, head)| [tip.map(|p| p.0), tip.map(|p| p.1), head.map(|p| p.0), head.map(|p| p.1)]);
    let whole = |frame: [Option<f64>; 4]| frame.map(|value| value.or(Some(7.125)));
    let motions =
        (proptest::collection::vec(frame, 12..40), prop_oneof![Just(500.0), Just(1000.0), Just(200.0)])
            .prop_map(move |(mut frames, rate_hz)| {
                // the first and last frames are tracked, so that all layouts show the same length
                for end in [0, 1, frames.len() - 1] {
                    frames[end] = whole(frames[end]);
                }
                Motion { rate_hz, frames }
            });
    motions.prop_filter("a point that is tracked in every second frame implies another rate", |motion| {
        [0, 2].iter().all(|point| {
            let tracked = |frame: &[[Option<f64>; 4]]| frame.iter().all(|values| values[*point].is_some());
            let follow = motion.frames.windows(2).filter(|pair| tracked(pair)).count();
            let steps = motion.frames.iter().filter(|values| values[*point].is_some()).count() - 1;
            3 * follow >= 2 * steps
        })
    })
}

fn read(exporter: &Exporter, motion: &Motion, source: ImportSource) -> Result<Import, String> {
    import(&[source], &exporter.options(motion)).map_err(|error| error.to_string())
}

/// Tip and head of an import, frame by frame, with the number of the motion's frame that each belongs to.
fn positions(found: &Import) -> Vec<[Option<f64>; 4]> {
    let traces = found.recording.traces();
    (0..found.recording.grid().frames)
        .map(|i| [traces.tip_x_m[i], traces.tip_y_m[i], traces.head_x_m[i], traces.head_y_m[i]])
        .collect()
}

/// What an exporter can carry of a motion, in the unit of its file.
fn carried(exporter: &Exporter, motion: &Motion) -> Vec<[Option<f64>; 4]> {
    motion.frames.iter().map(|v| if exporter.points == 2 { *v } else { [v[0], v[1], None, None] }).collect()
}

#[test]
fn every_layout_is_read_as_what_it_is() {
    let frames = (0..30)
        .map(|i| [Some(f64::from(i) + 0.125), Some(40.5), Some(f64::from(2 * i) + 0.25), Some(30.25)])
        .collect();
    let motion = Motion { rate_hz: 500.0, frames };
    let mut wrong = vec![];
    for exporter in exporters() {
        match read(&exporter, &motion, exporter.source(&motion)) {
            Err(message) => wrong.push(format!("{} {}: {message}", exporter.format, exporter.variant)),
            Ok(found) if found.report.format != exporter.format => wrong
                .push(format!("{} {}: taken for {}", exporter.format, exporter.variant, found.report.format)),
            Ok(found) if positions(&found) != carried(&exporter, &motion) => {
                wrong.push(format!("{} {}: other numbers", exporter.format, exporter.variant))
            }
            Ok(_) => {}
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn what_was_written_is_read_exactly(motion in motions()) {
        for exporter in exporters() {
            let found = read(&exporter, &motion, exporter.source(&motion));
            let found = found.map_err(|message| TestCaseError::fail(format!("{} {}: {message}", exporter.format, exporter.variant)))?;
            prop_assert_eq!(&found.report.format, exporter.format);
            prop_assert_eq!(positions(&found), carried(&exporter, &motion), "{} {}", exporter.format, exporter.variant);
        }
    }

    #[test]
    fn line_ends_marks_and_encodings_change_nothing(motion in motions()) {
        for exporter in exporters() {
            let plain = exporter.source(&motion);
            let text = String::from_utf8(plain.bytes.clone()).unwrap();
            let wide = [0xff, 0xfe].into_iter().chain(text.encode_utf16().flat_map(u16::to_le_bytes)).collect::<Vec<u8>>();
            let with_mark = format!("\u{feff}{text}").into_bytes();
            let variants = [text.replace('\n', "\r\n").into_bytes(), text.replace('\n', "\r").into_bytes(), with_mark, wide, text.trim_end().as_bytes().to_vec()];
            for (index, bytes) in variants.into_iter().enumerate() {
                let found = read(&exporter, &motion, ImportSource { bytes, ..plain.clone() });
                let found = found.map_err(|message| TestCaseError::fail(format!("{} {} variant {index}: \
                    {message}", exporter.format, exporter.variant)))?;
                prop_assert_eq!(positions(&found), carried(&exporter, &motion), "{} {} variant {}", exporter.format, exporter.variant, index);
            }
        }
    }
}

/// One accident that happens to a file.
#[derive(Debug, Clone)]
enum Accident {
    /// A byte is replaced, put in or taken out.
    Byte(prop::sample::Index, u8, u8),
    /// A line is lost, doubled, or changes places with the next.
    Line(prop::sample::Index, u8),
    /// The end of the file is lost.
    Cut(prop::sample::Index),
}

fn accidents() -> impl Strategy<Value = Accident> {
    let byte = prop_oneof![prop::sample::select(b"0123456789.,;\t -eE\"\n#xN/<>".to_vec()), any::<u8>()];
    prop_oneof![
        4 => (any::<prop::sample::Index>(), byte, 0_u8..3).prop_map(|(at, byte, how)| Accident::Byte(at, byte, how)),
        2 => (any::<prop::sample::Index>(), 0_u8..3).prop_map(|(at, how)| Accident::Line(at, how)),
        1 => any::<prop::sample::Index>().prop_map(Accident::Cut),
    ]
}

/// The bytes after the accident, and the lines of the original that it touched (0-based, first and last).
fn suffer(bytes: &[u8], accident: &Accident) -> (Vec<u8>, usize, usize) {
    let line_of = |offset: usize| bytes[..offset].iter().filter(|b| **b == b'\n').count();
    let mut damaged = bytes.to_vec();
    match accident {
        Accident::Byte(at, byte, how) => {
            let at = at.index(bytes.len());
            match how {
                0 => damaged[at] = *byte,
                1 => damaged.insert(at, *byte),
                _ => drop(damaged.remove(at)),
            }
            // a line end that goes joins the next line
            (damaged, line_of(at), line_of(at) + 1)
        }
        Accident::Line(at, how) => {
            let mut lines: Vec<&[u8]> = bytes.split_inclusive(|b| *b == b'\n').collect();
            let at = at.index(lines.len());
            match how {
                0 => drop(lines.remove(at)),
                1 => lines.insert(at, lines[at]),
                _ => lines.swap(at, (at + 1).min(bytes.split_inclusive(|b| *b == b'\n').count() - 1)),
            }
            (lines.concat(), at, at + 1)
        }
        Accident::Cut(at) => {
            let at = at.index(bytes.len());
            (bytes[..at].to_vec(), line_of(at), usize::MAX)
        }
    }
}

/// Whether a number stands in some of the lines, with either decimal mark.
fn says(lines: &[String], value: f64) -> bool {
    let numbers = |line: &str| {
        line.split(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c)))
            .filter_map(|word| word.parse().ok())
            .any(|n: f64| n == value)
    };
    lines
        .iter()
        .map(|line| line.replace('\u{2212}', "-"))
        .any(|line| numbers(&line) || numbers(&line.replace(',', ".")))
}

/// Lines above the first row of numbers.
fn header_lines(bytes: &[u8]) -> usize {
    let numeric = |line: &&[u8]| {
        let text = String::from_utf8_lossy(line);
        let first = text.trim_start_matches(['"', ' ', '\t']).chars().next();
        first.is_some_and(|c| c.is_ascii_digit() || c == '-')
            && text.chars().filter(char::is_ascii_digit).count() > 2
    };
    bytes.split(|b| *b == b'\n').position(|line| numeric(&line)).unwrap_or(0)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, ..ProptestConfig::default() })]

    /// Never a panic, and what is read of undamaged lines stays what it was.
    #[test]
    fn damaged_files_are_read_right_or_refused(motion in motions(), which in any::<prop::sample::Index>(), accident in accidents()) {
        let all = exporters();
        let exporter = &all[which.index(all.len())];
        let source = exporter.source(&motion);
        let (bytes, first, last) = suffer(&source.bytes, &accident);
        let header = header_lines(&source.bytes);
        let Ok(found) = read(exporter, &motion, ImportSource { bytes: bytes.clone(), ..source.clone() }) else { return Ok(()) };
        // another header may give other columns; a row lost where rows are frames cannot be noticed
        if first <= header || exporter.rows_are_frames || exporter.variant.contains("xml") || exporter.variant == "sparse" {
            return Ok(());
        }
        let truth = carried(exporter, &motion);
        let touched = |bytes: &[u8]| {
            let text = String::from_utf8_lossy(bytes).into_owned();
            text.lines().skip(first).take(last.saturating_sub(first).saturating_add(2)).map(str::to_owned).collect::<Vec<String>>()
        };
        let (before, after) = (touched(&source.bytes), touched(&bytes));
        let original = read(exporter, &motion, source.clone()).unwrap();
        let shift = ((found.recording.grid().start_s - original.recording.grid().start_s) * motion.rate_hz).round() as i64;
        // times that are damaged may be left out, so that the start is that of the frame numbers
        let shift = if shift.unsigned_abs() as usize > motion.frames.len() { 0 } else { shift };
        for (index, values) in positions(&found).iter().enumerate() {
            for (channel, value) in values.iter().enumerate() {
                let Some(value) = value else { continue };
                let expected = usize::try_from(index as i64 + shift).ok().and_then(|frame| truth.get(frame)).and_then(|v| v[channel]);
                // a number of the damaged lines may be lost, changed or in another frame; every other one
                // stays where it was
                let of_damage = expected.is_some_and(|expected| says(&before, expected)) || says(&after, *value);
                prop_assert!(expected == Some(*value) || of_damage, "{} {}: {:?} gave {} in channel {} of \
                    frame {}, expected {:?}", exporter.format, exporter.variant, accident, value, channel, index, expected);
            }
        }
    }
}
