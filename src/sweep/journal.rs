//! The journal of a study: one line of JSON a point, append-only, in the order in which points were done;
//! enough to go on after a crash.
//!
//! The first line is a header with the fingerprint of the study. Numbers are the shortest decimals that give
//! the same bits back, written as strings, because JSON readers round numbers in the last place and what is
//! taken from a journal must be what was computed.

use super::point::Ended;
use super::{Outcome, Reason, Study};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Version of the journal's layout.
pub const JOURNAL_FORMAT: u32 = 1;

/// First line of a journal.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// Layout, [`JOURNAL_FORMAT`].
    pub sweep_journal: u32,
    /// Fingerprint of study, scene and program.
    pub fingerprint: String,
    /// Version of the program.
    pub version: String,
    /// Points of the grid.
    pub points: usize,
}

/// A journal as read.
#[derive(Debug, Clone, PartialEq)]
pub struct Journal {
    /// What is known of every point, in the order of the grid.
    pub outcomes: Vec<Option<Outcome>>,
    /// Length of the part that ends with a complete line, bytes: the file is cut to it before anything is
    /// appended.
    pub intact_bytes: usize,
    /// Whether an incomplete last line was dropped.
    pub torn: bool,
}

/// Why a journal was refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum JournalError {
    /// It belongs to another study.
    #[error(
        "{file}: fingerprint {found}, expected {expected}: the study, the scene or the program has changed since it was written; leave out --resume to start anew, or undo the change to resume"
    )]
    OtherStudy {
        /// File as named by the user.
        file: String,
        /// Fingerprint in its header.
        found: String,
        /// Fingerprint of this study.
        expected: String,
    },
    /// A line is not what the program writes.
    #[error(
        "{file}:{line}: {problem}; the file was edited or is not a journal: restore it, or leave out --resume to start anew"
    )]
    Line {
        /// File as named by the user.
        file: String,
        /// 1-based line.
        line: usize,
        /// What was found and what was expected.
        problem: String,
    },
}

impl Header {
    /// The header of a study with this fingerprint.
    #[must_use]
    pub fn new(study: &Study, fingerprint: &str) -> Self {
        let version = env!("CARGO_PKG_VERSION").to_owned();
        Self {
            sweep_journal: JOURNAL_FORMAT,
            fingerprint: fingerprint.to_owned(),
            version,
            points: study.points(),
        }
    }

    /// The header as a line of a journal.
    #[must_use]
    pub fn line(&self) -> String {
        line_of(self)
    }
}

/// The outcome of point `index` as a line of a journal.
#[must_use]
pub fn line(index: usize, outcome: &Outcome) -> String {
    let cell = |value: &Result<f64, Reason>| match value {
        Ok(value) => Cell::Value(Exact(*value)),
        Err(reason) => Cell::Missing(Gap { reason: *reason }),
    };
    line_of(&Row {
        index,
        ended: outcome.ended.clone(),
        stopped_at_s: outcome.stopped_at_s.map(Exact),
        values: outcome.values.iter().map(cell).collect(),
    })
}

/// Whether a file may be a journal of a study: it starts like one, or is empty, or is one whose header was
/// never finished.
#[must_use]
pub fn is_one(bytes: &[u8]) -> bool {
    const START: &[u8] = b"{\"sweep_journal\":";
    bytes.starts_with(START) || START.starts_with(bytes)
}

/// Reads the journal of a study; `file` is its name in refusals. An empty text, or one whose header is torn,
/// is `None`.
///
/// # Errors
/// [`JournalError`] for another study, and at the first line that the program did not write; a last line
/// without its newline is dropped.
pub fn read(
    file: &str,
    text: &str,
    study: &Study,
    fingerprint: &str,
) -> Result<Option<Journal>, JournalError> {
    let intact_bytes = text.rfind('\n').map_or(0, |last| last + 1);
    let torn = intact_bytes < text.len();
    let refuse =
        |line: usize, problem: String| JournalError::Line { file: file.to_owned(), line: line + 1, problem };
    let mut lines = text.get(..intact_bytes).unwrap_or_default().lines().enumerate();
    let Some((_, first)) = lines.next() else { return Ok(None) };
    let header: Header = serde_json::from_str(first)
        .map_err(|error| refuse(0, format!("no header of a study's journal: {error}")))?;
    if header.fingerprint != fingerprint {
        return Err(JournalError::OtherStudy {
            file: file.to_owned(),
            found: header.fingerprint,
            expected: fingerprint.to_owned(),
        });
    }
    if header.sweep_journal != JOURNAL_FORMAT {
        return Err(refuse(
            0,
            format!("`sweep_journal`: found {}, expected {JOURNAL_FORMAT}", header.sweep_journal),
        ));
    }
    let mut outcomes = vec![None; study.points()];
    for (at, line) in lines {
        place(line, study, &mut outcomes).map_err(|problem| refuse(at, problem))?;
    }
    Ok(Some(Journal { outcomes, intact_bytes, torn }))
}

fn place(line: &str, study: &Study, outcomes: &mut [Option<Outcome>]) -> Result<(), String> {
    let row: Row = serde_json::from_str(line).map_err(|error| format!("no point: {error}"))?;
    let (index, points) = (row.index, outcomes.len());
    if row.values.len() != study.maps.len() {
        return Err(format!("`values`: found {}, expected {}", row.values.len(), study.maps.len()));
    }
    match outcomes.get_mut(index) {
        None => Err(format!("`index`: found {index}, expected less than {points}")),
        Some(Some(_)) => Err(format!("`index`: found {index} a second time")),
        Some(empty) => {
            *empty = Some(row.into_outcome());
            Ok(())
        }
    }
}

fn line_of<T: Serialize>(value: &T) -> String {
    // string keys and finite numbers only: the writer has nothing to refuse, and a line that it did refuse
    // would be empty
    serde_json::to_string(value).unwrap_or_default() + "\n"
}

/// An outcome as it stands in a line.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    index: usize,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    ended: Option<Ended>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stopped_at_s: Option<Exact>,
    values: Vec<Cell>,
}

impl Row {
    fn into_outcome(self) -> Outcome {
        let value = |cell: Cell| match cell {
            Cell::Value(value) => Ok(value.0),
            Cell::Missing(gap) => Err(gap.reason),
        };
        Outcome {
            ended: self.ended,
            stopped_at_s: self.stopped_at_s.map(|at| at.0),
            values: self.values.into_iter().map(value).collect(),
        }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Cell {
    Value(Exact),
    Missing(Gap),
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Gap {
    reason: Reason,
}

/// A finite number as the shortest decimal that gives the same bits back, in quotes.
struct Exact(f64);

impl Serialize for Exact {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&format_args!("{:?}", self.0))
    }
}

impl<'de> Deserialize<'de> for Exact {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(Self(number)),
            _ => Err(D::Error::custom(format!("found \"{text}\", expected a finite number in quotes"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn study() -> Study {
        let text = "format = 1\ntitle = \"\"\nscene = \"x\"\n[camera]\nframe_rate_hz = 1e3\nexposure_s = 0.0\n\
                    [[axis]]\nname = \"friction.a\"\nfrom = 0.0\nto = 1.0\npoints = 200\n\
                    [[map]]\nname = \"a\"\nkind = \"stick-fraction\"\n[[map]]\nname = \"b\"\nkind = \"jam\"\n";
        Study::parse("s", text).unwrap()
    }

    fn outcome(index: usize) -> Outcome {
        let share = (index as f64 * 0.618_033_988_749_894_9).fract();
        let why = if index.is_multiple_of(2) { String::new() } else { "a \"why\"".to_owned() };
        let ended = index.is_multiple_of(3).then_some(Ended { reason: Reason::ContactLost, why });
        Outcome {
            ended,
            stopped_at_s: (!index.is_multiple_of(5)).then_some(1e-300 * share),
            values: vec![Ok(1e23 * share / 7.0), Err(Reason::Never)],
        }
    }

    fn text(points: impl Iterator<Item = usize>) -> String {
        Header::new(&study(), "f").line()
            + &points.map(|index| line(index, &outcome(index))).collect::<String>()
    }

    fn read_back(text: &str) -> Result<Option<Journal>, JournalError> {
        read("j", text, &study(), "f")
    }

    #[test]
    fn every_bit_survives_in_any_order_of_the_points() {
        let journal = read_back(&text((0..200).rev())).unwrap().unwrap();
        assert!(journal.outcomes.into_iter().enumerate().all(|(index, found)| found == Some(outcome(index))));
    }

    #[test]
    fn a_torn_last_line_is_dropped_and_said() {
        let (whole, one) = (text([7, 3].into_iter()), text([7].into_iter()));
        for cut in one.len() + 1..whole.len() {
            let journal = read_back(&whole[..cut]).unwrap().unwrap();
            assert_eq!(
                (journal.outcomes.iter().flatten().count(), journal.torn, journal.intact_bytes),
                (1, true, one.len())
            );
        }
        assert_eq!([read_back(""), read_back("{\"sweep_journal\":1")], [Ok(None), Ok(None)]);
    }

    #[test]
    fn a_journal_is_known_by_its_start() {
        let whole = text([0].into_iter());
        assert!((0..whole.len()).all(|cut| is_one(&whole.as_bytes()[..cut])));
        assert!(!is_one(b"{\"journal\":1,") && !is_one(b"time_s,tip_x_m\n"));
    }

    #[test]
    fn another_study_and_damage_are_refused() {
        let good = text([0, 1].into_iter());
        let refused = |text: &str| read_back(text).unwrap_err().to_string();
        assert!(
            read("j", &good, &study(), "g")
                .unwrap_err()
                .to_string()
                .contains("j: fingerprint f, expected g: the study, the scene or the program")
        );
        assert!(refused("time_s,tip_x_m\n").starts_with("j:1: no header of a study's journal"));
        assert!(
            refused(&good.replacen("\"values\"", "\"valus\"", 1))
                .starts_with("j:2: no point: unknown field `valus`")
        );
        assert!(
            refused(&good.replacen("\"index\":1", "\"index\":0", 1))
                .starts_with("j:3: `index`: found 0 a second time")
        );
        assert!(
            refused(&good.replacen("\"index\":1", "\"index\":200", 1))
                .contains("found 200, expected less than 200")
        );
        assert!(
            refused(&good.replacen("\"sweep_journal\":1", "\"sweep_journal\":2", 1))
                .contains("found 2, expected 1")
        );
    }
}
