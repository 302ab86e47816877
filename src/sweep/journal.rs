//! Journal of a study: its points in the order in which they finished.

use super::grid::{AxisSpacing, SweepAxis};
use super::point::{EarlyEnd, PointOutcome};
use super::study::Study;
use super::{MissingReason, SamplePlan, SweepMap};
use crate::checkpoint::{self, CheckpointError, CheckpointKind, CheckpointRecord, StoredRecord};
use crate::simulate::scene::Scene;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// The journal of a study.
pub type SweepJournal = checkpoint::CheckpointFile<SweepPoint>;
pub(crate) type SweepHeader = checkpoint::CheckpointHeader<SweepHeaderBody>;

/// Part of the header that only studies have.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SweepHeaderBody {
    /// Number of points.
    pub points: usize,
    /// Axes; the first one changes slowest.
    pub axes: Vec<AxisRecord>,
    /// Plan of a sampled study; `None` for a grid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sample: Option<SamplePlan>,
    /// Names of the columns of the maps, in the order of the values of a point.
    pub maps: Vec<String>,
}

/// A parameter and its values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisRecord {
    /// Name of the parameter.
    pub name: String,
    /// Unit for display; `1` for a plain number.
    pub unit: String,
    /// Spacing of the values.
    #[serde(default, skip_serializing_if = "is_linear")]
    pub scale: AxisSpacing,
    /// Rising values.
    pub values: Vec<f64>,
}

fn is_linear(spacing: &AxisSpacing) -> bool {
    *spacing == AxisSpacing::Linear
}

/// One point in a journal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "PointRow", into = "PointRow")]
pub struct SweepPoint {
    /// Index in the study, counted from 0.
    pub index: usize,
    /// Readings, or the reason why the run ended early.
    pub outcome: PointOutcome,
}

/// Header of the journal of a study with this fingerprint.
#[must_use]
pub fn study_header(study: &Study, fingerprint: &str) -> SweepHeader {
    let axis = |axis: &SweepAxis| AxisRecord {
        name: axis.parameter.name.to_owned(),
        unit: axis.parameter.unit.to_owned(),
        scale: if study.sample.is_some() { axis.spacing } else { AxisSpacing::Linear },
        values: axis.values.clone(),
    };
    let body = SweepHeaderBody {
        points: study.point_count(),
        axes: study.axes.iter().map(axis).collect(),
        sample: study.sample,
        maps: study.maps.iter().map(SweepMap::column).collect(),
    };
    SweepHeader::new::<SweepPoint>(fingerprint, env!("CARGO_PKG_VERSION"), body)
}

impl CheckpointRecord for SweepPoint {
    const KIND: CheckpointKind = CheckpointKind::Sweep;
    type Body = SweepHeaderBody;
    type Identity = usize;

    fn identity(&self) -> usize {
        self.index
    }

    fn check_against(&self, body: &SweepHeaderBody) -> Result<(), String> {
        let (index, values) = (self.index, self.outcome.values.len());
        if values != body.maps.len() {
            return Err(format!("`values`: found {values}, expected {}", body.maps.len()));
        }
        if index >= body.points {
            return Err(format!("`index`: found {index}, expected less than {}", body.points));
        }
        Ok(())
    }

    fn problem_difference(found: &SweepHeaderBody, expected: &SweepHeaderBody) -> Option<String> {
        (found != expected).then(|| "the header has other axes or maps than the study".to_owned())
    }
}

impl From<SweepPoint> for PointRow {
    fn from(SweepPoint { index, outcome }: SweepPoint) -> Self {
        let PointOutcome { ended, stopped_at_s, values } = outcome;
        let cell = |value| match value {
            Ok(value) => ValueCell::Value(value),
            Err(reason) => ValueCell::Missing { reason },
        };
        Self { index, ended, stopped_at_s, values: values.into_iter().map(cell).collect() }
    }
}

impl From<PointRow> for SweepPoint {
    fn from(PointRow { index, ended, stopped_at_s, values }: PointRow) -> Self {
        let value = |cell| match cell {
            ValueCell::Value(value) => Ok(value),
            ValueCell::Missing { reason } => Err(reason),
        };
        let values = values.into_iter().map(value).collect();
        Self { index, outcome: PointOutcome { ended, stopped_at_s, values } }
    }
}

/// A point as written in a line of the journal.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointRow {
    index: usize,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    ended: Option<EarlyEnd>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stopped_at_s: Option<f64>,
    values: Vec<ValueCell>,
}

#[derive(Serialize, Deserialize)]
#[serde(untagged, deny_unknown_fields)]
enum ValueCell {
    Value(f64),
    Missing { reason: MissingReason },
}

// Check of a resumed study: some points of its journal are computed again.

/// A random selection of points of a journal (reservoir sampling); all points are equally likely to be
/// selected.
#[derive(Debug)]
pub(crate) struct PointRecheck {
    drawn: Vec<StoredRecord<SweepPoint>>,
    offered: usize,
    generator: Xoshiro256PlusPlus,
}

impl PointRecheck {
    /// An empty selection; different values of `seed` select different points.
    pub(crate) fn new(seed: u64) -> Self {
        Self { drawn: Vec::new(), offered: 0, generator: Xoshiro256PlusPlus::seed_from_u64(seed) }
    }

    /// Adds the next point of the journal to the selection, or leaves it out.
    pub(crate) fn offer_point(&mut self, found: StoredRecord<SweepPoint>) {
        self.offered += 1;
        if self.drawn.len() < checkpoint::RECHECKED_RECORDS {
            self.drawn.push(found);
        } else if let Some(place) = self.drawn.get_mut(self.generator.random_range(0..self.offered)) {
            *place = found;
        }
    }

    /// Computes the selected points again and compares every bit. `file` is the name of the journal in
    /// errors.
    ///
    /// # Errors
    /// [`CheckpointError::Recomputed`] at the first difference.
    pub(crate) fn check_points(
        &self,
        study: &Study,
        scene: &Scene,
        file: &str,
    ) -> Result<(), CheckpointError> {
        let check = |found: &StoredRecord<SweepPoint>| {
            let index = found.record.index;
            let outcome = PointOutcome::run_point(study, scene, index);
            checkpoint::check_recomputed(file, found, &SweepPoint { index, outcome })
        };
        let checked: Vec<Result<(), CheckpointError>> = self.drawn.par_iter().map(check).collect();
        checked.into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checkpoint::{
        CheckpointError, detect_kind, format_header_line, format_record_line, read_checkpoint,
    };

    fn study() -> Study {
        let text = "format = 1\ntitle = \"\"\nscene = \"x\"\n[camera]\nframe_rate_hz = 1e3\nexposure_s = 0.0\n\
                    [[axis]]\nname = \"friction.a\"\nfrom = 0.0\nto = 1.0\npoints = 200\n\
                    [[map]]\nname = \"a\"\nkind = \"stick-fraction\"\n[[map]]\nname = \"b\"\nkind = \"jam\"\n";
        Study::parse("s", text).unwrap()
    }

    fn outcome(index: usize) -> PointOutcome {
        let share = (index as f64 * 0.618_033_988_749_894_9).fract();
        let why = if index.is_multiple_of(2) { String::new() } else { "a \"why\"".to_owned() };
        let ended = index.is_multiple_of(3).then_some(EarlyEnd { reason: MissingReason::ContactLost, why });
        PointOutcome {
            ended,
            stopped_at_s: (!index.is_multiple_of(5)).then_some(1e-300 * share),
            values: vec![Ok(1e23 * share / 7.0), Err(MissingReason::Never)],
        }
    }

    fn text(points: impl Iterator<Item = usize>) -> String {
        let point = |index| format_record_line(&SweepPoint { index, outcome: outcome(index) });
        format_header_line(&study_header(&study(), "f")) + &points.map(point).collect::<String>()
    }

    fn read_back(text: &str) -> Result<Option<SweepJournal>, CheckpointError> {
        read_checkpoint("j", text)
    }

    #[test]
    fn every_bit_survives_in_any_order_of_the_points() {
        let journal = read_back(&text((0..200).rev())).unwrap().unwrap();
        assert_eq!(journal.records.len(), 200);
        assert!(journal.records.iter().all(|point| point.outcome == outcome(point.index)));
    }

    #[test]
    fn a_torn_last_line_is_dropped_and_said() {
        let (whole, one) = (text([7, 3].into_iter()), text([7].into_iter()));
        for cut in one.len() + 1..whole.len() - 1 {
            let journal = read_back(&whole[..cut]).unwrap().unwrap();
            assert_eq!(
                (journal.records.len(), journal.end.torn, journal.end.intact_bytes),
                (1, true, one.len())
            );
        }
        assert_eq!([read_back(""), read_back("{\"journal\":\"sweep\"")], [Ok(None), Ok(None)]);
    }

    #[test]
    fn a_journal_is_known_by_its_first_line() {
        assert_eq!(detect_kind(text([0].into_iter()).as_bytes()), Some(CheckpointKind::Sweep));
        assert_eq!(detect_kind(b"{\"journal\":\"fit\",\"layout\":2}\n"), Some(CheckpointKind::Fit));
        assert_eq!([&b"time_s,tip_x_m\n"[..], b"{}\n", b"{\"journal\":"].map(detect_kind), [None; 3]);
    }

    #[test]
    fn another_study_and_damage_are_refused() {
        let good = text([0, 1].into_iter());
        let refused = |text: &str| read_back(text).unwrap_err().to_string();
        let other = read_back(&good)
            .unwrap()
            .unwrap()
            .header
            .check_matches::<SweepPoint>("j", &study_header(&study(), "g"));
        assert!(
            other
                .unwrap_err()
                .to_string()
                .contains("j: fingerprint f, expected g: the study, a scene or a recording")
        );
        assert!(refused("time_s,tip_x_m\n").starts_with("j:1: no journal header"));
        assert!(
            refused(&good.replacen("\"index\":1", "\"index\":2", 1))
                .starts_with("j:3: the line has the checksum")
        );
        let forged =
            |index: usize| good.clone() + &format_record_line(&SweepPoint { index, outcome: outcome(3) });
        assert!(refused(&forged(0)).starts_with("j:4: the point of line 2 a second time"));
        assert!(refused(&forged(200)).contains("found 200, expected less than 200"));
        let header = |layout| SweepHeader { layout, ..study_header(&study(), "f") };
        let later = format_header_line(&header(5)) + good.split_once('\n').unwrap().1;
        let said = "j: a journal of layout 5, expected layout 4; move it away and run the sweep again";
        assert_eq!(refused(&later), said);
    }
}
