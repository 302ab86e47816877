//! Append-only journals of long computations, from which an interrupted computation is resumed: one line of
//! JSON per record.
//!
//! The first line is a [`CheckpointHeader`] with the fingerprint of the problem. Every other line is a
//! [`CheckpointRecord`]: an evaluation of a fit or a point of a study. A number is the shortest decimal that
//! keeps every bit. Every line ends with a checksum. A complete line with a wrong checksum is refused, and an
//! incomplete last line is dropped.

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
pub use read::{
    CheckpointEnd, CheckpointFile, CheckpointReader, RECHECKED_RECORDS, StoredRecord, check_recomputed,
    duplicate_record_error, read_checkpoint, sample_records,
};
pub(crate) use read::{FIRST_LINE, describe_difference};
pub(crate) use record::or_infinite;
pub use record::{CheckpointRecord, CheckpointSink, NullSink, format_header_line, format_record_line};
pub use shard::Shard;
