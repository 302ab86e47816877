//! Companions of an export: the record of a Photron camera (`.cih`, `.cihx`) has the recording rate.

use crate::import::error::ImportError;
use crate::import::reader::findings::finding;
use crate::import::reader::rounding::RATE_AGREEMENT;
use crate::import::reader::track_file::TrackFile;
use crate::import::source::{Companion, Source, base_name};
use crate::recording::quality::{Check, Severity};

/// Names of files that may belong to the export `file` and lie in its folder, in the order in which they are
/// read.
#[must_use]
pub fn companion_names(file: &str) -> Vec<String> {
    let stem = file.rsplit_once('.').map_or(file, |(stem, _)| stem);
    let by_extension =
        ["cih", "CIH", "cihx", "CIHX", "set", "SET"].iter().map(|extension| format!("{stem}.{extension}"));
    by_extension.chain(point_names(file)).collect()
}

/// DLTdv's list of point names, which belongs to a sparse table of positions.
fn point_names(file: &str) -> Option<String> {
    let (folder, base) = file.split_at(file.len() - base_name(file).len());
    base.rsplit_once("xypts")
        .filter(|(_, end)| end.starts_with('.'))
        .map(|(start, end)| format!("{folder}{start}pointNames{end}"))
}

/// Entries of a record: the key of a `.cih`, which is text of `Key : value` lines, and the element of a
/// `.cihx`, which is XML between bytes of other kinds.
#[derive(Clone, Copy)]
struct Entry {
    key: &'static str,
    element: &'static str,
}

const RATE: Entry = Entry { key: "record rate", element: "recordRate" };
const FRAMES: Entry = Entry { key: "total frame", element: "totalFrame" };
/// Every n-th frame of the recording was saved in the pictures.
const STEP: Entry = Entry { key: "save step", element: "saveStep" };
/// Start of the element that all of a `.cihx` stands in.
const CIHX: &str = "<cih>";

/// A camera's record.
struct Record<'a> {
    name: &'a str,
    text: String,
    /// Lines of the file before the text.
    skipped: usize,
}

impl<'a> Record<'a> {
    /// The record in a companion; bytes that are no text in it do not matter.
    fn of(file: &'a Companion) -> Option<Self> {
        let extension = file.name.rsplit_once('.').map(|(_, extension)| extension.to_lowercase())?;
        let text = String::from_utf8_lossy(&file.bytes);
        let start = match extension.as_str() {
            "cih" => 0,
            "cihx" => text.find(CIHX).unwrap_or(text.len()),
            _ => return None,
        };
        let (before, text) = text.split_at(start);
        Some(Self { name: &file.name, text: text.to_owned(), skipped: before.matches('\n').count() })
    }

    /// Text of an entry with its line in what was read; a record that was saved again has its entries first.
    fn entry(&self, entry: Entry) -> Option<(&str, usize)> {
        let (open, close) = (format!("<{}>", entry.element), format!("</{}>", entry.element));
        let value = |line: &'_ str| -> Option<(usize, usize)> {
            if self.text.starts_with(CIHX) {
                let from = line.find(&open)? + open.len();
                return Some((from, from + line.get(from..)?.find(&close)?));
            }
            let (key, _) = line.split_once(':')?;
            key.trim().to_lowercase().starts_with(entry.key).then_some((key.len() + 1, line.len()))
        };
        self.text.lines().enumerate().find_map(|(at, line)| {
            value(line).and_then(|(from, to)| Some((line.get(from..to)?.trim(), self.skipped + at + 1)))
        })
    }

    /// A whole number of an entry, where there is one.
    fn count(&self, entry: Entry) -> Option<usize> {
        self.entry(entry)?.0.parse().ok()
    }

    /// The rate at which the pictures follow each other, frames/s.
    fn rate_hz(&self) -> Result<f64, ImportError> {
        let Some((text, line)) = self.entry(RATE) else {
            return Err(self.refuse(1, "no recording rate".to_owned(), "the entry `Record Rate(fps)`"));
        };
        let rate = text.parse::<f64>().ok().filter(|rate| rate.is_finite() && *rate > 0.0);
        let rate = rate.ok_or_else(|| {
            self.refuse(
                line,
                format!("the recording rate `{}`", text.chars().take(40).collect::<String>()),
                "a number above 0",
            )
        })?;
        match self.entry(STEP).filter(|(step, _)| !matches!(*step, "1" | "0" | "")) {
            Some((step, line)) => {
                let found = format!(
                    "`Save Step : {}`: not every frame of the {rate} a second was saved",
                    step.chars().take(40).collect::<String>()
                );
                Err(self.refuse(line, found, "pictures of every frame"))
            }
            None => Ok(rate),
        }
    }

    fn refuse(&self, line: usize, found: String, expected: &str) -> ImportError {
        let advice = "give the rate at which the pictures that were tracked follow each other, \
            --frame-rate-hz N, or move the record away if it belongs to another video";
        ImportError::format(format!("{}:{line}:1", self.name), found, expected, advice)
    }
}

/// Takes the recording rate from the camera's record of each file, where there is one.
///
/// # Errors
/// [`ImportError::Format`] for a record that cannot be used, unless the rate is `declared`; then that is a
/// finding.
pub(crate) fn read_rates(
    sources: &[Source],
    exports: &mut [TrackFile],
    declared: bool,
) -> Result<(), ImportError> {
    for (source, export) in sources.iter().zip(exports) {
        for record in source.companions.iter().filter_map(Record::of) {
            match record.rate_hz() {
                Ok(rate_hz) => agree(export, rate_hz, &record)?,
                Err(error) if declared => {
                    let advice = "--frame-rate-hz counts";
                    export.findings.push(finding(
                        Check::CameraRecord,
                        Severity::Note,
                        (0.0, ""),
                        format!("the camera's record is not used: {error}"),
                        advice,
                    ));
                }
                Err(error) => return Err(error),
            }
            export.findings.extend(too_few_frames(&record, export));
        }
    }
    Ok(())
}

/// Two records, or a record and the export itself, must agree.
fn agree(export: &mut TrackFile, rate_hz: f64, record: &Record) -> Result<(), ImportError> {
    if let Some((recorded_hz, record_name)) = export
        .facts
        .frame_rate_hz
        .as_ref()
        .filter(|(other, _)| (other / rate_hz - 1.0).abs() > RATE_AGREEMENT)
    {
        let line = record.entry(RATE).map_or(1, |entry| entry.1);
        return Err(record.refuse(
            line,
            format!("a recording rate of {rate_hz} frames/s"),
            &format!("{recorded_hz} as in {record_name}"),
        ));
    }
    export.facts.frame_rate_hz = Some((rate_hz, format!("the camera's record {}", base_name(record.name))));
    Ok(())
}

/// A record of fewer frames than the table has belongs to another video.
fn too_few_frames(record: &Record, export: &TrackFile) -> Option<crate::recording::quality::Finding> {
    let frames = record.count(FRAMES)?;
    let rows = export
        .clocks
        .iter()
        .map(crate::import::reader::track_file::Clock::len)
        .max()
        .filter(|rows| *rows > frames)?;
    let found = format!(
        "{}: the camera's record {} is of {frames} frames, but a track has {rows} rows",
        export.file,
        base_name(record.name)
    );
    let advice = "check that the record belongs to this video: the recording rate is taken from it";
    Some(finding(Check::CameraRecord, Severity::Caution, (frames as f64, "frames"), found, advice))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CIH: &str = "#Camera Information Header\r\nDate : 2020/1/1\r\nTime : 00:11\r\nRecord Rate(fps) : \
        5000\r\nTotal Frame : 3\r\nSave Step : 1\r\nEND\r\n\r\nRecord Rate(fps) : 30\r\n";

    fn record(name: &str, bytes: &[u8]) -> Companion {
        Companion { name: name.to_owned(), bytes: bytes.to_vec() }
    }

    fn rate(name: &str, bytes: &[u8]) -> Result<f64, String> {
        Record::of(&record(name, bytes)).unwrap().rate_hz().map_err(|error| error.to_string())
    }

    #[test]
    fn the_rate_of_a_record_is_that_of_recording() {
        assert_eq!(rate("a/run.cih", CIH.as_bytes()), Ok(5000.0));
        assert_eq!(rate("run.CIH", CIH.replace(" : ", " :").as_bytes()), Ok(5000.0));
        let xml = b"\x01\x00\xff\x0a<cih>\n<recordInfo>\n<recordRate>20000</recordRate>\n</recordInfo>\n<totalFrame>8</totalFrame></cih>\n\x00";
        assert_eq!(rate("run.cihx", xml), Ok(20_000.0));
        assert_eq!(Record::of(&record("run.cihx", xml)).unwrap().count(FRAMES), Some(8));
        assert!(Record::of(&record("run.set", b"")).is_none());
        assert!(companion_names("a/run 7.csv").contains(&"a/run 7.cih".to_owned()));
        assert!(companion_names("xypts/run7_xypts.tsv").contains(&"xypts/run7_pointNames.tsv".to_owned()));
        assert_eq!(companion_names("xypts/run7.tsv").len(), 6);
    }

    #[test]
    fn an_unusable_record_says_why_and_what_to_do() {
        let says = |text: &str| rate("run.cih", text.as_bytes()).unwrap_err();
        assert!(says(&CIH.replace("5000", "none")).starts_with(
            "run.cih:4:1: found the recording rate `none`, expected a number above 0; give the rate"
        ));
        assert!(
            says("Date : 2020/1/1\n")
                .starts_with("run.cih:1:1: found no recording rate, expected the entry `Record Rate(fps)`")
        );
        let stepped = says(&CIH.replace("Step : 1", "Step : 36"));
        assert!(
            stepped.starts_with(
                "run.cih:6:1: found `Save Step : 36`: not every frame of the 5000 a second was saved"
            ),
            "{stepped}"
        );
        assert!(rate("run.cihx", b"no xml").unwrap_err().contains("no recording rate"));
    }
}
