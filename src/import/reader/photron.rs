//! The record of a Photron camera: `.cih`, which is text of `Key : value` lines, and `.cihx`, which is XML
//! between bytes of other kinds.

use crate::import::error::ImportError;
use crate::import::reader::rounding::RATE_AGREEMENT;
use crate::import::source::CompanionFile;

/// An entry: the start of its key in a `.cih`, in lower case, and its element in a `.cihx`.
#[derive(Clone, Copy)]
struct CameraRecordKey {
    key: &'static str,
    element: &'static str,
}

const RATE: CameraRecordKey = CameraRecordKey { key: "record rate", element: "recordRate" };
const FRAMES: CameraRecordKey = CameraRecordKey { key: "total frame", element: "totalFrame" };
/// Every n-th frame of the recording was saved in the pictures.
const STEP: CameraRecordKey = CameraRecordKey { key: "save step", element: "skipFrame" };
/// Exposure, ns.
const SHUTTER_NS: CameraRecordKey =
    CameraRecordKey { key: "shutter type2(nsec)", element: "shutterSpeedNsec" };
/// Exposure, s, as `1/10000` or as `0.0001`; a `.cihx` has the 10000 alone.
const SHUTTER: CameraRecordKey = CameraRecordKey { key: "shutter speed", element: "shutterSpeed" };
/// Start of the element that all of a `.cihx` stands in.
const CIHX: &str = "<cih>";
/// Most characters of a value that a refusal shows.
const LONGEST_SHOWN: usize = 40;

/// What a refusal of a record says to do.
const RECORD_ADVICE: &str = "give the rate at which the pictures that were tracked follow each other, --frame-rate-hz N, or \
    move the record to another folder if it belongs to another video";

/// A camera's record.
pub(crate) struct CameraRecord<'a> {
    /// File as named by the user.
    pub name: &'a str,
    text: String,
    /// Lines of the file before the text.
    skipped: usize,
}

/// A value with its line, and the key or element as the file writes it.
struct CameraRecordValue<'r> {
    text: &'r str,
    line: usize,
    key: &'r str,
}

/// Which frames the pictures of a record are, with the line that says so.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SavedStep {
    /// 1 where every frame was saved.
    pub frames: usize,
    /// 1-based.
    pub line: usize,
    /// The entry as the file writes it.
    pub written: String,
}

impl<'a> CameraRecord<'a> {
    /// The record in a companion; bytes that are no text in it do not matter.
    pub(crate) fn parse(file: &'a CompanionFile) -> Option<Self> {
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

    /// Every value of an entry, in the order of the file; a record that was saved again has its own first.
    fn values(&self, entry: CameraRecordKey) -> Vec<CameraRecordValue<'_>> {
        if self.text.starts_with(CIHX) { self.xml_values(entry.element) } else { self.text_values(entry.key) }
    }

    fn text_values(&self, wanted: &str) -> Vec<CameraRecordValue<'_>> {
        let lines = self.text.lines().enumerate().filter_map(|(at, line)| {
            let (key, value) = line.split_once(':')?;
            let known = key.trim().to_lowercase().starts_with(wanted);
            known.then(|| CameraRecordValue {
                text: value.trim(),
                line: self.skipped + at + 1,
                key: key.trim(),
            })
        });
        lines.collect()
    }

    fn xml_values(&self, name: &'static str) -> Vec<CameraRecordValue<'_>> {
        let (open, close) = (format!("<{name}>"), format!("</{name}>"));
        let element = |(at, _): (usize, &str)| {
            let rest = self.text.get(at + open.len()..)?;
            let text = rest.get(..rest.find(&close)?)?.trim();
            let line = self.skipped + self.text.get(..at)?.matches('\n').count() + 1;
            Some(CameraRecordValue { text, line, key: name })
        };
        self.text.match_indices(&open).filter_map(element).collect()
    }

    /// The rate at which the camera recorded, frames/s, with its line.
    pub(crate) fn rate_hz(&self) -> Result<(f64, usize), ImportError> {
        let Some(value) = self.values(RATE).into_iter().next() else {
            return Err(self.refusal(1, "no recording rate".to_owned(), "the entry `Record Rate(fps)`"));
        };
        match parse_positive(value.text) {
            Some(rate) => Ok((rate, value.line)),
            None => Err(self.refusal(
                value.line,
                format!("the recording rate `{}`", shorten_value(value.text)),
                "a number above 0",
            )),
        }
    }

    /// Which frames were saved. A `.cihx` says it in several places: the largest step counts.
    pub(crate) fn saved_step(&self) -> Result<SavedStep, ImportError> {
        let mut values = self.values(STEP);
        if !self.text.starts_with(CIHX) {
            values.truncate(1);
        }
        let mut found = SavedStep { frames: 1, line: 1, written: String::new() };
        for value in values {
            let written = format!("{} : {}", value.key, shorten_value(value.text));
            let frames = match value.text {
                "" | "0" => 1,
                text => text.parse::<usize>().map_err(|_| {
                    self.refusal(
                        value.line,
                        format!("`{written}`"),
                        "a whole number of frames from picture to picture",
                    )
                })?,
            };
            if frames > found.frames {
                found = SavedStep { frames, line: value.line, written };
            }
        }
        Ok(found)
    }

    /// Pictures of the record.
    pub(crate) fn frame_count(&self) -> Option<usize> {
        self.values(FRAMES).first()?.text.parse().ok()
    }

    /// Exposure of a frame of a camera that takes `rate_hz` frames a second, s, with its line.
    ///
    /// # Errors
    /// [`ImportError::Format`] for an exposure longer than the time of a frame.
    pub(crate) fn exposure_s(&self, rate_hz: f64) -> Result<Option<(f64, usize)>, ImportError> {
        let (nanoseconds, seconds) = (self.values(SHUTTER_NS), self.values(SHUTTER));
        let found = nanoseconds.first().and_then(|value| Some((parse_positive(value.text)? * 1e-9, value)));
        let found =
            found.or_else(|| seconds.first().and_then(|value| Some((parse_exposure(value.text)?, value))));
        match found {
            Some((exposure_s, value)) if exposure_s * rate_hz > 1.0 + RATE_AGREEMENT => Err(self.refusal(
                value.line,
                format!("`{} : {}`, an exposure of {exposure_s} s", value.key, shorten_value(value.text)),
                &format!("at most the time of a frame, {} s at {rate_hz} frames/s", 1.0 / rate_hz),
            )),
            found => Ok(found.map(|(exposure_s, value)| (exposure_s, value.line))),
        }
    }

    /// The refusal of what line `line` says.
    pub(crate) fn refusal(&self, line: usize, found: String, expected: &str) -> ImportError {
        ImportError::format(format!("{}:{line}:1", self.name), found, expected, RECORD_ADVICE)
    }
}

fn shorten_value(text: &str) -> String {
    text.chars().take(LONGEST_SHOWN).collect()
}

fn parse_positive(text: &str) -> Option<f64> {
    text.parse::<f64>().ok().filter(|value| value.is_finite() && *value > 0.0)
}

/// `1/10000`, `0.0001` or `10000`, with or without a unit behind: no exposure of such a camera is a second
/// long.
fn parse_exposure(text: &str) -> Option<f64> {
    let number = text.trim_end_matches(|c: char| c.is_alphabetic() || c.is_whitespace() || c == '.');
    match number.split_once('/') {
        Some((above, below)) => Some(parse_positive(above.trim())? / parse_positive(below.trim())?),
        None => parse_positive(number).map(|value| if value < 1.0 { value } else { 1.0 / value }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CIH: &str = "#Camera Information Header\r\nDate : 2020/1/1\r\nTime : 00:11\r\nRecord Rate(fps) : \
        5000\r\nShutter Speed(s) : 1/10000\r\nTotal Frame : 3\r\nSave Step : 1\r\nEND\r\n\r\nRecord Rate(fps) : \
        30\r\nSave Step : 7\r\n";
    const CIHX: &[u8] = b"\x01\x00\xff\x0a<cih>\n<recordInfo>\n<recordRate>20000</recordRate>\
        <shutterSpeed>40000</shutterSpeed></recordInfo>\n<totalFrame>8</totalFrame>\
        <skipFrame>\n1\n</skipFrame></cih>\n\x00";

    fn companion(name: &str, bytes: &[u8]) -> CompanionFile {
        CompanionFile { name: name.to_owned(), bytes: bytes.to_vec() }
    }

    fn ask<T>(
        name: &str,
        bytes: &[u8],
        ask: impl Fn(&CameraRecord) -> Result<T, ImportError>,
    ) -> Result<T, String> {
        ask(&CameraRecord::parse(&companion(name, bytes)).unwrap()).map_err(|error| error.to_string())
    }

    fn rate(name: &str, bytes: &[u8]) -> Result<f64, String> {
        ask(name, bytes, |record| Ok(record.rate_hz()?.0))
    }

    #[test]
    fn the_rate_of_a_record_is_that_of_recording() {
        assert_eq!(rate("a/run.cih", CIH.as_bytes()), Ok(5000.0));
        assert_eq!(rate("run.CIH", CIH.replace(" : ", " :").as_bytes()), Ok(5000.0));
        assert_eq!(rate("run.cihx", CIHX), Ok(20_000.0));
        assert_eq!(CameraRecord::parse(&companion("run.cihx", CIHX)).unwrap().frame_count(), Some(8));
        assert!(CameraRecord::parse(&companion("run.set", b"")).is_none());
    }

    #[test]
    fn the_saved_step_stands_in_both_kinds() {
        let step =
            |name: &str, bytes: &[u8]| ask(name, bytes, |record| record.saved_step()).map(|step| step.frames);
        assert_eq!(step("run.cih", CIH.as_bytes()), Ok(1));
        assert_eq!(step("run.cih", CIH.replace("Step : 1", "Step : 36").as_bytes()), Ok(36));
        assert_eq!(step("run.cihx", CIHX), Ok(1));
        let text = "<cih><frameInfo><skipFrame>1</skipFrame></frameInfo><basicInfo><skipFrame>2500</skipFrame></cih>";
        let found = ask("run.cihx", text.as_bytes(), |record| record.saved_step()).unwrap();
        assert_eq!((found.frames, found.written.as_str()), (2500, "skipFrame : 2500"));
        assert!(step("run.cih", CIH.replace("Step : 1", "Step : few").as_bytes()).is_err());
    }

    #[test]
    fn exposures_are_fractions_seconds_or_nanoseconds() {
        for (text, seconds) in [("1/10000", 1e-4), ("0.0001", 1e-4), ("10000", 1e-4), ("1/10000 sec", 1e-4)] {
            assert_eq!(parse_exposure(text), Some(seconds), "{text}");
        }
        for text in ["", "open", "1/0", "1/frame", "-1", "0"] {
            assert_eq!(parse_exposure(text), None, "{text}");
        }
        let of = |name: &str, text: &str| {
            ask(name, text.as_bytes(), |record| record.exposure_s(5000.0))
                .map(|found| found.map(|found| found.0))
        };
        assert_eq!(of("run.cih", CIH), Ok(Some(1e-4)));
        let nanoseconds = CIH.replace("END", "Shutter Type2(nsec) : 1250\r\nEND");
        assert_eq!(of("run.cih", &nanoseconds), Ok(Some(1250.0 * 1e-9)));
        assert_eq!(
            of("run.cihx", "<cih><shutterSpeedNsec>50000</shutterSpeedNsec></cih>"),
            Ok(Some(50_000.0 * 1e-9))
        );
        let long = of("run.cih", &CIH.replace("1/10000", "1/60")).unwrap_err();
        assert!(long.starts_with("run.cih:5:1: found `Shutter Speed(s) : 1/60`, an exposure of"), "{long}");
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
        assert!(rate("run.cihx", b"no xml").unwrap_err().contains("no recording rate"));
    }
}
