//! Determines frame rate, scale, direction of y and unit of the times. They come from the user, the file or
//! the documentation of its format. If one of them is unknown, the import is refused, and the error asks the
//! user for it.

use super::column::{CoordinateUnit, TimeUnit};
use super::rate::{FrameRate, RATE_AGREEMENT, has_uneven_clock, implied_rate};
use crate::import::error::{ImportError, ImportProblem, ImportResult};
use crate::import::options::{CoordinateScale, ImportOptions, TimeColumn};
use crate::import::reader::findings;
use crate::import::reader::track_choice::TrackIndex;
use crate::import::reader::track_file::TrackFile;
use crate::import::source::ImportReport;
use crate::recording::files::YAxis;
use crate::recording::quality::QualityFinding;
use crate::text::format_rate;

/// If the times imply a frame rate of at most this value, 1/s, they look like frame numbers: no camera that
/// films a wiper is so slow.
const SLOWEST_HZ: f64 = 1.0;
/// A millisecond, s.
const MILLISECOND_S: f64 = 1e-3;

/// Text on what the direction of y depends on; used if the format has no such text of its own.
const Y_AXIS_OPEN: &str = "world coordinates point up unless their axes were turned; image pixels point down";

/// Facts that every import needs.
#[derive(Debug, Clone)]
pub(crate) struct ImportCalibration {
    pub rate: FrameRate,
    /// Largest allowed relative difference between `rate` and the rate that the file's times imply; it
    /// includes the errors of both rates.
    pub tolerance: f64,
    /// Scales of x and y of the tip, and of x and y of the head.
    pub scales: [[CoordinateScale; 2]; 2],
    pub y_axis: YAxis,
    /// Exposure time of a frame, s; `None` if unknown.
    pub exposure_s: Option<f64>,
}

impl ImportCalibration {
    /// Length that one pixel shows, m; `None` if no coordinate is in pixels.
    pub(crate) fn metres_per_pixel(&self) -> Option<f64> {
        self.scales.as_flattened().iter().find_map(|scale| match scale {
            CoordinateScale::MetresPerPixel(metres) => Some(*metres),
            CoordinateScale::Unit(_) => None,
        })
    }
}

/// Tracks chosen for the tip and the head, or the error if they cannot be chosen.
type TrackChoice = ImportResult<[Option<TrackIndex>; 2]>;

/// Converts the times of every export to seconds or frames, and collects the other facts. One error lists
/// every missing fact and what the files suggest for it.
pub(crate) fn calibrate(
    exports: &mut [TrackFile],
    chosen: &TrackChoice,
    options: &ImportOptions,
    report: &mut ImportReport,
) -> ImportResult<ImportCalibration> {
    let mut missing = vec![];
    for export in exports.iter_mut() {
        if !convert_times(export, options)? && missing.is_empty() {
            missing.push(ASK_TIME.to_owned());
        }
    }
    let uneven = options.time != Some(TimeColumn::Playback) && exports.iter().any(has_uneven_clock);
    let implied = exports.iter().find_map(implied_rate);
    let rate = frame_rate(exports, implied.as_ref(), options, report)?;
    if rate.is_none() {
        missing.push(ask_rate(exports, implied.as_ref()));
    }
    let scales = coordinate_scales(exports, chosen, options, report)?;
    if scales.is_none() {
        missing.push(ask_scale(exports));
    }
    let y_axis = y_direction(exports, options, report);
    if y_axis.is_none() {
        let open = exports.iter().find_map(|export| export.facts.y_axis_open).unwrap_or(Y_AXIS_OPEN);
        missing.push(format!("--y-axis up|down    {open}"));
    }
    if let (Some(rate), Some(scales), Some(y_axis), true) = (rate, scales, y_axis, missing.is_empty()) {
        let exposure_s = exposure_s(exports, options, report)?;
        let tolerance = RATE_AGREEMENT + rate.error + implied.as_ref().map_or(0.0, |implied| implied.error);
        if options.time != Some(TimeColumn::Playback) && !uneven {
            report.findings.extend(implied.and_then(|times| compare_rates(&rate, times, options)));
        }
        return Ok(ImportCalibration { rate, tolerance, scales, y_axis, exposure_s });
    }
    if let Err(ImportError::Point(ImportProblem { advice, .. })) = chosen {
        missing.push(format!("--point tip=NAME --point head=NAME   which tracks are meant; {advice}"));
    }
    let files = exports.iter().map(|export| export.file).collect::<Vec<_>>().join(", ");
    Err(ImportError::missing_options(&files, &report.format, &missing))
}

const ASK_TIME: &str = "--time UNIT         the times have the unit of the program's preferences, or another \
    that the file does not name: real (seconds), ms, frames, or playback";

fn ask_rate(exports: &[TrackFile], implied: Option<&FrameRate>) -> String {
    let timed = exports.iter().flat_map(|export| &export.clocks).any(|clock| clock.time.is_some());
    let hint = match implied.map(|rate| rate.hz) {
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

/// Converts times to seconds, or to frame numbers if `--time` says so. Returns false if the unit of the times
/// is unknown and the rows have no frame numbers. Refuses the file if it states another unit of the times
/// than `--time` does.
fn convert_times(export: &mut TrackFile, options: &ImportOptions) -> ImportResult<bool> {
    let numbered = export.clocks.iter().all(|clock| clock.frame.is_some());
    let factor = match (options.time, export.facts.time) {
        (Some(TimeColumn::Frames), _) => {
            for clock in export.clocks.iter_mut().filter(|clock| clock.frame.is_none()) {
                clock.frame = clock.time.take();
            }
            return Ok(true);
        }
        (Some(TimeColumn::Milliseconds), TimeUnit::Seconds(seconds)) if seconds != MILLISECOND_S => {
            let expected = format!(
                "the unit that {} gives for its times, {seconds} s: leave the option out, or correct the header",
                export.file
            );
            return Err(ImportError::option("--time", "ms", expected));
        }
        (Some(TimeColumn::Milliseconds), _) => MILLISECOND_S,
        (_, TimeUnit::Seconds(seconds)) => seconds,
        (Some(TimeColumn::Real | TimeColumn::Playback), _) | (None, TimeUnit::AssumedSeconds) => 1.0,
        (None, TimeUnit::Unknown | TimeUnit::Unreadable) => {
            for clock in export.clocks.iter_mut().filter(|clock| clock.frame.is_some()) {
                clock.time = None;
            }
            return Ok(numbered);
        }
    };
    for clock in &mut export.clocks {
        clock.digit *= factor;
        clock.time.iter_mut().for_each(|time| time.convert_unit(factor));
    }
    Ok(true)
}

/// The frame rate: the declared one, or else the one in the camera's record, or else the one that the times
/// imply if `--time` declares them to be real.
fn frame_rate(
    exports: &[TrackFile],
    implied: Option<&FrameRate>,
    options: &ImportOptions,
    report: &mut ImportReport,
) -> ImportResult<Option<FrameRate>> {
    let records: Vec<FrameRate> = exports
        .iter()
        .filter_map(|export| export.facts.frame_rate_hz.as_ref())
        .map(|(hz, record)| FrameRate::from_statement(*hz, record))
        .collect();
    let declared = options.frame_rate_hz.map(|hz| FrameRate::from_statement(hz, "--frame-rate-hz"));
    if let Some(used) = declared.as_ref().or(records.first()) {
        if let Some(other) = records.iter().find(|record| used.difference(record) > RATE_AGREEMENT) {
            let problem = format!(
                "found {}, but {} has {} frames/s; leave the option out if that is the rate at which this video was \
                 recorded, or move the record away if it belongs to another one",
                used.hz, other.source, other.hz
            );
            return Err(ImportError::unusable("--frame-rate-hz", problem));
        }
        if declared.is_none() {
            report.notes.push(format!("recording rate {} frames/s: {}", format_rate(used.hz), used.source));
        }
        report.findings.extend(records.iter().filter_map(|record| findings::rate_difference(used, record)));
        return Ok(Some(used.clone()));
    }
    if !matches!(options.time, Some(TimeColumn::Real | TimeColumn::Milliseconds)) {
        return Ok(None);
    }
    report
        .findings
        .extend(implied.filter(|rate| rate.hz <= SLOWEST_HZ).map(findings::counted_frames_finding));
    let source = "from the times, which --time declares to be the recording's own";
    report
        .notes
        .extend(implied.map(|rate| format!("recording rate {} frames/s: {source}", format_rate(rate.hz))));
    Ok(implied.cloned())
}

/// Finding if the rate that the times imply differs from the rate that is used. If the times themselves gave
/// the used rate, finding if that rate has a large error.
fn compare_rates(used: &FrameRate, mut times: FrameRate, options: &ImportOptions) -> Option<QualityFinding> {
    if used.source == times.source {
        return findings::coarse_rate_finding(used);
    }
    times.hz *= options.frame_step.unwrap_or(1) as f64;
    findings::rate_difference(used, &times)
}

/// Exposure time, s: the one that the user declares, or else the one in the first camera's record. A record
/// with another exposure time is refused.
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

/// Scales of x and y of both points: the unit in the header of a column, or else `--scale`, or else the unit
/// of the file. `None` if a scale is missing. Refuses `--scale` where the header or the file states another
/// unit of length.
fn coordinate_scales(
    exports: &[TrackFile],
    chosen: &TrackChoice,
    options: &ImportOptions,
    report: &mut ImportReport,
) -> ImportResult<Option<[[CoordinateScale; 2]; 2]>> {
    let all = exports
        .iter()
        .enumerate()
        .flat_map(|(file, export)| (0..export.tracks.len()).map(move |at| (file, at)));
    let declared = options.scale.filter(|_| chosen.is_ok());
    let chosen = chosen.as_ref().map_or_else(|_| all.map(Some).collect(), |chosen| chosen.to_vec());
    // (a column whose header has no unit takes that of the other coordinate of its point)
    let stated = |(file, track): TrackIndex| {
        let [x, y] = &exports[file].tracks[track].units;
        let fact = exports[file].facts.unit.as_ref();
        [x.as_ref().or(y.as_ref()).or(fact), y.as_ref().or(x.as_ref()).or(fact)]
    };
    let units: Vec<_> = chosen.iter().map(|track| track.map_or([None, None], stated)).collect();
    let known = || units.as_flattened().iter().flatten();
    let lengths = || known().filter(|(unit, _)| *unit != CoordinateUnit::Pixel);
    let used = chosen.iter().flatten().count();
    if let Some(scale) = declared {
        // (a length per pixel applies to the columns in pixels or without a unit, if there are any)
        let of_pixels = matches!(scale, CoordinateScale::MetresPerPixel(_)) && lengths().count() < 2 * used;
        let in_header = |stated: &(CoordinateUnit, String)| {
            chosen.iter().flatten().any(|(file, track)| {
                exports[*file].tracks[*track].units.iter().flatten().any(|unit| unit == stated)
            })
        };
        let refused = |stated: &&(CoordinateUnit, String)| {
            let length = stated.0 != CoordinateUnit::Pixel;
            !scale.agrees_with(stated.0) && if length { !of_pixels } else { in_header(stated) }
        };
        if let Some((unit, why)) = known().copied().find(refused) {
            let expected = format!(
                "{} ({why}): leave the option out, or correct the unit in a copy of the file",
                unit.describe()
            );
            return Err(ImportError::option("--scale", scale.describe(), expected));
        }
        let pixels = known().find(|(unit, _)| *unit == CoordinateUnit::Pixel);
        if let (CoordinateScale::Unit(_), Some((unit, why))) = (scale, pixels) {
            report.findings.push(findings::unit_mismatch_finding(scale, *unit, why));
        }
    } else if let Some((unit, why)) = lengths().next() {
        report.notes.push(format!("lengths in {}: {why}", unit.describe()));
        let others = lengths().filter(|(other, _)| other != unit);
        report.notes.extend(others.map(|(other, why)| format!("lengths in {}: {why}", other.describe())));
        report.notes.dedup();
    }
    let scale_of = |unit: &Option<&(CoordinateUnit, String)>| match unit {
        Some((CoordinateUnit::Metres(metres), _)) => Some(CoordinateScale::Unit(*metres)),
        _ => options.scale,
    };
    let scales: Vec<[Option<CoordinateScale>; 2]> =
        units.iter().map(|unit| [scale_of(&unit[0]), scale_of(&unit[1])]).collect();
    let of_tracks = |point: usize| chosen.get(point).is_some_and(Option::is_some);
    if (0..scales.len()).any(|point| of_tracks(point) && scales[point].contains(&None)) {
        return Ok(None);
    }
    let any = scales.as_flattened().iter().flatten().next().copied().unwrap_or(CoordinateScale::Unit(1.0));
    Ok(Some(
        [0, 1].map(|point| scales.get(point).map_or([any; 2], |pair| pair.map(|scale| scale.unwrap_or(any)))),
    ))
}

fn y_direction(exports: &[TrackFile], options: &ImportOptions, report: &mut ImportReport) -> Option<YAxis> {
    let fact = exports.iter().find_map(|export| export.facts.y_axis.as_ref());
    // (tracks without y have no direction to ask for)
    let has_y = exports.iter().flat_map(|export| &export.tracks).any(|track| track.y.is_some());
    let Some((stated, why)) = fact else { return options.y_axis.or((!has_y).then_some(YAxis::Up)) };
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
