//! Journal of a stability study: its evaluations, each under a name, in the order in which they finish.

use super::study::StudyRange;
use crate::checkpoint::{
    CheckpointError, CheckpointFile, CheckpointHeader, CheckpointKind, CheckpointRecord, CheckpointSink,
    FIRST_LINE, NullSink, StoredRecord, check_recomputed, fingerprint, format_header_line,
    format_record_line, sample_records,
};
use crate::model::parameter_spread::ParameterSpread;
use crate::simulate::scene::Scene;
use crate::simulate::scene::error::SceneError;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::HashMap;
use std::ops::ControlFlow;

/// An evaluation of a study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StabilityEvaluation {
    /// What is computed: a row of speeds, a cycle, a remedy, or the effect of a parameter.
    pub name: String,
    /// Result.
    pub result: Value,
}

impl CheckpointRecord for StabilityEvaluation {
    const KIND: CheckpointKind = CheckpointKind::Stability;
    type Body = ();
    type Identity = String;

    fn identity(&self) -> String {
        self.name.clone()
    }

    fn check_against(&self, (): &()) -> Result<(), String> {
        Ok(())
    }

    fn problem_difference((): &(), (): &()) -> Option<String> {
        None
    }
}

/// Why a study stops before its end.
#[derive(Debug, thiserror::Error)]
pub enum StudyStop {
    /// The scene does not admit a preload of the range, or a parameter in its SI unit.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The journal belongs to another study, or one of its evaluations cannot be reproduced.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The journal cannot be written, with the reason.
    #[error("the journal cannot be written: {0}")]
    JournalWrite(String),
    /// The caller asked the study to stop; the journal contains the finished evaluations.
    #[error("the study was asked to stop")]
    Interrupted,
}

/// The evaluations of a study: those of its journal are read, all others are computed and appended to it.
pub struct EvaluationLog<'a> {
    file: &'a str,
    sink: Box<dyn CheckpointSink + 'a>,
    flow: fn() -> ControlFlow<()>,
    /// Evaluations of the journal, each with whether it is computed again as a check.
    stored: HashMap<String, (StoredRecord<StabilityEvaluation>, bool)>,
    /// Number of evaluations in the journal.
    pub written: usize,
}

impl<'a> EvaluationLog<'a> {
    /// A log without a journal, for a study that is never resumed.
    #[must_use]
    pub fn without_journal() -> Self {
        let (stored, flow) = (HashMap::new(), || ControlFlow::Continue(()));
        Self { file: "", sink: Box::new(NullSink), flow, stored, written: 0 }
    }

    /// Begins the journal of a study or, if `found` is its earlier part, continues it. `file` is the name of
    /// the journal in errors. `flow` is called before each evaluation that is computed, and may stop the
    /// study.
    ///
    /// # Errors
    /// [`StudyStop`] if the journal belongs to another study or cannot be written.
    pub fn open(
        (scene, range, spread): (&Scene, &StudyRange, Option<&ParameterSpread>),
        (file, found): (&'a str, Option<CheckpointFile<StabilityEvaluation>>),
        mut sink: impl CheckpointSink + 'a,
        flow: fn() -> ControlFlow<()>,
    ) -> Result<Self, StudyStop> {
        let version = env!("CARGO_PKG_VERSION");
        let fingerprint = fingerprint(&(version, scene, range, spread));
        let header = CheckpointHeader::new::<StabilityEvaluation>(&fingerprint, version, ());
        match &found {
            Some(found) => found.header.check_matches::<StabilityEvaluation>(file, &header)?,
            None => sink.append(&format_header_line(&header)).map_err(StudyStop::JournalWrite)?,
        }
        let records = found.map_or_else(Vec::new, |found| found.records);
        let written = records.len();
        let again = sample_records(written, written as u64);
        let stored = records.into_iter().enumerate().map(|(place, record)| {
            let stored = StoredRecord { record, line: place + FIRST_LINE };
            (stored.record.name.clone(), (stored, again.contains(&place)))
        });
        Ok(Self { file, sink: Box::new(sink), flow, stored: stored.collect(), written })
    }

    /// The result of an evaluation, from the journal or computed.
    pub(super) fn evaluate<T: Serialize + DeserializeOwned>(
        &mut self,
        name: String,
        compute: impl FnOnce() -> T,
    ) -> Result<T, StudyStop> {
        let stored = self.stored.remove(&name);
        if let Some((stored, false)) = &stored
            && let Ok(result) = T::deserialize(&stored.record.result)
        {
            return Ok(result);
        }
        if (self.flow)().is_break() {
            return Err(StudyStop::Interrupted);
        }
        let result = compute();
        // a number that is not finite becomes null: it is computed again when the study is resumed, or, where
        // null means that there is no effect, has none
        let record = StabilityEvaluation { name, result: serde_json::to_value(&result).unwrap_or_default() };
        match stored {
            Some((stored, _)) => check_recomputed(self.file, &stored, &record)?,
            None => {
                self.sink.append(&format_record_line(&record)).map_err(StudyStop::JournalWrite)?;
                self.written += 1;
            }
        }
        Ok(result)
    }
}
