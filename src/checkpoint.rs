//! Append-only journals of long computations: one line of JSON a record, enough to resume and extend what was
//! computed.
//!
//! The first line is a [`CheckpointHeader`] with the fingerprint of the problem. Numbers are [`ExactNumber`]: the shortest
//! decimals that give the same bits back, as strings, because JSON readers round numbers in the last place
//! and a replay must not. Every line ends with a checksum, and one that does not hold is refused. A last line
//! that is cut off is dropped when a journal is read. What follows from the rest of a line is not stored.
//!
//! What a line holds is a [`CheckpointRecord`]: an evaluation of a fit, a point of a study.

mod checksum;
mod error;
mod header;
mod read;
mod record;
mod shard;

pub use checksum::append_checksum;
pub(crate) use checksum::fingerprint;
pub use error::CheckpointError;
pub use header::{CheckpointHeader, CheckpointKind, detect_kind, has_whole_line};
pub use read::{CheckpointEnd, CheckpointReader, StoredRecord};
pub use read::{CheckpointFile, check_recomputed, duplicate_record_error, read_checkpoint};
pub use read::{RECHECKED_RECORDS, sample_records};
pub use record::ExactNumber;
pub use record::{CheckpointRecord, format_header_line, format_record_line};
pub use record::{CheckpointSink, NullSink};
pub use shard::Shard;
