//! Companions of an export: the record of a Photron camera (`.cih`, `.cihx`) has the recording rate, the
//! saved step and the exposure. A record that contradicts the options or the table is of another video.

use crate::import::error::ImportError;
use crate::import::options::ImportOptions;
use crate::import::reader::findings::new_finding;
use crate::import::reader::photron::{CameraRecord, SavedStep};
use crate::import::reader::rounding::RATE_AGREEMENT;
use crate::import::reader::track_file::{Clock, Fact, TrackFile};
use crate::import::source::{ImportSource, base_name};
use crate::recording::quality::{Check, QualityFinding, Severity};

/// Names of files that may belong to the export `file` and lie in its folder, in the order in which they are
/// read.
#[must_use]
pub fn companion_names(file: &str) -> Vec<String> {
    let stem = file.rsplit_once('.').map_or(file, |(stem, _)| stem);
    let by_extension =
        ["cih", "CIH", "cihx", "CIHX", "set", "SET"].iter().map(|extension| format!("{stem}.{extension}"));
    by_extension.chain(point_names_file(file)).collect()
}

/// DLTdv's list of point names, which belongs to a sparse table of positions.
fn point_names_file(file: &str) -> Option<String> {
    let (folder, base) = file.split_at(file.len() - base_name(file).len());
    base.rsplit_once("xypts")
        .filter(|(_, end)| end.starts_with('.'))
        .map(|(start, end)| format!("{folder}{start}pointNames{end}"))
}

/// Takes rate and exposure from the camera's record of each file, where there is one.
///
/// # Errors
/// [`ImportError::Format`] for a record that cannot be used or contradicts the options or the table; one that
/// says no rate, or is of fewer frames than the table, is a finding where the rate is declared.
pub(crate) fn read_camera_records(
    sources: &[ImportSource],
    exports: &mut [TrackFile],
    options: &ImportOptions,
) -> Result<(), ImportError> {
    for (source, export) in sources.iter().zip(exports) {
        for record in source.companions.iter().filter_map(CameraRecord::parse) {
            match (take_record(&record, export, options), options.frame_rate_hz) {
                (Ok(()), _) => {}
                (Err(RecordRefusal::Unusable(error)), Some(_)) => {
                    export.findings.push(unused_record_finding(&error))
                }
                (Err(RecordRefusal::Unusable(error) | RecordRefusal::Contradiction(error)), _) => {
                    return Err(error);
                }
            }
        }
    }
    Ok(())
}

/// Why a record is not taken.
enum RecordRefusal {
    /// It does not say what it should: a declared rate does without it.
    Unusable(ImportError),
    /// It says something else than the options, the table or another record.
    Contradiction(ImportError),
}

fn unused_record_finding(error: &ImportError) -> QualityFinding {
    let found = format!("the camera's record is not used: {error}");
    new_finding(Check::CameraRecord, Severity::Caution, (0.0, ""), found, "--frame-rate-hz counts")
}

fn take_record(
    record: &CameraRecord,
    export: &mut TrackFile,
    options: &ImportOptions,
) -> Result<(), RecordRefusal> {
    refuse_too_few_frames(record, export)?;
    let (rate_hz, line) = record.rate_hz().map_err(RecordRefusal::Unusable)?;
    let step = record.saved_step().map_err(RecordRefusal::Unusable)?;
    let exposure_s = record.exposure_s(rate_hz).map_err(RecordRefusal::Unusable)?;
    let name = || format!("the camera's record {}", base_name(record.name));
    if step.frames > 1 {
        let finding = saved_step_finding(record, export, options, rate_hz, &step)
            .map_err(RecordRefusal::Contradiction)?;
        export.findings.push(finding);
    } else {
        let fact = &mut export.facts.frame_rate_hz;
        check_agreement(record, fact, (rate_hz, line), "a recording rate", "frames/s")
            .map_err(RecordRefusal::Contradiction)?;
        *fact = Some((rate_hz, name()));
    }
    if let Some((exposure_s, line)) = exposure_s {
        let fact = &mut export.facts.exposure_s;
        check_agreement(record, fact, (exposure_s, line), "an exposure", "s")
            .map_err(RecordRefusal::Contradiction)?;
        *fact = Some((exposure_s, name()));
    }
    Ok(())
}

/// Two records, or a record and the export itself, must agree.
fn check_agreement(
    record: &CameraRecord,
    known: &Fact<f64>,
    (value, line): (f64, usize),
    what: &str,
    unit: &str,
) -> Result<(), ImportError> {
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

/// Where not every frame was saved, the rate of the table is that of the pictures, or that of the camera if
/// the table counts the camera's frames: nobody can say which but the user.
fn saved_step_finding(
    record: &CameraRecord,
    export: &TrackFile,
    options: &ImportOptions,
    rate_hz: f64,
    step: &SavedStep,
) -> Result<QualityFinding, ImportError> {
    let pictures_hz = rate_hz / step.frames as f64;
    let found = format!("`{}`: not every frame of the {rate_hz} a second was saved", step.written);
    let choice = format!(
        "--frame-rate-hz {pictures_hz} where the table counts the saved pictures, or {rate_hz} where its numbers are \
         those of the camera's frames, {} from row to row (or --frame-step {})",
        step.frames, step.frames
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
    Ok(new_finding(
        Check::CameraRecord,
        Severity::Note,
        (step.frames as f64, "frames"),
        found,
        "--frame-rate-hz counts",
    ))
}

/// Whether the frame numbers of a clock are whole steps apart.
fn steps_by(clock: &Clock, step: usize) -> bool {
    let Some(frames) = &clock.frame else { return false };
    let numbers: Vec<f64> = frames.iter().flatten().collect();
    numbers.len() > 1 && numbers.windows(2).all(|pair| (pair[1] - pair[0]) % step as f64 == 0.0)
}

/// A record of fewer frames than the table has belongs to another video.
fn refuse_too_few_frames(record: &CameraRecord, export: &TrackFile) -> Result<(), RecordRefusal> {
    let rows = export.clocks.iter().map(Clock::len).max().unwrap_or(0);
    match record.frame_count().filter(|frames| rows > *frames) {
        Some(frames) => Err(RecordRefusal::Unusable(record.refusal(
            1,
            format!("a record of {frames} frames, but a track of {} with {rows} rows", export.file),
            "the record of the video that was tracked",
        ))),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn companions_share_the_name_of_the_export() {
        assert!(companion_names("a/run 7.csv").contains(&"a/run 7.cih".to_owned()));
        assert!(companion_names("xypts/run7_xypts.tsv").contains(&"xypts/run7_pointNames.tsv".to_owned()));
        assert_eq!(companion_names("xypts/run7.tsv").len(), 6);
    }
}
