//! Reading what the user names: regular files and, as `-`, standard input, up to a stated size. The size is
//! checked before a byte is read and again while reading: a file may be sparse, grow, or have none.

use crate::program::failure::Failure;
use std::fmt;
use std::fs::{self, File, Metadata};
use std::io::{self, ErrorKind, Read};
use std::path::Path;
use std::str::FromStr;
use std::sync::atomic::{AtomicU64, Ordering};

/// The name of standard input on the command line.
const STANDARD_INPUT: &str = "-";
/// Largest file that people write by hand: a thousand components have a quarter of it. Parsed, it takes up to
/// a hundred times as much memory.
const TOML: Limit =
    Limit { largest: Size(500_000), advice: "this is no file that people write; name another one" };
/// Largest result of a fit: some hundred times those that are committed.
const JSON: Limit =
    Limit { largest: Size(16_000_000), advice: "this program writes none so large; make it again" };

/// Largest file with data, bytes: `--max-file-size`.
static LARGEST: AtomicU64 = AtomicU64::new(Size::DEFAULT.0);

/// A number of bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size(u64);

impl Size {
    /// The longest recording that is read, ten million frames, has about so much.
    pub const DEFAULT: Self = Self(1_000_000_000);
    const UNITS: [(&str, u64); 5] =
        [("GB", 1_000_000_000), ("MB", 1_000_000), ("kB", 1_000), ("B", 1), ("", 1)];

    /// Reads no file with data above this size from now on.
    pub fn allow(self) {
        LARGEST.store(self.0, Ordering::Relaxed);
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let fits = |unit: &&(&str, u64)| self.0.is_multiple_of(unit.1) && self.0 >= unit.1;
        let (unit, bytes) = Self::UNITS.iter().find(fits).copied().unwrap_or(("B", 1));
        write!(f, "{} {unit}", self.0 / bytes)
    }
}

impl FromStr for Size {
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

/// The largest file of a kind, and what to do with a larger one.
#[derive(Clone, Copy)]
struct Limit {
    largest: Size,
    advice: &'static str,
}

impl Limit {
    fn of_data() -> Self {
        Self {
            largest: Size(LARGEST.load(Ordering::Relaxed)),
            advice: "read a larger one with --max-file-size, such as --max-file-size 4GB",
        }
    }

    fn check(self, path: &Path, file: &File) -> Result<(), Failure> {
        let found = file.metadata().map_err(|error| unread(path, &error))?;
        check_kind(path, &found)?;
        if found.len() > self.largest.0 {
            return Err(self.refusal(path, &format!("{} bytes", found.len())));
        }
        Ok(())
    }

    fn refusal(self, path: &Path, found: &str) -> Failure {
        let Self { largest, advice } = self;
        refusal(path, &format!("found {found}, expected at most {largest}; {advice}"))
    }
}

/// Whether a path is the name of standard input.
pub fn is_standard_input(path: &Path) -> bool {
    path.as_os_str() == STANDARD_INPUT
}

/// Bytes of a file with data.
pub fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    read_within(path, Limit::of_data())
}

/// Refuses a file with data that is open, and larger than what is read into memory.
pub fn check_size(path: &Path, file: &File) -> Result<(), Failure> {
    Limit::of_data().check(path, file)
}

/// Text of a UTF-8 file with data (a byte-order mark is dropped).
pub fn read_text(path: &Path) -> Result<String, Failure> {
    text(path, read(path)?)
}

/// Text of a TOML file, which people write.
pub fn read_toml(path: &Path) -> Result<String, Failure> {
    text(path, read_within(path, TOML)?)
}

/// Text of a JSON file, which this program writes.
pub fn read_json(path: &Path) -> Result<String, Failure> {
    text(path, read_within(path, JSON)?)
}

fn text(path: &Path, bytes: Vec<u8>) -> Result<String, Failure> {
    let mut text = String::from_utf8(bytes).map_err(|error| {
        Failure::Input(format!(
            "{}: byte {} is not UTF-8; save the file as UTF-8",
            path.display(),
            error.utf8_error().valid_up_to()
        ))
    })?;
    if text.starts_with('\u{feff}') {
        text.remove(0);
    }
    Ok(text)
}

fn read_within(path: &Path, limit: Limit) -> Result<Vec<u8>, Failure> {
    if is_standard_input(path) {
        return all(path, io::stdin().lock(), limit);
    }
    // asked before it is opened: to open a pipe waits for whoever writes into it
    check_kind(path, &fs::metadata(path).map_err(|error| unread(path, &error))?)?;
    let file = File::open(path).map_err(|error| unread(path, &error))?;
    limit.check(path, &file)?;
    all(path, &file, limit)
}

fn all(path: &Path, from: impl Read, limit: Limit) -> Result<Vec<u8>, Failure> {
    let bytes = taken(from, limit.largest).map_err(|error| unread(path, &error))?;
    bytes.ok_or_else(|| limit.refusal(path, &format!("more than {}", limit.largest)))
}

/// All bytes, or `None` where there are more than allowed.
fn taken(from: impl Read, largest: Size) -> io::Result<Option<Vec<u8>>> {
    let mut bytes = Vec::new();
    from.take(largest.0.saturating_add(1)).read_to_end(&mut bytes)?;
    Ok((bytes.len() as u64 <= largest.0).then_some(bytes))
}

/// Only a regular file has an end and gives the same twice.
fn check_kind(path: &Path, found: &Metadata) -> Result<(), Failure> {
    match found.file_type() {
        kind if kind.is_file() => Ok(()),
        kind if kind.is_dir() => Err(refusal(path, "a folder, expected a file")),
        _ => Err(refusal(
            path,
            "a pipe, a socket or a device, expected a file; write what it gives into a file, or give it on standard input and name that `-`",
        )),
    }
}

fn unread(path: &Path, error: &io::Error) -> Failure {
    let problem = match error.kind() {
        ErrorKind::NotFound => "no such file; check the path",
        ErrorKind::PermissionDenied => "not readable; check its permissions",
        ErrorKind::IsADirectory => "a folder, expected a file",
        ErrorKind::NotADirectory => "no such file, as a part of its path is a file; check the path",
        _ => return refusal(path, &error.to_string()),
    };
    refusal(path, problem)
}

fn refusal(path: &Path, problem: &str) -> Failure {
    Failure::Input(format!("{}: {problem}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_and_shown() {
        let read = |text: &str| text.parse::<Size>().map(|size| size.0);
        assert_eq!(read("2GB"), Ok(2_000_000_000));
        assert_eq!(read("500 mb"), Ok(500_000_000));
        assert_eq!(read("12"), Ok(12));
        for text in ["", "0", "-1", "1TB", "1.5GB", "99999999999GB", "GB"] {
            assert!(read(text).is_err(), "{text}");
        }
        assert_eq!(
            [Size(2_000_000_000), Size(1_500_000), Size(1)].map(|s| s.to_string()),
            ["2 GB", "1500 kB", "1 B"]
        );
        assert_eq!(Size::DEFAULT.to_string().parse(), Ok(Size::DEFAULT));
    }

    /// What the metadata says is not what is read: the limit holds all the same.
    #[test]
    fn no_more_is_taken_than_allowed() {
        assert_eq!(taken(&b"1234"[..], Size(4)).unwrap(), Some(b"1234".to_vec()));
        assert_eq!(taken(io::repeat(0), Size(4)).unwrap(), None);
    }
}
