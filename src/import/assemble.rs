//! Makes a recording from the tracks of the files: converts units, chooses the tracks of tip and head, puts
//! both on one frame grid, and adds the findings and the description of the recording.

use super::error::{ImportError, ImportResult};
use super::options::ImportOptions;
use super::source::{Import, ImportReport, ImportSource, base_name, preserved_files};
use crate::import::reader::calibration::calibrate;
use crate::import::reader::encoding::DecodedText;
use crate::import::reader::grid::{ClockGrid, GridPositions};
use crate::import::reader::track_choice::TrackIndex;
use crate::import::reader::track_file::TrackFile;
use crate::import::reader::{companion, findings, track_choice};
use crate::recording::channel::ReversalInstants;
use crate::recording::files::{CameraEntry, FrameClock, LevelEntry, OneOrMany, RecordingFile, SourceEntry};
use crate::recording::quality::{
    Check, Optics, QualityFinding, Severity, check_position_steps, drop_untracked, find_untracked_frames,
    measure_quality, measure_tilt,
};
use crate::recording::{Recording, Traces, rotate_traces};
use crate::toml_file;

/// Word that marks simulated data if it occurs in the name of a track or in a header of the file.
const SYNTHETIC: &str = "synthetic";

pub(crate) fn assemble_recording(
    sources: &[ImportSource],
    decoded: &[DecodedText],
    mut exports: Vec<TrackFile>,
    options: &ImportOptions,
    mut report: ImportReport,
) -> ImportResult<Import> {
    companion::read_camera_records(sources, &mut exports, options)?;
    track_choice::number_repeated_names(&mut exports);
    let chosen = track_choice::choose_tracks(&exports, options);
    let calibration = calibrate(&mut exports, &chosen, options, &mut report)?;
    let chosen = chosen?;
    for export in &mut exports {
        report.notes.extend(export.notes.iter().map(|note| format!("{}: {note}", export.file)));
        report.findings.append(&mut export.findings);
    }
    let clocks = ClockGrid::align(&exports, &chosen, &calibration, options)?;
    clocks.report_findings(&exports, options, &mut report);
    let synthetic = options.twin.is_some() || exports.iter().any(is_synthetic);
    let mut points = [0, 1].map(|index| GridPositions::from_track(&mut exports, &clocks, chosen[index]));
    refuse_no_position(&exports, &chosen, &points)?;
    note_points(&exports, &chosen, &points, &mut report);
    for ((point, choice), scales) in points.iter_mut().zip(chosen).zip(calibration.scales) {
        let Some((file, track)) = choice else { continue };
        let name = &exports[file].tracks[track].name;
        report.findings.extend(findings::position_findings(name, &point.x, &point.y, scales[0]));
        point.reject_unlikely(name, options.min_likelihood, &mut report)?;
        point.convert_to_metres(scales, calibration.y_axis);
    }
    drop(exports);
    for source in sources {
        // (stored findings must not depend on the folder of the files, so each path is replaced by its file
        // name)
        let name = base_name(&source.name);
        report
            .findings
            .iter_mut()
            .for_each(|finding| finding.found = finding.found.replace(&source.name, name));
    }
    let file_name = sources.first().map_or("", |source| source.name.as_str());
    let [tip, head] = points;
    let traces = Traces {
        tip_x_m: tip.x,
        tip_y_m: tip.y,
        head_x_m: head.x,
        head_y_m: head.y,
        tip_confidence: tip.confidence,
        head_confidence: head.confidence,
    };
    let name = options.name.clone();
    let recording = match clocks.times {
        Some(times_s) => Recording::from_times(name, times_s, traces, synthetic),
        None => Recording::new(name, clocks.grid, traces, synthetic),
    };
    // (a simulation has an exact clock)
    let rate_sd_hz = (!synthetic).then(|| calibration.rate.sd_hz());
    let recording = recording
        .and_then(|recording| recording.with_frame_rate_sd(rate_sd_hz))
        .map_err(|problem| ImportError::unusable(file_name, problem))?;
    let camera = CameraEntry {
        frame_rate_hz: recording.grid().frame_rate_hz,
        frame_rate_sd_hz: recording.frame_rate_sd_hz(),
        clock: recording.frame_times_s().map(|_| FrameClock::Times),
        exposure_s: calibration.exposure_s,
        metres_per_pixel: calibration.metres_per_pixel(),
        y_axis: Some(calibration.y_axis),
    };
    let optics = Optics::from(&camera);
    let recording = leave_out_untracked(recording, file_name, (options, &optics), &mut report)?;
    let (recording, level) = level_recording(recording, file_name, (options, &optics), &mut report)?;
    let described = describe_recording(sources, decoded, options, camera, &recording, &report)?;
    let file = RecordingFile { level, ..described };
    Ok(Import { recording, file, report })
}

/// Removes the positions that nobody tracked from the recording, if `--drop-untracked` is given.
fn leave_out_untracked(
    recording: Recording,
    file: &str,
    (options, optics): (&ImportOptions, &Optics),
    report: &mut ImportReport,
) -> ImportResult<Recording> {
    if !options.drop_untracked {
        return Ok(recording);
    }
    let untracked =
        find_untracked_frames(&recording, &measure_quality(&recording, optics.exposure_s), optics);
    let notes =
        untracked.iter().map(|found| format!("left out as nobody tracked them: {}", found.describe()));
    report.notes.extend(notes);
    let traces = drop_untracked(recording.traces().clone(), &untracked);
    recording.with_traces(traces).map_err(|problem| ImportError::unusable(file, problem))
}

/// Refuses an import in which no chosen track has any position.
fn refuse_no_position(
    exports: &[TrackFile],
    chosen: &[Option<TrackIndex>; 2],
    points: &[GridPositions; 2],
) -> ImportResult<()> {
    if points.iter().any(|point| point.tracked_frames().is_some()) {
        return Ok(());
    }
    let used = || chosen.iter().flatten();
    let names: Vec<String> =
        used().map(|(file, track)| format!("`{}`", exports[*file].tracks[*track].name)).collect();
    let file = used().next().map_or("", |(file, _)| exports[*file].file);
    let found = format!("no position of {} in any row", names.join(" or "));
    let advice = "export the table of the tracked points, or name other columns";
    Err(ImportError::format(file, found, "some", advice))
}

fn note_points(
    exports: &[TrackFile],
    chosen: &[Option<TrackIndex>; 2],
    points: &[GridPositions; 2],
    report: &mut ImportReport,
) {
    let lacks = |found: String, advice: &str| {
        QualityFinding::advise((Check::Points, Severity::Caution), (0.0, ""), found, advice)
    };
    for ((point, choice), on_grid) in ["tip", "head"].into_iter().zip(chosen).zip(points) {
        match choice {
            Some((file, track)) => {
                report.notes.push(format!(
                    "{point}: track `{}` of {}",
                    exports[*file].tracks[*track].name, exports[*file].file
                ));
                if on_grid.tracked_frames().is_none() {
                    let found = format!(
                        "{point}: its track has no position in any row; its columns stay empty and there is no \
                         deflection"
                    );
                    report.findings.push(lacks(found, ""));
                } else if on_grid.y.iter().all(Option::is_none) {
                    report.notes.push(format!("{point}: the export has no y; that column stays empty"));
                }
            }
            None => {
                let advice = track_choice::unchosen_advice(exports, chosen, point).unwrap_or_default();
                let found =
                    format!("no track for the {point}: its columns stay empty and there is no deflection");
                report.findings.push(lacks(found, &advice));
            }
        }
    }
    if let [Some(tip), Some(head)] = [points[0].tracked_frames(), points[1].tracked_frames()]
        && tip != head
    {
        report.notes.push(format!(
            "the tip is tracked in frames {} to {}, the head in {} to {}: only what they share \
                has a deflection",
            tip.0, tip.1, head.0, head.1
        ));
    }
}

fn is_synthetic(export: &TrackFile) -> bool {
    let names = export.tracks.iter().map(|track| &track.name).chain(&export.texts);
    names.into_iter().any(|name| name.to_lowercase().contains(SYNTHETIC))
}

fn describe_recording(
    sources: &[ImportSource],
    decoded: &[DecodedText],
    options: &ImportOptions,
    camera: CameraEntry,
    recording: &Recording,
    report: &ImportReport,
) -> ImportResult<RecordingFile> {
    let mut encodings: Vec<&str> = decoded.iter().map(|d| d.encoding).collect();
    encodings.dedup();
    let names: Vec<String> = preserved_files(sources).into_iter().map(|(name, _)| name.to_owned()).collect();
    let exposure_s = camera.exposure_s;
    let mut file = RecordingFile::new(camera, recording.is_synthetic());
    file.source = Some(SourceEntry {
        file: OneOrMany::from(names),
        sha256: OneOrMany::Many(vec![]),
        detected_format: report.format.clone(),
        encoding: encodings.join(", "),
        findings: report.findings.clone(),
    });
    file.quality = Some(measure_quality(recording, exposure_s));
    file.conditions = options.conditions.clone();
    file.twin = options.twin.as_ref().map(|(name, text)| toml_file::parse_table(name, text)).transpose()?;
    Ok(file)
}

/// Rotates all positions by the measured tilt of the camera, so that they are as seen by a level camera, and
/// describes the rotation. Without `--level`, or if the tilt is too small or too uncertain, the recording is
/// returned unchanged. Error messages name `file`.
///
/// # Errors
/// [`ImportError::Other`] if the tilt cannot be measured from the path of the tip, or if a point has only
/// one coordinate in a frame.
fn level_recording(
    recording: Recording,
    file: &str,
    (options, optics): (&ImportOptions, &Optics),
    report: &mut ImportReport,
) -> ImportResult<(Recording, Option<LevelEntry>)> {
    if !options.level {
        return Ok((recording, None));
    }
    let refuse = |problem: &dyn std::fmt::Display| {
        let advice = "import without --level, or track the tip and the head with x and y over a whole stroke";
        ImportError::unusable(file, format!("--level: {problem}; {advice}"))
    };
    let measured = measure_quality(&recording, optics.exposure_s);
    let instants = ReversalInstants::find_instants(&recording);
    let tilt = measure_tilt(&recording, &instants, &measured).map_err(|e| refuse(&e))?;
    let entry = LevelEntry {
        applied: tilt.is_clear(),
        angle_rad: tilt.angle_rad,
        sd_rad: tilt.sd_rad,
        centre_x_m: tilt.centre_m[0],
        centre_y_m: tilt.centre_m[1],
        frames: tilt.frames,
        curvature_per_m: tilt.curvature.map(|curvature| curvature.per_m),
    };
    report.notes.push(format!("level: {}", entry.describe()));
    if !entry.applied {
        return Ok((recording, Some(entry)));
    }
    let traces = rotate_traces(recording.traces(), tilt.angle_rad, tilt.centre_m).map_err(|e| refuse(&e))?;
    // (the quantisation step of the export is checked before the rotation, because rotated coordinates no
    // longer show it)
    report.findings.extend(check_position_steps(&measured, optics));
    let level = recording.with_traces(traces).map_err(|problem| ImportError::unusable(file, problem))?;
    Ok((level, Some(entry)))
}
