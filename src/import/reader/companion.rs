//! Reads the companion files of an export. The record of a Photron camera (`.cih`, `.cihx`) is a file with
//! the recording rate, the number of frames from one saved frame to the next, and the exposure time. A record
//! that contradicts the options or the table belongs to another video.

use super::rate::RATE_AGREEMENT;
use crate::import::error::{ImportError, ImportResult};
use crate::import::options::ImportOptions;
use crate::import::reader::track_file::{Clock, Fact, TrackFile};
use crate::import::source::{CompanionFile, ImportSource, base_name};
use crate::recording::quality::{Check, QualityFinding, Severity};
use crate::text::parse_positive;

/// Paths that companion files of the export `file` may have, in the order in which they are read.
pub(crate) fn companion_names(file: &str) -> Vec<String> {
    let stem = file.rsplit_once('.').map_or(file, |(stem, _)| stem);
    let by_extension = ["cih", "CIH", "cihx", "CIHX"].iter().map(|extension| format!("{stem}.{extension}"));
    by_extension.chain(point_names_file(file)).collect()
}

/// Path of the list of point names that DLTdv writes next to a sparse table, from the path of the table;
/// `None` if the table's name does not have the form `...xypts.EXTENSION`.
fn point_names_file(file: &str) -> Option<String> {
    let (folder, base) = file.split_at(file.len() - base_name(file).len());
    base.rsplit_once("xypts")
        .filter(|(_, end)| end.starts_with('.'))
        .map(|(start, end)| format!("{folder}{start}pointNames{end}"))
}

/// Reads frame rate and exposure time from the camera's record of each file, if there is one.
///
/// # Errors
/// [`ImportError::Other`] for a record that contradicts the options or the table, or whose settings cannot
/// be used. If the user declares the frame rate, a record with unusable settings, or with fewer frames than
/// the table has rows, gives only a finding.
pub(crate) fn read_camera_records(
    sources: &[ImportSource],
    exports: &mut [TrackFile],
    options: &ImportOptions,
) -> ImportResult<()> {
    for (source, export) in sources.iter().zip(exports) {
        for record in source.companions.iter().filter_map(CameraRecord::parse) {
            match CameraSettings::read(&record, export) {
                Ok(settings) => take_settings(&record, settings, export, options)?,
                Err(error) if options.frame_rate_hz.is_some() => {
                    let found = format!("the camera's record is not used: {error}");
                    export.findings.push(record_finding(Severity::Caution, (0.0, ""), found));
                }
                Err(error) => return Err(error),
            }
        }
    }
    Ok(())
}

fn record_finding(severity: Severity, value: (f64, &str), found: String) -> QualityFinding {
    QualityFinding::advise((Check::CameraRecord, severity), value, found, "--frame-rate-hz counts")
}

/// Rates up to this one, 1/s, are placeholders: software that converts videos writes 1 where it knows none.
const PLACEHOLDER_HZ: f64 = 1.0;

/// Settings in a camera's record. Rate and exposure time are stored with their line numbers in the record.
struct CameraSettings {
    rate_hz: (f64, usize),
    step: SavedStep,
    exposure_s: Option<(f64, usize)>,
}

impl CameraSettings {
    /// Reads the settings from a record. A record with fewer frames than the table has rows belongs to
    /// another video and is refused.
    fn read(record: &CameraRecord, export: &TrackFile) -> ImportResult<Self> {
        let rows = export.clocks.iter().map(Clock::len).max().unwrap_or(0);
        if let Some(frames) = record.frame_count().filter(|frames| rows > *frames) {
            let found =
                format!("a record of {frames} frames, but a track of {} with {rows} rows", export.file);
            return Err(record.refusal(1, found, "the record of the video that was tracked"));
        }
        let rate_hz = record.rate_hz()?;
        Ok(Self { rate_hz, step: record.saved_step()?, exposure_s: record.exposure_s(rate_hz.0)? })
    }
}

/// Stores the settings as facts of the export. Settings that contradict the options, the table or another
/// record are refused.
fn take_settings(
    record: &CameraRecord,
    settings: CameraSettings,
    export: &mut TrackFile,
    options: &ImportOptions,
) -> ImportResult<()> {
    let name = || format!("the camera's record {}", base_name(record.name));
    let (rate_hz, _) = settings.rate_hz;
    if rate_hz <= PLACEHOLDER_HZ {
        let found = format!("{} says {rate_hz} frames/s, a placeholder that no video of a blade has", name());
        let advice = "give the rate at which the camera recorded as --frame-rate-hz";
        let value = (rate_hz, "1/s");
        export.findings.push(QualityFinding::advise(
            (Check::CameraRecord, Severity::Caution),
            value,
            found,
            advice,
        ));
        return Ok(());
    }
    if settings.step.frames > 1 {
        let finding = saved_step_finding(record, export, options, rate_hz, &settings.step)?;
        export.findings.push(finding);
    } else {
        let fact = &mut export.facts.frame_rate_hz;
        check_agreement(record, fact, settings.rate_hz, "a recording rate", "frames/s")?;
        *fact = Some((rate_hz, name()));
    }
    if let Some((exposure_s, line)) = settings.exposure_s {
        let fact = &mut export.facts.exposure_s;
        check_agreement(record, fact, (exposure_s, line), "an exposure", "s")?;
        *fact = Some((exposure_s, name()));
    }
    Ok(())
}

/// Refuses `value` if it contradicts `known`, the value of the same quantity from another record or from the
/// export itself.
fn check_agreement(
    record: &CameraRecord,
    known: &Fact<f64>,
    (value, line): (f64, usize),
    what: &str,
    unit: &str,
) -> ImportResult<()> {
    match known.as_ref().filter(|(known, _)| !is_near(*known, value)) {
        Some((known, place)) => {
            Err(record.refusal(line, format!("{what} of {value} {unit}"), &format!("{known} as in {place}")))
        }
        None => Ok(()),
    }
}

fn is_near(one: f64, other: f64) -> bool {
    (one / other - 1.0).abs() <= RATE_AGREEMENT
}

/// Finding about a camera that saved only every n-th frame. The frame numbers of the table may count the
/// saved pictures or all frames of the camera, so the user has to declare the frame rate.
fn saved_step_finding(
    record: &CameraRecord,
    export: &TrackFile,
    options: &ImportOptions,
    rate_hz: f64,
    step: &SavedStep,
) -> ImportResult<QualityFinding> {
    let pictures_hz = rate_hz / step.frames as f64;
    let found = format!("`{}`: not every frame of the {rate_hz} a second was saved", step.written);
    let choice = format!(
        "--frame-rate-hz {pictures_hz} where the table counts the saved pictures, or {rate_hz} where its numbers are \
         those of the camera's frames, {0} from row to row (or --frame-step {0})",
        step.frames
    );
    let declared = options.frame_rate_hz;
    let counts_all =
        || options.frame_step == Some(step.frames) || export.clocks.iter().all(|c| steps_by(c, step.frames));
    let fits = declared.is_some_and(|hz| is_near(hz, pictures_hz) || (is_near(hz, rate_hz) && counts_all()));
    if !fits {
        let found = declared.map_or(found.clone(), |hz| format!("{found}, and --frame-rate-hz {hz}"));
        return Err(record.refusal(step.line, found, &choice));
    }
    let found = format!("{}: {found}", base_name(record.name));
    Ok(record_finding(Severity::Note, (step.frames as f64, "frames"), found))
}

/// Whether the frame number of a clock increases by a multiple of `step` from each row to the next.
fn steps_by(clock: &Clock, step: usize) -> bool {
    let Some(frames) = &clock.frame else { return false };
    let numbers: Vec<f64> = frames.iter().flatten().collect();
    numbers.len() > 1 && numbers.windows(2).all(|pair| (pair[1] - pair[0]) % step as f64 == 0.0)
}

// The record of a Photron camera. A `.cih` file has lines `Key : value`; a `.cihx` file has XML between
// binary data.

/// Names of an entry of a camera's record: the beginning of its key in a `.cih` file, in lower case, and its
/// XML element in a `.cihx` file.
#[derive(Clone, Copy)]
struct CameraRecordKey {
    key: &'static str,
    element: &'static str,
}

const RATE: CameraRecordKey = CameraRecordKey { key: "record rate", element: "recordRate" };
const FRAMES: CameraRecordKey = CameraRecordKey { key: "total frame", element: "totalFrame" };
/// Entry with the number n if only every n-th frame of the recording was saved.
const STEP: CameraRecordKey = CameraRecordKey { key: "save step", element: "skipFrame" };
const SHUTTER_NS: CameraRecordKey =
    CameraRecordKey { key: "shutter type2(nsec)", element: "shutterSpeedNsec" };
/// Entry with the exposure time in seconds, as `1/10000` or `0.0001`; a `.cihx` file contains only the
/// denominator, `10000`.
const SHUTTER: CameraRecordKey = CameraRecordKey { key: "shutter speed", element: "shutterSpeed" };
/// Opening tag of the root element in a `.cihx` file.
const CIHX: &str = "<cih>";
/// Maximum number of characters that an error message shows of a value.
const LONGEST_SHOWN: usize = 40;

const RECORD_ADVICE: &str = "give the rate at which the pictures that were tracked follow each other, --frame-rate-hz N, or \
    move the record to another folder if it belongs to another video";

pub(crate) struct CameraRecord<'a> {
    /// Path of the file as the user gave it.
    pub name: &'a str,
    text: String,
    /// Number of lines of the file before the text.
    skipped: usize,
}

/// Value of an entry, with its line number and with its key or element name as written in the file.
struct CameraRecordValue<'r> {
    text: &'r str,
    line: usize,
    key: &'r str,
}

/// Number of frames from one saved frame to the next, and the line of the record that states it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SavedStep {
    /// The number of frames; 1 if every frame was saved.
    pub frames: usize,
    pub line: usize,
    /// Key and value of the entry as written in the file.
    pub written: String,
}

impl<'a> CameraRecord<'a> {
    /// Reads the camera's record in a companion file; `None` if the file does not have the extension of a
    /// record. Bytes that are not UTF-8 are replaced.
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

    /// All values of an entry, in the order of the file. In a record that was saved again, an entry may occur
    /// several times; the first value is that of the saved video.
    fn values(&self, entry: CameraRecordKey) -> Vec<CameraRecordValue<'_>> {
        if self.text.starts_with(CIHX) { self.xml_values(entry.element) } else { self.text_values(entry.key) }
    }

    fn text_values(&self, wanted: &str) -> Vec<CameraRecordValue<'_>> {
        let lines = self.text.lines().enumerate().filter_map(|(at, line)| {
            let (key, value) = line.split_once(':')?;
            let known = key.trim().to_lowercase().starts_with(wanted);
            let (text, line, key) = (value.trim(), self.skipped + at + 1, key.trim());
            known.then_some(CameraRecordValue { text, line, key })
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

    /// The rate at which the camera recorded, 1/s, and its line number.
    pub(crate) fn rate_hz(&self) -> ImportResult<(f64, usize)> {
        let Some(value) = self.values(RATE).into_iter().next() else {
            return Err(self.refusal(1, "no recording rate".to_owned(), "the entry `Record Rate(fps)`"));
        };
        let found = || format!("the recording rate `{}`", shorten_value(value.text));
        let rate = parse_positive(value.text).map(|rate| (rate, value.line));
        rate.ok_or_else(|| self.refusal(value.line, found(), "a number above 0"))
    }

    /// Number of frames from one saved frame to the next. A `.cihx` file contains this number in several
    /// places; the largest is used.
    pub(crate) fn saved_step(&self) -> ImportResult<SavedStep> {
        let mut values = self.values(STEP);
        if !self.text.starts_with(CIHX) {
            values.truncate(1);
        }
        let mut found = SavedStep { frames: 1, line: 1, written: String::new() };
        for value in values {
            let written = format!("{} : {}", value.key, shorten_value(value.text));
            let expected = "a whole number of frames from picture to picture";
            let refuse = |_| self.refusal(value.line, format!("`{written}`"), expected);
            let frames = match value.text {
                "" | "0" => 1,
                text => text.parse::<usize>().map_err(refuse)?,
            };
            if frames > found.frames {
                found = SavedStep { frames, line: value.line, written };
            }
        }
        Ok(found)
    }

    pub(crate) fn frame_count(&self) -> Option<usize> {
        self.values(FRAMES).first()?.text.parse().ok()
    }

    /// Exposure time of a frame, s, and its line number; `None` if the record has none. `rate_hz` is the
    /// frame rate of the camera, 1/s.
    ///
    /// # Errors
    /// [`ImportError::Other`] if the exposure time is longer than the time of a frame, 1 / `rate_hz`.
    pub(crate) fn exposure_s(&self, rate_hz: f64) -> ImportResult<Option<(f64, usize)>> {
        let (nanoseconds, seconds) = (self.values(SHUTTER_NS), self.values(SHUTTER));
        let found = nanoseconds.first().and_then(|value| Some((parse_positive(value.text)? * 1e-9, value)));
        let found =
            found.or_else(|| seconds.first().and_then(|value| Some((parse_exposure(value.text)?, value))));
        let Some((exposure_s, CameraRecordValue { text, line, key })) = found else { return Ok(None) };
        if exposure_s * rate_hz > 1.0 + RATE_AGREEMENT {
            let found = format!("`{key} : {}`, an exposure of {exposure_s} s", shorten_value(text));
            let expected = format!("at most the time of a frame, {} s at {rate_hz} frames/s", 1.0 / rate_hz);
            return Err(self.refusal(*line, found, &expected));
        }
        Ok(Some((exposure_s, *line)))
    }

    pub(crate) fn refusal(&self, line: usize, found: String, expected: &str) -> ImportError {
        ImportError::format(format!("{}:{line}:1", self.name), found, expected, RECORD_ADVICE)
    }
}

fn shorten_value(text: &str) -> String {
    text.chars().take(LONGEST_SHOWN).collect()
}

/// Converts a text such as `1/10000`, `0.0001` or `10000`, with or without a unit, to an exposure time in
/// seconds. Exposure times are shorter than a second, so a number of 1 or more is a reciprocal.
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

    #[test]
    fn companions_share_the_name_of_the_export() {
        assert!(companion_names("a/run 7.csv").contains(&"a/run 7.cih".to_owned()));
        assert!(companion_names("xypts/run7_xypts.tsv").contains(&"xypts/run7_pointNames.tsv".to_owned()));
        assert_eq!(companion_names("xypts/run7.tsv").len(), 4);
    }

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
        assert!(CameraRecord::parse(&companion("run_pointNames.tsv", b"")).is_none());
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
