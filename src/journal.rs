//! Append-only journals of long computations: one line of JSON a record, enough to resume and extend what was
//! computed.
//!
//! The first line is a [`Header`] with the fingerprint of the problem. Numbers are [`Exact`]: the shortest
//! decimals that give the same bits back, as strings, because JSON readers round numbers in the last place
//! and a replay must not. Every line ends with a checksum, and one that does not hold is refused. A last line
//! that is cut off is dropped when a journal is read. What follows from the rest of a line is not stored.
//!
//! What a line holds is a [`Record`]: an evaluation of a fit, a point of a study.

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

pub use checksum::sealed;
pub use error::JournalError;
pub use exact::Exact;
pub use fingerprint::fingerprint;
pub use header::{Header, Kind, has_whole_line, kind_of};
pub use read::{Journal, again, check_again, read};
pub use record::{Record, header_line, line};
pub use sample::{RECHECKED, sample};
pub use shard::Shard;
pub use sink::{Discard, Sink};
pub use stream::{End, Found, Stream};
