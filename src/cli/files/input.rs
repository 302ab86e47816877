//! Reads regular files and, for the name `-`, standard input, up to a size limit. The size is checked before
//! and during reading, since a file may grow and standard input has no size.

use crate::cli::failure::{Failure, Outcome};
use std::fmt;
use std::fs::{self, File, Metadata};
use std::io::{self, ErrorKind, Read};
use std::path::Path;
use std::str::FromStr;
use std::sync::atomic::{AtomicU64, Ordering};

/// The file name that means standard input on the command line.
const STANDARD_INPUT: &str = "-";
/// Size limit of a TOML file: four times the size of a job with a thousand components. Parsing a file needs
/// memory of up to a hundred times its size.
const TOML_LIMIT: ReadLimit =
    ReadLimit { largest: FileSize(500_000), advice: "this is no file that people write; name another one" };
/// Size limit of the result of a fit: about a hundred times the size of the results in this repository.
const JSON_LIMIT: ReadLimit =
    ReadLimit { largest: FileSize(16_000_000), advice: "this program writes none so large; make it again" };

/// Size limit of a data file, in bytes; the option `--max-file-size` sets it.
static MAX_DATA_BYTES: AtomicU64 = AtomicU64::new(FileSize::DEFAULT.0);

/// A number of bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FileSize(u64);

impl FileSize {
    /// Default size limit: about the size of a recording with ten million frames, the longest that can be
    /// read.
    pub(crate) const DEFAULT: Self = Self(1_000_000_000);
    const UNITS: [(&str, u64); 5] =
        [("GB", 1_000_000_000), ("MB", 1_000_000), ("kB", 1_000), ("B", 1), ("", 1)];

    /// Sets the size limit of all data files that are read from now on.
    pub(crate) fn set_read_limit(self) {
        MAX_DATA_BYTES.store(self.0, Ordering::Relaxed);
    }
}

impl fmt::Display for FileSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let fits = |unit: &&(&str, u64)| self.0.is_multiple_of(unit.1) && self.0 >= unit.1;
        let (unit, bytes) = Self::UNITS.iter().find(fits).copied().unwrap_or(("B", 1));
        write!(f, "{} {unit}", self.0 / bytes)
    }
}

impl FromStr for FileSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let lower = text.trim().to_ascii_lowercase();
        let number = |(unit, bytes): &(&str, u64)| {
            let digits = lower.strip_suffix(&unit.to_ascii_lowercase())?.trim();
            digits.parse::<u64>().ok()?.checked_mul(*bytes).filter(|bytes| *bytes > 0)
        };
        let size = Self::UNITS.iter().find_map(number).map(Self);
        size.ok_or_else(|| "expected a size such as 500MB or 2GB".to_owned())
    }
}

/// Size limit for one kind of file, with advice for a larger file.
#[derive(Clone, Copy)]
struct ReadLimit {
    largest: FileSize,
    advice: &'static str,
}

impl ReadLimit {
    fn for_data() -> Self {
        Self {
            largest: FileSize(MAX_DATA_BYTES.load(Ordering::Relaxed)),
            advice: "read a larger one with --max-file-size, such as --max-file-size 4GB",
        }
    }

    fn check_open_file(self, path: &Path, file: &File) -> Outcome<()> {
        let found = file.metadata().map_err(|error| read_failure(path, &error))?;
        check_regular_file(path, &found)?;
        let is_small = found.len() <= self.largest.0;
        is_small.then_some(()).ok_or_else(|| self.too_large_failure(path, &format!("{} bytes", found.len())))
    }

    fn too_large_failure(self, path: &Path, found: &str) -> Failure {
        let Self { largest, advice } = self;
        Failure::at(path.display(), format!("found {found}, expected at most {largest}; {advice}"))
    }
}

/// Whether a path means standard input.
pub(crate) fn is_standard_input(path: &Path) -> bool {
    path.as_os_str() == STANDARD_INPUT
}

/// Reads a data file as bytes, up to the size limit of data files.
pub(crate) fn read_data(path: &Path) -> Outcome<Vec<u8>> {
    read_limited(path, ReadLimit::for_data())
}

/// Refuses an open data file that is too large to be read into memory, according to the size limit of data
/// files.
pub(crate) fn check_data_size(path: &Path, file: &File) -> Outcome<()> {
    ReadLimit::for_data().check_open_file(path, file)
}

/// Reads a data file as UTF-8 text; a byte-order mark is removed.
pub(crate) fn read_text(path: &Path) -> Outcome<String> {
    decode_utf8(path, read_data(path)?)
}

/// Reads a TOML file as text, up to the size limit for files that people write.
pub(crate) fn read_toml(path: &Path) -> Outcome<String> {
    decode_utf8(path, read_limited(path, TOML_LIMIT)?)
}

/// Reads a JSON file that this program has written, as text.
pub(crate) fn read_json(path: &Path) -> Outcome<String> {
    decode_utf8(path, read_limited(path, JSON_LIMIT)?)
}

fn decode_utf8(path: &Path, bytes: Vec<u8>) -> Outcome<String> {
    let mut text = String::from_utf8(bytes).map_err(|error| {
        Failure::at(
            path.display(),
            format!("byte {} is not UTF-8; save the file as UTF-8", error.utf8_error().valid_up_to()),
        )
    })?;
    if text.starts_with('\u{feff}') {
        text.remove(0);
    }
    Ok(text)
}

fn read_limited(path: &Path, limit: ReadLimit) -> Outcome<Vec<u8>> {
    if is_standard_input(path) {
        return read_all(path, io::stdin().lock(), limit);
    }
    // checked before opening, since opening a pipe waits for its writer
    check_regular_file(path, &fs::metadata(path).map_err(|error| read_failure(path, &error))?)?;
    let file = File::open(path).map_err(|error| read_failure(path, &error))?;
    limit.check_open_file(path, &file)?;
    read_all(path, &file, limit)
}

fn read_all(path: &Path, from: impl Read, limit: ReadLimit) -> Outcome<Vec<u8>> {
    let bytes = read_at_most(from, limit.largest).map_err(|error| read_failure(path, &error))?;
    bytes.ok_or_else(|| limit.too_large_failure(path, &format!("more than {}", limit.largest)))
}

/// Reads all bytes; returns `None` if there are more than `largest`.
fn read_at_most(from: impl Read, largest: FileSize) -> io::Result<Option<Vec<u8>>> {
    let mut bytes = Vec::new();
    from.take(largest.0.saturating_add(1)).read_to_end(&mut bytes)?;
    Ok((bytes.len() as u64 <= largest.0).then_some(bytes))
}

/// Refuses a path that is not a regular file. Only a regular file certainly has an end and gives the same
/// contents when it is read twice.
fn check_regular_file(path: &Path, found: &Metadata) -> Outcome<()> {
    let problem = match found.file_type() {
        kind if kind.is_file() => return Ok(()),
        kind if kind.is_dir() => "a folder, expected a file",
        _ => {
            "a pipe, a socket or a device, expected a file; write what it gives into a file, or give it on standard input and name that `-`"
        }
    };
    Err(Failure::at(path.display(), problem))
}

fn read_failure(path: &Path, error: &io::Error) -> Failure {
    let problem = match error.kind() {
        ErrorKind::NotFound => "no such file; check the path",
        ErrorKind::PermissionDenied => "not readable; check its permissions",
        ErrorKind::IsADirectory => "a folder, expected a file",
        ErrorKind::NotADirectory => "no such file, as a part of its path is a file; check the path",
        _ => return Failure::at(path.display(), error),
    };
    Failure::at(path.display(), problem)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_and_shown() {
        let read = |text: &str| text.parse::<FileSize>().map(|size| size.0);
        assert_eq!(read("2GB"), Ok(2_000_000_000));
        assert_eq!(read("500 mb"), Ok(500_000_000));
        assert_eq!(read("12"), Ok(12));
        for text in ["", "0", "-1", "1TB", "1.5GB", "99999999999GB", "GB"] {
            assert!(read(text).is_err(), "{text}");
        }
        assert_eq!(
            [FileSize(2_000_000_000), FileSize(1_500_000), FileSize(1)].map(|s| s.to_string()),
            ["2 GB", "1500 kB", "1 B"]
        );
        assert_eq!(FileSize::DEFAULT.to_string().parse(), Ok(FileSize::DEFAULT));
    }

    /// The limit holds even if the contents are longer than the metadata says.
    #[test]
    fn no_more_is_taken_than_allowed() {
        assert_eq!(read_at_most(&b"1234"[..], FileSize(4)).unwrap(), Some(b"1234".to_vec()));
        assert_eq!(read_at_most(io::repeat(0), FileSize(4)).unwrap(), None);
    }
}
