//! Journal lines: how evaluations are written so that every bit comes back, and how a file of them is read.

use super::{Entry, Header, JOURNAL_FORMAT, Journal, JournalError};
use crate::fit::journal::Stage;
use crate::fit::objective::{Evaluation, Observed, RunFailure, Sight};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Line of a journal on which its first evaluation stands, counted from 1.
pub(super) const FIRST_LINE: usize = 2;

/// The header as a line of a journal.
#[must_use]
pub fn header_line(header: &Header) -> String {
    line_of(header)
}

/// Evaluation number `index` (0-based) as a line of a journal; `from` is the seed of the search that made it,
/// where that is another one than the header's.
#[must_use]
pub fn entry_line(index: usize, stage: Stage, from: Option<u64>, evaluation: &Evaluation) -> String {
    let exact = |numbers: &[f64]| numbers.iter().copied().map(Exact).collect::<Vec<_>>();
    let features = evaluation.features.iter().map(|f| match f {
        Observed::Seen(Sight { value, spread: 0.0, below_db: 0.0 }) => Feature::Value(Exact(*value)),
        Observed::Seen(seen) => Feature::Seen {
            value: Exact(seen.value),
            spread: Exact(seen.spread),
            below_db: Exact(seen.below_db),
        },
        Observed::Missing(missing) => Feature::Missing { missing: missing.clone() },
    });
    line_of(&Row {
        index,
        stage,
        from,
        unit: exact(&evaluation.unit),
        values: exact(&evaluation.values),
        cost: Exact(evaluation.cost),
        features: features.collect(),
        failure: evaluation.failure.as_ref().map(|f| Failed {
            reason: f.reason.clone(),
            message: f.message.clone(),
            progress: Exact(f.progress),
        }),
    })
}

/// Reads a journal; `file` is its name in refusals. An empty file, or one whose header is torn, is `None`.
///
/// What follows the last complete line is dropped: part of a line that was being written when the program was
/// killed, and the zero bytes that a file system may leave in its place when the power fails.
///
/// # Errors
/// [`JournalError`] at the first complete line that the program did not write.
pub fn read(file: &str, bytes: impl AsRef<[u8]>) -> Result<Option<Journal>, JournalError> {
    let bytes = bytes.as_ref();
    let intact_bytes = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1);
    let torn = intact_bytes < bytes.len();
    let refuse = |line: usize, problem: String| JournalError::Line { file: file.to_owned(), line, problem };
    let mut lines = bytes[..intact_bytes].split_inclusive(|byte| *byte == b'\n').zip(1..);
    let Some((first, _)) = lines.next() else { return Ok(None) };
    let header = header(first).map_err(|problem| refuse(1, problem))?;
    let entries = lines.map(|(line, number)| {
        entry(&header, number - FIRST_LINE, line).map_err(|problem| refuse(number, problem))
    });
    Ok(Some(Journal { entries: entries.collect::<Result<_, _>>()?, header, intact_bytes, torn }))
}

/// An editor may have put a byte-order mark before it.
fn header(line: &[u8]) -> Result<Header, String> {
    let line = line.strip_prefix("\u{feff}".as_bytes()).unwrap_or(line);
    let header: Header = serde_json::from_slice(line).map_err(|e| format!("no journal header: {e}"))?;
    if header.journal == JOURNAL_FORMAT {
        return Ok(header);
    }
    Err(format!("`journal`: found {}, expected {JOURNAL_FORMAT}", header.journal))
}

fn entry(header: &Header, index: usize, line: &[u8]) -> Result<Entry, String> {
    let row: Row = serde_json::from_slice(line).map_err(|e| format!("no evaluation: {e}"))?;
    if row.index != index {
        return Err(format!("`index`: found {}, expected {index}", row.index));
    }
    let counts = [("unit", row.unit.len()), ("values", row.values.len())];
    if let Some((name, found)) = counts.into_iter().find(|(_, found)| *found != header.parameters.len()) {
        return Err(format!("`{name}`: found {found} numbers, expected {}", header.parameters.len()));
    }
    if row.failure.is_none() && row.features.len() != header.features.len() {
        return Err(format!("`features`: found {}, expected {}", row.features.len(), header.features.len()));
    }
    if let Some(outside) = row.unit.iter().find(|u| !(0.0..=1.0).contains(&u.0)) {
        return Err(format!("`unit`: found {}, expected 0 to 1", outside.0));
    }
    let from = row.from.filter(|seed| *seed != header.seed);
    Ok(Entry { stage: row.stage, from, evaluation: row.into_evaluation() })
}

fn line_of<T: Serialize>(value: &T) -> String {
    // string keys and finite numbers only: the writer has nothing to refuse, and a line that it did refuse
    // would be empty
    serde_json::to_string(value).unwrap_or_default() + "\n"
}

/// An evaluation as it stands in a line.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    index: usize,
    stage: Stage,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    from: Option<u64>,
    unit: Vec<Exact>,
    values: Vec<Exact>,
    cost: Exact,
    features: Vec<Feature>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    failure: Option<Failed>,
}

impl Row {
    fn into_evaluation(self) -> Evaluation {
        let plain = |numbers: Vec<Exact>| numbers.into_iter().map(|n| n.0).collect();
        let features = self.features.into_iter().map(|f| match f {
            Feature::Value(value) => Observed::of(value.0),
            Feature::Seen { value, spread, below_db } => {
                Observed::Seen(Sight { value: value.0, spread: spread.0, below_db: below_db.0 })
            }
            Feature::Missing { missing } => Observed::Missing(missing),
        });
        Evaluation {
            features: features.collect(),
            unit: plain(self.unit),
            values: plain(self.values),
            cost: self.cost.0,
            global_cost: self.cost.0, // the ledger prices what it replays
            failure: self.failure.map(|f| RunFailure {
                reason: f.reason,
                message: f.message,
                progress: f.progress.0,
            }),
        }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Feature {
    Value(Exact),
    Seen { value: Exact, spread: Exact, below_db: Exact },
    Missing { missing: String },
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Failed {
    reason: String,
    message: String,
    progress: Exact,
}

/// A finite number as the shortest decimal that gives the same bits back.
#[derive(Clone, Copy)]
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
