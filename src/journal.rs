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
mod exact;
mod fingerprint;
mod header;
mod lines;
mod read;
mod record;
mod sample;
mod shard;
mod sink;
mod stream;

pub use checksum::append_checksum;
pub use error::CheckpointError;
pub use exact::ExactNumber;
pub use fingerprint::fingerprint;
pub use header::{CheckpointHeader, CheckpointKind, detect_kind, has_whole_line};
pub use read::{CheckpointFile, check_recomputed, duplicate_record_error, read_checkpoint};
pub use record::{CheckpointRecord, format_header_line, format_record_line};
pub use sample::{RECHECKED_RECORDS, sample_records};
pub use shard::Shard;
pub use sink::{CheckpointSink, NullSink};
pub use stream::{CheckpointEnd, CheckpointReader, StoredRecord};
