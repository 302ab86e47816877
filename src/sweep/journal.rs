//! Points of a study in a journal, in the order in which they were done.

use super::point::Ended;
use super::{Map, Outcome, Reason, Study};
use crate::journal::{self, Exact, Kind, Record};
use serde::{Deserialize, Serialize};

/// The journal of a study.
pub type Journal = journal::Journal<Point>;
/// Its header.
pub type Header = journal::Header<Body>;

/// What the header of a study says besides.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Points of the grid.
    pub points: usize,
    /// Columns of the maps, in the order of the values.
    pub maps: Vec<String>,
}

/// One point in a journal.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Its place in the grid, counted from 0.
    pub index: usize,
    /// What it gave.
    pub outcome: Outcome,
}

/// The header of a study with this fingerprint.
#[must_use]
pub fn header(study: &Study, fingerprint: &str) -> Header {
    let body = Body { points: study.points(), maps: study.maps.iter().map(Map::column).collect() };
    Header::of::<Point>(fingerprint, env!("CARGO_PKG_VERSION"), body)
}

/// What a journal knows of every point, in the order of the grid.
#[must_use]
pub fn outcomes(journal: Journal) -> Vec<Option<Outcome>> {
    let mut outcomes = vec![None; journal.header.body.points];
    for Point { index, outcome } in journal.records {
        outcomes[index] = Some(outcome);
    }
    outcomes
}

impl Record for Point {
    const KIND: Kind = Kind::Sweep;
    type Body = Body;
    type Row = Row;
    type Identity = usize;

    fn identity(&self) -> usize {
        self.index
    }

    fn to_row(&self, _: usize) -> Row {
        let Outcome { ended, stopped_at_s, values } = &self.outcome;
        let cell = |value: &Result<f64, Reason>| match value {
            Ok(value) => Cell::Value(Exact(*value)),
            Err(reason) => Cell::Missing(Gap { reason: *reason }),
        };
        Row {
            index: self.index,
            ended: ended.clone(),
            stopped_at_s: stopped_at_s.map(Exact),
            values: values.iter().map(cell).collect(),
        }
    }

    fn from_row(row: Row, _: usize, body: &Body) -> Result<Self, String> {
        if row.values.len() != body.maps.len() {
            return Err(format!("`values`: found {}, expected {}", row.values.len(), body.maps.len()));
        }
        if row.index >= body.points {
            return Err(format!("`index`: found {}, expected less than {}", row.index, body.points));
        }
        Ok(Self { index: row.index, outcome: row.into_outcome() })
    }

    fn difference(&self, other: &Self) -> Option<[String; 2]> {
        (self.outcome != other.outcome).then(|| [self, other].map(|point| format!("{:?}", point.outcome)))
    }

    fn other_problem(found: &Body, expected: &Body) -> Option<String> {
        (found != expected).then(|| "the header has other points or maps than the study".to_owned())
    }
}

/// An outcome as it stands in a line.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::journal::{JournalError, header_line, kind_of, line, merge, read};

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
        let point = |index| line(&Point { index, outcome: outcome(index) }, 0);
        header_line(&header(&study(), "f")) + &points.map(point).collect::<String>()
    }

    fn read_back(text: &str) -> Result<Option<Journal>, JournalError> {
        read("j", text)
    }

    #[test]
    fn every_bit_survives_in_any_order_of_the_points() {
        let journal = read_back(&text((0..200).rev())).unwrap().unwrap();
        assert!(
            outcomes(journal).into_iter().enumerate().all(|(index, found)| found == Some(outcome(index)))
        );
    }

    #[test]
    fn a_torn_last_line_is_dropped_and_said() {
        let (whole, one) = (text([7, 3].into_iter()), text([7].into_iter()));
        for cut in one.len() + 1..whole.len() {
            let journal = read_back(&whole[..cut]).unwrap().unwrap();
            assert_eq!((journal.records.len(), journal.torn, journal.intact_bytes), (1, true, one.len()));
        }
        assert_eq!([read_back(""), read_back("{\"journal\":\"sweep\"")], [Ok(None), Ok(None)]);
    }

    #[test]
    fn a_journal_is_known_by_its_first_line() {
        assert_eq!(kind_of(text([0].into_iter()).as_bytes()), Some(Kind::Sweep));
        assert_eq!(kind_of(b"{\"sweep_journal\":1,\"fingerprint\":\"f\"}\n"), Some(Kind::Sweep));
        assert_eq!(kind_of(b"{\"journal\":1,\"fingerprint\":\"f\"}\n"), Some(Kind::Fit));
        assert_eq!([&b"time_s,tip_x_m\n"[..], b"{}\n", b"{\"journal\":"].map(kind_of), [None; 3]);
    }

    #[test]
    fn journals_of_parts_of_a_grid_are_merged() {
        let parts =
            [text([4, 0].into_iter()), text([0, 7].into_iter())].map(|t| read_back(&t).unwrap().unwrap());
        let merged = merge(&[("a", &parts[0]), ("b", &parts[1])]).unwrap();
        assert_eq!((merged.text, merged.new), (text([4, 0, 7].into_iter()), vec![2, 1]));
        let mut other = parts[1].clone();
        other.records[0].outcome.stopped_at_s = Some(9.0);
        let refused = merge(&[("a", &parts[0]), ("b", &other)]).unwrap_err().to_string();
        assert!(refused.starts_with("b:2: Outcome") && refused.contains("but a:3 has Outcome"), "{refused}");
    }

    #[test]
    fn another_study_and_damage_are_refused() {
        let good = text([0, 1].into_iter());
        let refused = |text: &str| read_back(text).unwrap_err().to_string();
        let other = read_back(&good).unwrap().unwrap().check_problem("j", &header(&study(), "g"));
        assert!(
            other
                .unwrap_err()
                .to_string()
                .contains("j: fingerprint f, expected g: the study, a scene or a recording")
        );
        assert!(refused("time_s,tip_x_m\n").starts_with("j:1: no journal header"));
        assert!(
            refused(&good.replacen("\"values\"", "\"valus\"", 1))
                .starts_with("j:2: no point: unknown field `valus`")
        );
        assert!(
            refused(&good.replacen("\"index\":1", "\"index\":0", 1))
                .starts_with("j:3: the point of line 2 a second time")
        );
        assert!(
            refused(&good.replacen("\"index\":1", "\"index\":200", 1))
                .contains("found 200, expected less than 200")
        );
        assert!(
            refused(&good.replacen("\"layout\":2", "\"layout\":3", 1))
                .contains("a journal of layout 3, this program reads layout 2")
        );
    }
}
