//! The journal: one line of JSON an evaluation, append-only, enough to resume, extend, merge and audit a fit.
//!
//! The first line is a header with the fingerprint of the fit. Numbers are the shortest decimals that give the same bits
//! back, written as strings, because JSON readers round numbers in the last place and a replay must not.

use super::objective::{Evaluation, Observed, RunFailure, Sight};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use sha2::{Digest, Sha256};
use std::collections::HashMap;
use std::collections::hash_map::Entry as Slot;

/// Version of the journal's layout.
pub const JOURNAL_FORMAT: u32 = 1;

/// Where journal lines go; the program writes each to a file and flushes it.
pub trait Sink: Send {
    /// Appends one line, which ends with its newline.
    ///
    /// # Errors
    /// The reason in words; the fit stops.
    fn append(&mut self, line: &str) -> Result<(), String>;
}

/// What decides the outcome of a fit: if all of it is the same, so is the result.
#[derive(Debug, Clone, Copy)]
pub struct Ingredients<'a> {
    /// Text of what the job asks for, its budgets and its seed left out.
    pub job: &'a str,
    /// Text of the scene, with everything that it refers to.
    pub scene: &'a str,
    /// Bytes of every recording, in job order.
    pub data: &'a [&'a [u8]],
    /// Version of the program.
    pub version: &'a str,
}

/// SHA-256 over the ingredients, each preceded by its length, in hexadecimal.
#[must_use]
pub fn fingerprint(of: &Ingredients) -> String {
    let mut hash = Sha256::new();
    let parts = [of.job.as_bytes(), of.scene.as_bytes(), of.version.as_bytes()];
    for part in parts.into_iter().chain(of.data.iter().copied()) {
        hash.update((part.len() as u64).to_le_bytes());
        hash.update(part);
    }
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// First line of a journal.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// Layout, [`JOURNAL_FORMAT`].
    pub journal: u32,
    /// Fingerprint of problem, data and program.
    pub fingerprint: String,
    /// Version of the program.
    pub version: String,
    /// Seed of the search.
    pub seed: u64,
    /// Names of the free parameters, in the order of the coordinates.
    pub parameters: Vec<String>,
    /// Names of the targets, in the order of the features.
    pub features: Vec<String>,
}

/// What an evaluation was made for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// Probes of what the features can determine, before the search.
    Gate,
    /// The swarm over the whole box.
    Global,
    /// From one of the best points downhill.
    Local,
    /// Differences around the best point.
    Sensitivity,
    /// Along one parameter, the others following.
    Profile,
    /// A twin of the best model fitted again.
    Bootstrap,
}

impl Stage {
    /// The word in files and on a terminal.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Gate => "gate",
            Self::Global => "global",
            Self::Local => "local",
            Self::Sensitivity => "sensitivity",
            Self::Profile => "profile",
            Self::Bootstrap => "bootstrap",
        }
    }
}

/// One evaluation in a journal.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// What it was made for.
    pub stage: Stage,
    /// The evaluation.
    pub evaluation: Evaluation,
}

/// A journal as read.
#[derive(Debug, Clone, PartialEq)]
pub struct Journal {
    /// Its header.
    pub header: Header,
    /// Its evaluations, in file order.
    pub entries: Vec<Entry>,
    /// Length of the part that ends with a complete line, bytes: the file is cut to it before anything is appended.
    pub intact_bytes: usize,
    /// Whether an incomplete last line was dropped.
    pub torn: bool,
}

/// Why a journal was refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum JournalError {
    /// It belongs to another fit.
    #[error(
        "{file}: fingerprint {found}, expected {expected}: the job, the scene, the data, the seed or the program has changed since it was written; move it away to start anew, or undo the change to resume"
    )]
    OtherFit {
        /// File as named by the user.
        file: String,
        /// Fingerprint in its header.
        found: String,
        /// Fingerprint of this fit.
        expected: String,
    },
    /// A line is not what the program writes.
    #[error("{file}:{line}: {problem}; the file was edited or is not a journal: restore it, or move it away to start anew")]
    Line {
        /// File as named by the user.
        file: String,
        /// 1-based line.
        line: usize,
        /// What was found and what was expected.
        problem: String,
    },
    /// Two journals disagree about one point.
    #[error("{file}: evaluation {index} has cost {found}, the other journal has {expected} at the same point; they are not of the same program and data")]
    Conflict {
        /// File as named by the user.
        file: String,
        /// 0-based evaluation in that file.
        index: usize,
        /// Its cost, as text.
        found: String,
        /// Cost in the other journal, as text.
        expected: String,
    },
}

/// Exact coordinates of a point of the unit box, for look-up.
#[must_use]
pub fn key(unit: &[f64]) -> Vec<u64> {
    unit.iter().map(|u| u.to_bits()).collect()
}

/// The header as a line of a journal.
#[must_use]
pub fn header_line(header: &Header) -> String {
    line_of(header)
}

/// Evaluation number `index` (0-based) as a line of a journal.
#[must_use]
pub fn entry_line(index: usize, stage: Stage, evaluation: &Evaluation) -> String {
    let exact = |numbers: &[f64]| numbers.iter().copied().map(Exact).collect::<Vec<_>>();
    let features = evaluation.features.iter().map(|f| match f {
        Observed::Seen(Sight { value, spread: 0.0, below_db: 0.0 }) => Feature::Value(Exact(*value)),
        Observed::Seen(seen) => Feature::Seen { value: Exact(seen.value), spread: Exact(seen.spread), below_db: Exact(seen.below_db) },
        Observed::Missing(missing) => Feature::Missing { missing: missing.clone() },
    });
    line_of(&Row {
        index,
        stage,
        unit: exact(&evaluation.unit),
        values: exact(&evaluation.values),
        cost: Exact(evaluation.cost),
        features: features.collect(),
        failure: evaluation.failure.as_ref().map(|f| Failed { reason: f.reason.clone(), message: f.message.clone(), progress: Exact(f.progress) }),
    })
}

/// Reads a journal; `file` is its name in refusals. An empty text, or one whose header is torn, is `None`.
///
/// # Errors
/// [`JournalError`] at the first line that the program did not write; a last line without its newline is dropped instead.
pub fn read(file: &str, text: &str) -> Result<Option<Journal>, JournalError> {
    let intact_bytes = text.rfind('\n').map_or(0, |last| last + 1);
    let torn = intact_bytes < text.len();
    let mut lines = text[..intact_bytes].lines().enumerate();
    let Some((_, first)) = lines.next() else { return Ok(None) };
    let refuse = |line: usize, problem: String| JournalError::Line { file: file.to_owned(), line: line + 1, problem };
    let header: Header = serde_json::from_str(first).map_err(|e| refuse(0, format!("no journal header: {e}")))?;
    if header.journal != JOURNAL_FORMAT {
        return Err(refuse(0, format!("`journal`: found {}, expected {JOURNAL_FORMAT}", header.journal)));
    }
    let entries = lines.map(|(at, line)| entry(&header, at - 1, line).map_err(|problem| refuse(at, problem))).collect::<Result<_, _>>()?;
    Ok(Some(Journal { header, entries, intact_bytes, torn }))
}

/// Refuses a journal of another fit.
///
/// # Errors
/// [`JournalError::OtherFit`].
pub fn check_fingerprint(file: &str, journal: &Journal, expected: &str) -> Result<(), JournalError> {
    if journal.header.fingerprint == expected {
        return Ok(());
    }
    Err(JournalError::OtherFit { file: file.to_owned(), found: journal.header.fingerprint.clone(), expected: expected.to_owned() })
}

/// All evaluations of `first`, then those of `second` at new points, as the text of a journal.
///
/// # Errors
/// [`JournalError`] when they are of different fits or disagree; `file` names the second.
pub fn merge(first: &Journal, second: &Journal, file: &str) -> Result<String, JournalError> {
    check_fingerprint(file, second, &first.header.fingerprint)?;
    let mut seen: HashMap<Vec<u64>, f64> = HashMap::new();
    let mut text = header_line(&first.header);
    for (at, entry) in first.entries.iter().chain(&second.entries).enumerate() {
        let cost = entry.evaluation.cost;
        match seen.entry(key(&entry.evaluation.unit)) {
            Slot::Occupied(known) if *known.get() == cost => {}
            Slot::Occupied(known) => {
                let index = at.saturating_sub(first.entries.len());
                return Err(JournalError::Conflict { file: file.to_owned(), index, found: cost.to_string(), expected: known.get().to_string() });
            }
            Slot::Vacant(slot) => {
                slot.insert(cost);
                text += &entry_line(seen.len() - 1, entry.stage, &entry.evaluation);
            }
        }
    }
    Ok(text)
}

fn entry(header: &Header, index: usize, line: &str) -> Result<Entry, String> {
    let row: Row = serde_json::from_str(line).map_err(|e| format!("no evaluation: {e}"))?;
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
    Ok(Entry { stage: row.stage, evaluation: row.into_evaluation() })
}

fn line_of<T: Serialize>(value: &T) -> String {
    // string keys and finite numbers only: the writer has nothing to refuse, and a line that it did refuse would be empty
    serde_json::to_string(value).unwrap_or_default() + "\n"
}

/// An evaluation as it stands in a line.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    index: usize,
    stage: Stage,
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
            Feature::Seen { value, spread, below_db } => Observed::Seen(Sight { value: value.0, spread: spread.0, below_db: below_db.0 }),
            Feature::Missing { missing } => Observed::Missing(missing),
        });
        Evaluation {
            features: features.collect(),
            unit: plain(self.unit),
            values: plain(self.values),
            cost: self.cost.0,
            global_cost: self.cost.0, // the ledger prices what it replays
            failure: self.failure.map(|f| RunFailure { reason: f.reason, message: f.message, progress: f.progress.0 }),
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

#[cfg(test)]
mod tests {
    use super::*;

    fn header(fingerprint: &str) -> Header {
        let (parameters, features) = (vec!["a".to_owned(), "b".to_owned()], vec!["low".to_owned(), "high".to_owned()]);
        Header { journal: JOURNAL_FORMAT, fingerprint: fingerprint.to_owned(), version: "0.1.0".to_owned(), seed: 1, parameters, features }
    }

    fn evaluation(u: f64) -> Evaluation {
        let features = vec![Observed::of(1e23 * u), Observed::Missing("no peak".to_owned())];
        Evaluation { unit: vec![u, 0.1 + 0.2], values: vec![5e-324, -u / 3.0], cost: u / 7.0, global_cost: u / 7.0, features, failure: None }
    }

    fn text(units: &[f64]) -> String {
        let lines = units.iter().enumerate().map(|(i, u)| entry_line(i, Stage::Global, &evaluation(*u)));
        header_line(&header("f")) + &lines.collect::<String>()
    }

    #[test]
    fn every_bit_survives() {
        let units: Vec<f64> = (0..200).map(|i| (f64::from(i) * 0.618_033_988_749_894_9).fract()).collect();
        let journal = read("j", &text(&units)).unwrap().unwrap();
        assert_eq!((journal.entries.len(), journal.torn), (200, false));
        for (entry, u) in journal.entries.iter().zip(&units) {
            assert_eq!(entry.evaluation, evaluation(*u));
        }
        let failed = Evaluation { failure: Some(RunFailure::new("jammed", "at 0.1 s", 0.3)), features: vec![], ..evaluation(0.5) };
        let line = header_line(&header("f")) + &entry_line(0, Stage::Local, &failed);
        assert_eq!(read("j", &line).unwrap().unwrap().entries, vec![Entry { stage: Stage::Local, evaluation: failed }]);
    }

    #[test]
    fn a_torn_last_line_is_dropped_and_said() {
        let whole = text(&[0.25, 0.75]);
        let one = text(&[0.25]);
        for cut in one.len() + 1..whole.len() {
            let journal = read("j", &whole[..cut]).unwrap().unwrap();
            assert_eq!((journal.entries.len(), journal.torn, journal.intact_bytes), (1, true, one.len()));
        }
        assert_eq!(read("j", "").unwrap(), None);
        assert_eq!(read("j", "{\"journal\":1").unwrap(), None);
    }

    #[test]
    fn damage_elsewhere_is_refused_with_its_line() {
        let refused = |text: &str| read("j", text).unwrap_err().to_string();
        let good = text(&[0.25, 0.75]);
        let cut = good.replacen("\"stage\"", "\"stag\"", 1);
        assert!(refused(&cut).starts_with("j:2: no evaluation: unknown field `stag`"), "{}", refused(&cut));
        let skipped = good.lines().enumerate().filter(|(i, _)| *i != 1).map(|(_, l)| format!("{l}\n")).collect::<String>();
        assert!(refused(&skipped).starts_with("j:2: `index`: found 1, expected 0;"), "{}", refused(&skipped));
        assert!(refused(&good.replacen("\"0.25\"", "\"1.25\"", 1)).contains("`unit`: found 1.25, expected 0 to 1"));
        assert!(refused(&good.replacen("\"0.25\"", "\"inf\"", 1)).contains("expected a finite number"));
        assert!(refused("time_s,tip_x_m\n").starts_with("j:1: no journal header"));
    }

    #[test]
    fn a_journal_of_another_fit_is_refused() {
        let journal = read("j", &text(&[0.5])).unwrap().unwrap();
        assert!(check_fingerprint("j", &journal, "f").is_ok());
        assert!(check_fingerprint("j", &journal, "g").unwrap_err().to_string().contains("move it away to start anew"));
    }

    #[test]
    fn merging_keeps_each_point_once() {
        let read = |units: &[f64]| read("j", &text(units)).unwrap().unwrap();
        assert_eq!(merge(&read(&[0.25, 0.5]), &read(&[0.5, 0.75]), "b").unwrap(), text(&[0.25, 0.5, 0.75]));
        let mut other = read(&[0.75, 0.5]);
        other.entries[1].evaluation.cost = 9.0;
        assert!(matches!(merge(&read(&[0.5]), &other, "b"), Err(JournalError::Conflict { index: 1, .. })));
    }

    #[test]
    fn the_fingerprint_sees_every_ingredient_and_their_borders() {
        let base = Ingredients { job: "ab", scene: "c", data: &[b"d", b"e"], version: "1" };
        let others = [
            Ingredients { job: "a", scene: "bc", ..base },
            Ingredients { data: &[b"de"], ..base },
            Ingredients { data: &[b"e", b"d"], ..base },
            Ingredients { version: "2", ..base },
        ];
        assert_eq!(fingerprint(&base).len(), 64);
        assert!(others.iter().all(|other| fingerprint(other) != fingerprint(&base)));
    }
}
