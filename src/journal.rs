//! Append-only journals of long computations: one line of JSON a record, enough to resume, extend, merge and
//! audit what was computed.
//!
//! The first line is a [`Header`] with the fingerprint of the problem. Numbers are [`Exact`]: the shortest
//! decimals that give the same bits back, as strings, because JSON readers round numbers in the last place
//! and a replay must not. A last line that is cut off is dropped when a journal is read.
//!
//! What a line holds is a [`Record`]: an evaluation of a fit, a point of a study.

mod error;
mod exact;
mod fingerprint;
mod header;
mod merge;
mod read;
mod record;
mod sink;

pub use error::JournalError;
pub use exact::Exact;
pub use fingerprint::fingerprint;

pub use header::{Header, Kind, kind_of};
pub use merge::{Merged, merge};
pub use read::{Journal, read};
pub use record::{Record, header_line, line};
pub use sink::{Discard, Sink};
