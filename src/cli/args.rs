//! Options that several commands share.

use super::failure::{Failure, Outcome};
use super::files::{CsvDialect, FileSize, OutputCommand, Overwrite, WritePolicy};
use clap::Args;
use std::str::FromStr;
use std::time::Duration;

/// Parses a whole number of at least 1. [`clap`] adds the name of the option and the refused text to the
/// error message.
pub(crate) fn parse_count(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count) if count > 0 => Ok(count),
        _ => Err("expected a whole number, 1 or more".to_owned()),
    }
}

#[derive(Debug, Clone, Args)]
pub(crate) struct GlobalArgs {
    /// No progress and no summary; refusals are still shown
    #[arg(long, global = true)]
    pub quiet: bool,
    /// Threads for parallel work, at most 1024 (default: every core); results do not depend on it
    #[arg(long, global = true, value_name = "N", value_parser = parse_threads, allow_negative_numbers = true)]
    pub threads: Option<usize>,
    /// Largest data file that is read, such as 500MB or 4GB; a recording needs up to four times as much
    /// memory
    #[arg(long, global = true, value_name = "SIZE", default_value_t = FileSize::DEFAULT)]
    pub max_file_size: FileSize,
    /// How tables are written, for a spreadsheet; trace.csv is always plain, since programs read it
    #[arg(long, global = true, value_name = "DIALECT", value_enum, default_value_t)]
    pub csv_dialect: CsvDialect,
}

/// Maximum number of threads. Few machines have more cores, and each thread needs megabytes of memory: a
/// hundred thousand threads would exhaust the memory of the machine.
const MOST_THREADS: usize = 1024;

fn parse_threads(text: &str) -> Result<usize, String> {
    parse_count(text).ok().filter(|threads| *threads <= MOST_THREADS).ok_or_else(|| {
        format!("expected a whole number from 1 to {MOST_THREADS}; leave it out for every core")
    })
}

impl GlobalArgs {
    /// Applies the settings that affect the whole program, before anything runs.
    pub(crate) fn apply_settings(&self) -> Outcome<()> {
        self.max_file_size.set_read_limit();
        let Some(threads) = self.threads else { return Ok(()) };
        rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().map_err(Failure::internal)
    }

    /// The files that the command may overwrite, and the dialect of its tables that the user requested.
    pub(crate) fn write_policy(&self, maker: OutputCommand, overwrite: Overwrite) -> WritePolicy {
        WritePolicy { csv: self.csv_dialect, ..WritePolicy::new(maker, overwrite) }
    }
}

/// A time such as `90s`, `45min`, `1h30min`, `02:00:00` or `1-12:00:00`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TimeLimit(pub Duration);

/// Longest time limit that is accepted, s: a leap year.
const MAX_TIME_LIMIT_S: u64 = 366 * DAY_S;
const DAY_S: u64 = 86_400;
const TIME_LIMIT_UNITS: [(&str, u64); 5] = [("min", 60), ("d", DAY_S), ("h", 3600), ("m", 60), ("s", 1)];

impl FromStr for TimeLimit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let seconds = if text.contains(':') { parse_clock_time(text) } else { parse_unit_time(text) };
        let allowed = seconds.filter(|seconds| (1..=MAX_TIME_LIMIT_S).contains(seconds));
        allowed.map(|seconds| Self(Duration::from_secs(seconds))).ok_or_else(|| {
            "expected a time such as 90s, 45min, 1h30min, 02:00:00 (hours, minutes, seconds) or 1-12:00:00 \
             (and days)"
                .to_owned()
        })
    }
}

fn parse_clock_time(text: &str) -> Option<u64> {
    let (days, time) = text.split_once('-').unwrap_or(("0", text));
    let mut parts = time.split(':').map(parse_digits);
    let (hours, minutes, seconds) = (parts.next()??, parts.next()??, parts.next()??);
    let in_range = minutes < 60 && seconds < 60 && parts.next().is_none();
    let total = parse_digits(days)?.checked_mul(DAY_S)?.checked_add(hours.checked_mul(3600)?)?;
    in_range.then_some(total.checked_add(minutes * 60 + seconds)?)
}

/// Parses a sum of numbers with units of time, such as `1h30min`; returns seconds.
fn parse_unit_time(text: &str) -> Option<u64> {
    let mut rest = text;
    let mut total: u64 = 0;
    while !rest.is_empty() {
        let digits = rest.find(|c: char| !c.is_ascii_digit())?;
        let (count, behind) = rest.split_at(digits);
        let (unit, seconds) = TIME_LIMIT_UNITS.iter().find(|(unit, _)| behind.starts_with(unit))?;
        total = total.checked_add(parse_digits(count)?.checked_mul(*seconds)?)?;
        rest = behind.get(unit.len()..)?;
    }
    Some(total)
}

fn parse_digits(text: &str) -> Option<u64> {
    text.bytes().all(|byte| byte.is_ascii_digit()).then(|| text.parse().ok())?
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read_as_people_and_schedulers_write_them() {
        let read = |text: &str| text.parse::<TimeLimit>().map(|limit| limit.0.as_secs());
        for (text, seconds) in [
            ("90s", 90),
            ("45min", 2700),
            ("45m", 2700),
            ("2h", 7200),
            ("1h30min", 5400),
            ("1d12h", 129_600),
            ("02:00:00", 7200),
            ("00:00:30", 30),
            ("1-12:00:00", 129_600),
        ] {
            assert_eq!(read(text), Ok(seconds), "{text}");
        }
        let huge = "99999999999999999999h";
        for text in ["", "0s", "5", "1.5h", "h", "-1h", "1:30", "01:60:00", "1:2:3:4", "1 h", "400d", huge] {
            assert!(read(text).unwrap_err().contains("such as 90s"), "{text}");
        }
    }
}
