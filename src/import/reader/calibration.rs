//! Frame rate, scale, direction of y and unit of the times. They come from the user, the file or the
//! documentation of its format; an import that lacks one is refused and asks for it.

use super::timing::{RATE_AGREEMENT, times_fit_rate};
use super::track_file::{CoordinateUnit, TimeUnit};
use crate::import::error::{ImportError, ImportResult};
use crate::import::options::{CoordinateScale, ImportOptions, TimeColumn};
use crate::import::reader::track_file::TrackFile;
use crate::import::reader::{findings, track_choice};
use crate::import::source::ImportReport;
use crate::recording::clock;
use crate::recording::files::YAxis;

/// Times that imply a frame rate up to this value, 1/s, look like frame numbers: no camera that films a wiper
/// is so slow.
const SLOWEST_HZ: f64 = 1.0;

/// Explains what the direction of y depends on, if the format has no explanation of its own.
const Y_AXIS_OPEN: &str = "world coordinates point up unless their axes were turned; image pixels point down";

/// Facts that every import needs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ImportCalibration {
    pub rate_hz: f64,
    pub scale: CoordinateScale,
    pub y_axis: YAxis,
    /// Exposure time of a frame, s.
    pub exposure_s: Option<f64>,
}

/// Converts the times of every export to seconds or frames, and collects the other facts. One error lists
/// everything that is missing, with what the files suggest.
pub(crate) fn calibrate(
    exports: &mut [TrackFile],
    options: &ImportOptions,
    report: &mut ImportReport,
) -> ImportResult<ImportCalibration> {
    let mut missing = vec![];
    if !exports.iter_mut().all(|export| convert_times(export, options.time)) {
        missing.push(ASK_TIME.to_owned());
    }
    let rate_hz = frame_rate_hz(exports, options, report)?;
    if rate_hz.is_none() {
        missing.push(ask_rate(exports));
    }
    let scale = coordinate_scale(exports, options, report);
    if scale.is_none() {
        missing.push(ask_scale(exports));
    }
    let y_axis = y_direction(exports, options, report);
    if y_axis.is_none() {
        let open = exports.iter().find_map(|export| export.facts.y_axis_open).unwrap_or(Y_AXIS_OPEN);
        missing.push(format!("--y-axis up|down    {open}"));
    }
    if let (Some(rate_hz), Some(scale), Some(y_axis), true) = (rate_hz, scale, y_axis, missing.is_empty()) {
        let exposure_s = exposure_s(exports, options, report)?;
        return Ok(ImportCalibration { rate_hz, scale, y_axis, exposure_s });
    }
    if let Err(ImportError::Point { advice, .. }) = track_choice::choose_tracks(exports, options) {
        missing.push(format!("--point tip=NAME --point head=NAME   which tracks are meant; {advice}"));
    }
    let files = exports.iter().map(|export| export.file).collect::<Vec<_>>().join(", ");
    Err(ImportError::MissingOptions { files, format: report.format.clone(), missing })
}

const ASK_TIME: &str = "--time UNIT         the times have the unit of the program's preferences, or another \
    that the file does not name: real (seconds), ms, frames, or playback";

fn ask_rate(exports: &[TrackFile]) -> String {
    let timed = exports.iter().flat_map(|export| &export.clocks).any(|clock| clock.time.is_some());
    let hint = match exports.iter().find_map(implied_hz) {
        Some(hz) if hz <= SLOWEST_HZ => {
            "the file's times count like frame numbers: if they are, add --time frames".to_owned()
        }
        Some(hz) => format!(
            "the file's times imply {hz:.6}, which may be the playback rate (if you know that they are the \
             recording's own, say --time real)"
        ),
        None if timed => "the file's times repeat, go back or follow no rate".to_owned(),
        None => "the file does not time its frames".to_owned(),
    };
    format!("--frame-rate-hz N   the rate at which the camera recorded, from its own record; {hint}")
}

fn ask_scale(exports: &[TrackFile]) -> String {
    let hint = match exports.iter().find_map(|export| export.facts.unit.as_ref()) {
        Some((_, why)) => format!("the length that a pixel shows, such as 21.5um/px: {why}"),
        None => {
            "21.5um/px if the coordinates are pixels, or their length unit: m, cm, mm, um. The file does \
             not name it: it is the unit of the calibration, or pixels if there was none"
                .to_owned()
        }
    };
    format!("--scale S           {hint}")
}

/// Converts times to seconds, or to frame numbers if `declared` says so. Returns false if the unit of the
/// times is unknown and the rows have no frame numbers.
fn convert_times(export: &mut TrackFile, declared: Option<TimeColumn>) -> bool {
    let numbered = export.clocks.iter().all(|clock| clock.frame.is_some());
    let factor = match (declared, export.facts.time) {
        (Some(TimeColumn::Frames), _) => {
            for clock in export.clocks.iter_mut().filter(|clock| clock.frame.is_none()) {
                clock.frame = clock.time.take();
            }
            return true;
        }
        (Some(TimeColumn::Milliseconds), _) => 1e-3,
        (_, TimeUnit::Seconds(seconds)) => seconds,
        (Some(TimeColumn::Real | TimeColumn::Playback), _) | (None, TimeUnit::AssumedSeconds) => 1.0,
        (None, TimeUnit::Unknown) => {
            for clock in export.clocks.iter_mut().filter(|clock| clock.frame.is_some()) {
                clock.time = None;
            }
            return numbered;
        }
    };
    // (a double cannot hold 1e-3 exactly: multiplying by it rounds twice, dividing by 1000 rounds once)
    let divide = if factor < 1.0 { (1.0 / factor).round() } else { 1.0 };
    for time in export.clocks.iter_mut().filter_map(|clock| clock.time.as_mut()) {
        if factor < 1.0 { time.divide(divide) } else { time.scale(factor) }
    }
    true
}

/// The declared frame rate, or else that of the camera's record, or else that of times declared to be real.
fn frame_rate_hz(
    exports: &[TrackFile],
    options: &ImportOptions,
    report: &mut ImportReport,
) -> ImportResult<Option<f64>> {
    let records: Vec<&(f64, String)> =
        exports.iter().filter_map(|export| export.facts.frame_rate_hz.as_ref()).collect();
    let declared = options.frame_rate_hz.or(records.first().map(|first| first.0));
    if let Some(declared_hz) = declared {
        let disagrees = |rate_hz: f64| (rate_hz / declared_hz - 1.0).abs() > RATE_AGREEMENT;
        if let Some((recorded_hz, record)) = records.iter().find(|record| disagrees(record.0)) {
            let (recorded_hz, record) = (*recorded_hz, record.clone());
            return Err(ImportError::RecordedRateMismatch { declared_hz, record, recorded_hz });
        }
        if options.frame_rate_hz.is_none() {
            let note = |(rate, record): &&(f64, String)| format!("recording rate {rate} frames/s: {record}");
            report.notes.extend(records.first().map(note));
        }
        return Ok(declared);
    }
    if !matches!(options.time, Some(TimeColumn::Real | TimeColumn::Milliseconds)) {
        return Ok(None);
    }
    let implied = exports.iter().find_map(implied_hz);
    report.findings.extend(implied.filter(|hz| *hz <= SLOWEST_HZ).map(findings::counted_frames_finding));
    let source = "from the times, which --time declares to be the recording's own";
    report.notes.extend(implied.map(|hz| format!("recording rate {hz} frames/s: {source}")));
    Ok(implied)
}

/// The declared exposure time, or else that of the first camera's record. Refuses a record with another
/// exposure time.
fn exposure_s(
    exports: &[TrackFile],
    options: &ImportOptions,
    report: &mut ImportReport,
) -> ImportResult<Option<f64>> {
    let recorded = || exports.iter().filter_map(|export| export.facts.exposure_s.as_ref());
    let exposure_s = options.exposure_s.or(recorded().next().map(|first| first.0));
    let Some(exposure_s) = exposure_s else { return Ok(None) };
    if let Some((other_s, place)) = recorded().find(|(s, _)| (s / exposure_s - 1.0).abs() > RATE_AGREEMENT) {
        let expected = format!(
            "{other_s} as in {place}: leave the option out, or move the record to another folder if it belongs to \
             another video"
        );
        return Err(ImportError::option("--exposure-s", exposure_s, expected));
    }
    if let (None, Some((_, place))) = (options.exposure_s, recorded().next()) {
        report.notes.push(format!("exposure {exposure_s} s: {place}"));
    }
    Ok(Some(exposure_s))
}

/// Frame rate that the times of an export imply, 1/s.
fn implied_hz(export: &TrackFile) -> Option<f64> {
    let timed = export.clocks.iter().filter(|clock| clock.time.is_some());
    let longest = timed.max_by_key(|clock| clock.len())?;
    let times = longest.times();
    if let (Some(frames), Some(column)) = (&longest.frame, &longest.time) {
        let (frames, times): (Vec<f64>, Vec<f64>) =
            frames.iter().zip(column.iter()).filter_map(|(frame, time)| frame.zip(time)).unzip();
        let rate = (frames.last()? - frames.first()?) / (times.last()? - times.first()?);
        return (rate.is_finite() && rate > 0.0)
            .then(|| clock::simplest_rate(rate, |rate| times_fit_rate(&times, &frames, rate)));
    }
    let step_s = clock::median_step_s(&times)?;
    let fit = (step_s > 0.0).then(|| clock::number_frames(&times, step_s))??;
    let frames: Vec<f64> = fit.frames.iter().map(|frame| *frame as f64).collect();
    Some(clock::simplest_rate(1.0 / fit.frame_s, |rate| times_fit_rate(&times, &frames, rate)))
}

/// The declared scale, or else a unit of length from the file; a contradiction between them gives a finding.
fn coordinate_scale(
    exports: &[TrackFile],
    options: &ImportOptions,
    report: &mut ImportReport,
) -> Option<CoordinateScale> {
    let stated = exports.iter().find_map(|export| export.facts.unit.as_ref());
    match (options.scale, stated) {
        (Some(scale), Some((unit, why))) => {
            report.findings.extend(findings::unit_mismatch_finding(scale, *unit, why));
            Some(scale)
        }
        (Some(scale), None) => Some(scale),
        (None, Some((unit @ CoordinateUnit::Metres(metres), why))) => {
            report.notes.push(format!("lengths in {}: {why}", unit.describe()));
            Some(CoordinateScale::Unit(*metres))
        }
        (None, _) => None,
    }
}

fn y_direction(exports: &[TrackFile], options: &ImportOptions, report: &mut ImportReport) -> Option<YAxis> {
    let fact = exports.iter().find_map(|export| export.facts.y_axis.as_ref());
    let Some((stated, why)) = fact else { return options.y_axis };
    let word = |axis: YAxis| if axis == YAxis::Up { "up" } else { "down" };
    match options.y_axis {
        Some(declared) if declared != *stated => {
            report.findings.push(findings::y_axis_mismatch_finding(word(declared), word(*stated), why));
        }
        Some(_) => {}
        None => report.notes.push(format!("y points {}: {why}", word(*stated))),
    }
    options.y_axis.or(Some(*stated))
}
