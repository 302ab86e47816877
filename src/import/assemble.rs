//! Tracks to a recording: points, frames, scale, direction, and what deserves a warning.

use super::encoding::Decoded;
use super::options::{Options, Scale};
use super::points::{self, Choice};
use super::timing::{self, Declared, Placed};
use super::{Export, Import, ImportError, ImportReport, Source, base_name};
use crate::recording::clock::MAX_FRAMES;
use crate::recording::files::{Camera, OneOrMany, RecordingFile, Source as SourceTable, YAxis};
use crate::recording::quality::{is_playback_rate, quality};
use crate::recording::{FrameGrid, Recording, Traces};
use crate::toml_file;
use sha2::{Digest, Sha256};

/// Exact (0, 0) positions in a row that look like a lost point: one may be a point on the origin.
const ZERO_RUN: usize = 3;
/// Largest extent of a wiper's sweep seen by one camera, m: beyond it a declared length unit is doubtful.
const LARGEST_EXTENT_M: f64 = 2.0;
/// Fewest values from which "all are whole numbers" means pixels.
const FEWEST_WHOLE: usize = 8;
/// Word in a track's name or a header that marks data no camera took.
const SYNTHETIC: &str = "synthetic";

/// What an import cannot do without.
struct Known {
    rate_hz: f64,
    scale: Scale,
    y_axis: YAxis,
}

pub(super) fn assemble(
    sources: &[Source],
    decoded: &[Decoded],
    exports: &[Export],
    options: &Options,
    mut report: ImportReport,
) -> Result<Import, ImportError> {
    let known = known(exports, options)?;
    let chosen = points::choose(exports, options)?;
    for export in exports {
        report.notes.extend(export.notes.iter().map(|note| format!("{}: {note}", export.file)));
    }
    let declared = Declared { rate_hz: known.rate_hz, time: options.time, step: options.frame_step.unwrap_or(1) };
    let placed = exports.iter().map(|export| timing::place(export, declared)).collect::<Result<Vec<_>, _>>()?;
    let (grid, shifts) = grid(exports, &placed, &chosen, known.rate_hz)?;
    let mut points = chosen.map(|choice| Point::spread(exports, &placed, &shifts, grid.frames, choice));
    refuse_no_position(exports, &chosen, &points)?;
    note_points(exports, &chosen, &points, &mut report);
    warn_rates(exports, &placed, &known, options, &mut report);
    for (point, choice) in points.iter_mut().zip(chosen) {
        let Some((file, track)) = choice else { continue };
        let name = &exports[file].tracks[track].name;
        point.warn(name, known.scale, &mut report);
        point.reject(name, options.min_likelihood, &mut report)?;
        point.convert(&known);
    }
    let synthetic = options.twin.is_some() || exports.iter().any(is_synthetic);
    let traces = traces(points);
    let recording =
        Recording::new(options.name.clone(), grid, traces, synthetic).map_err(|problem| ImportError::Recording { file: exports[0].file.clone(), problem })?;
    let file = describe(sources, decoded, options, &known, &recording, &report.format)?;
    Ok(Import { recording, file, report })
}

/// Refuses all that is missing at once, with what the files suggest.
fn known(exports: &[Export], options: &Options) -> Result<Known, ImportError> {
    if let (Some(rate_hz), Some(scale), Some(y_axis)) = (options.frame_rate_hz, options.scale, options.y_axis) {
        return Ok(Known { rate_hz, scale, y_axis });
    }
    let mut missing = vec![];
    if options.frame_rate_hz.is_none() {
        let implied = exports
            .iter()
            .find_map(implied_hz)
            .map_or("the file does not time its frames".to_owned(), |hz| format!("the file's times imply {hz:.6}, which may be the playback rate"));
        missing.push(format!("--frame-rate-hz N   the rate at which the camera recorded, from its own record; {implied}"));
    }
    if options.scale.is_none() {
        missing.push("--scale S           21.5um/px if the coordinates are pixels, or their length unit: m, cm, mm, um. Tracker does not write its unit: it is the one used in its calibration".to_owned());
    }
    if options.y_axis.is_none() {
        missing.push("--y-axis up|down    Tracker's x and y point up unless its axes were turned; image pixels point down".to_owned());
    }
    Err(ImportError::Unset { missing })
}

/// Rate that the times of an export suggest before anything is declared.
fn implied_hz(export: &Export) -> Option<f64> {
    let times: Vec<f64> = export.stamps.iter().filter_map(|stamp| stamp.time_s).collect();
    let step_s = crate::recording::clock::median_step_s(&times)?;
    (step_s > 0.0).then(|| crate::recording::clock::number_frames(&times, step_s).map(|fit| 1.0 / fit.frame_s))?
}

/// The common frame grid of the files that are used, and what to add to each file's frames to count from its start.
fn grid(exports: &[Export], placed: &[Placed], chosen: &[Option<Choice>; 2], rate_hz: f64) -> Result<(FrameGrid, Vec<i64>), ImportError> {
    let used: Vec<usize> = chosen.iter().flatten().map(|choice| choice.0).collect();
    let first = used.first().copied().unwrap_or(0);
    let offset = |file: usize| timing::offset((&exports[first], &placed[first]), (&exports[file], &placed[file]), rate_hz);
    let mut shifts = vec![0; exports.len()];
    for &file in &used {
        shifts[file] = offset(file)?;
    }
    let begin = |file: usize| placed[file].frames[0] + shifts[file];
    let end = |file: usize| placed[file].frames[placed[file].frames.len() - 1] + shifts[file];
    let earliest = used.iter().copied().min_by_key(|&file| begin(file)).unwrap_or(first);
    let (from, to) = (begin(earliest), used.iter().map(|&file| end(file)).max().unwrap_or_else(|| end(first)));
    let frames = to - from + 1;
    if frames as f64 > MAX_FRAMES {
        return Err(ImportError::Grids {
            file: exports[first].file.clone(),
            found: format!("frames from {from} to {to}"),
            expected: format!("at most {MAX_FRAMES} frames"),
            other: "any one recording".to_owned(),
        });
    }
    let shifts = shifts.into_iter().map(|shift| shift - from).collect();
    Ok((FrameGrid { start_s: placed[earliest].start_s, frame_rate_hz: rate_hz, frames: frames as usize }, shifts))
}

/// A point on the frame grid.
#[derive(Default)]
struct Point {
    x: Vec<Option<f64>>,
    y: Vec<Option<f64>>,
    confidence: Option<Vec<Option<f64>>>,
}

impl Point {
    /// Absent rows stay missing.
    fn spread(exports: &[Export], placed: &[Placed], shifts: &[i64], frames: usize, choice: Option<Choice>) -> Self {
        let empty = || vec![None; frames];
        let Some((file, track)) = choice else { return Self { x: empty(), y: empty(), confidence: None } };
        let track = &exports[file].tracks[track];
        let column = |values: &[Option<f64>]| {
            let mut on_grid = empty();
            for (value, frame) in values.iter().zip(&placed[file].frames) {
                if let Some(cell) = usize::try_from(frame + shifts[file]).ok().and_then(|frame| on_grid.get_mut(frame)) {
                    *cell = *value;
                }
            }
            on_grid
        };
        Self { x: column(&track.x), y: column(&track.y), confidence: track.confidence.as_deref().map(column) }
    }

    /// First frame and length of the longest run of exact (0, 0).
    fn zero_run(&self) -> (usize, usize) {
        let (mut longest, mut run) = ((0, 0), 0);
        for (frame, (x, y)) in self.x.iter().zip(&self.y).enumerate() {
            run = if *x == Some(0.0) && *y == Some(0.0) { run + 1 } else { 0 };
            if run > longest.1 {
                longest = (frame + 1 - run, run);
            }
        }
        longest
    }

    fn warn(&self, name: &str, scale: Scale, report: &mut ImportReport) {
        let (frame, run) = self.zero_run();
        if run >= ZERO_RUN {
            report
                .warnings
                .push(format!("{name}: {run} frames in a row from frame {frame} at exactly (0, 0), which often means a lost point; if so, empty these cells"));
        }
        let metres = scale.metres();
        let in_pixels = matches!(scale, Scale::MetresPerPixel(_));
        let values: Vec<f64> = self.x.iter().chain(&self.y).flatten().copied().collect();
        let largest = values.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        let whole = !in_pixels && values.len() >= FEWEST_WHOLE && values.iter().all(|v| v.fract() == 0.0) && largest > 0.0;
        if largest * metres > LARGEST_EXTENT_M || whole {
            let sign = if whole { "are all whole numbers" } else { "reach beyond 2 m" };
            let advice = if in_pixels { "check --scale" } else { "they look like pixels; if so, give --scale as a length a pixel" };
            report.warnings.push(format!("{name}: the coordinates {sign} (largest {largest:.6e}): {advice}"));
        }
    }

    /// Positions in which the tracker had too little confidence become missing.
    fn reject(&mut self, name: &str, limit: Option<f64>, report: &mut ImportReport) -> Result<(), ImportError> {
        let Some(limit) = limit else { return Ok(()) };
        let Some(confidence) = &self.confidence else {
            let expected = format!("a confidence for {name}: --columns ...,tip-confidence=N,head-confidence=N");
            return Err(ImportError::Option { option: "--min-likelihood", found: limit.to_string(), expected });
        };
        let mut rejected = 0;
        for (frame, _) in confidence.iter().enumerate().filter(|(_, c)| c.is_some_and(|c| c < limit)) {
            rejected += usize::from(self.x[frame].is_some());
            (self.x[frame], self.y[frame]) = (None, None);
        }
        report.notes.push(format!("{name}: {rejected} of {} positions below the confidence {limit} count as missing", confidence.len()));
        Ok(())
    }

    fn convert(&mut self, known: &Known) {
        let metres = known.scale.metres();
        for x in self.x.iter_mut().flatten() {
            *x *= metres;
        }
        for y in self.y.iter_mut().flatten() {
            *y = if known.y_axis == YAxis::Down { 0.0 - *y * metres } else { *y * metres };
        }
    }

    fn tracked(&self) -> Option<(usize, usize)> {
        Some((self.x.iter().position(Option::is_some)?, self.x.iter().rposition(Option::is_some)?))
    }
}

/// A table without a single position is the wrong table.
fn refuse_no_position(exports: &[Export], chosen: &[Option<Choice>; 2], points: &[Point; 2]) -> Result<(), ImportError> {
    if points.iter().any(|point| point.tracked().is_some()) {
        return Ok(());
    }
    let used: Vec<Choice> = chosen.iter().flatten().copied().collect();
    let names: Vec<String> = used.iter().map(|(file, track)| format!("`{}`", exports[*file].tracks[*track].name)).collect();
    let file = used.first().map_or_else(String::new, |(file, _)| exports[*file].file.clone());
    Err(ImportError::NoPosition { file, points: names.join(" or ") })
}

fn note_points(exports: &[Export], chosen: &[Option<Choice>; 2], points: &[Point; 2], report: &mut ImportReport) {
    for ((point, choice), on_grid) in ["tip", "head"].into_iter().zip(chosen).zip(points) {
        match choice {
            Some((file, track)) => {
                report.notes.push(format!("{point}: track `{}` of {}", exports[*file].tracks[*track].name, exports[*file].file));
                if on_grid.tracked().is_none() {
                    report.warnings.push(format!("{point}: its track has no position in any row; its columns stay empty and there is no deflection"));
                } else if on_grid.y.iter().all(Option::is_none) {
                    report.notes.push(format!("{point}: the export has no y; that column stays empty"));
                }
            }
            None => {
                let advice = points::unchosen(exports, chosen, point).map_or_else(String::new, |advice| format!("; {advice}"));
                report.warnings.push(format!("no track for the {point}: its columns stay empty and there is no deflection{advice}"));
            }
        }
    }
    if let [Some(tip), Some(head)] = [points[0].tracked(), points[1].tracked()]
        && tip != head
    {
        report
            .notes
            .push(format!("the tip is tracked in frames {} to {}, the head in {} to {}: only what they share has a deflection", tip.0, tip.1, head.0, head.1));
    }
}

fn warn_rates(exports: &[Export], placed: &[Placed], known: &Known, options: &Options, report: &mut ImportReport) {
    for (export, placed) in exports.iter().zip(placed) {
        let Some(implied) = placed.implied_hz else { continue };
        let meaning = match options.time {
            super::TimeColumn::Real => "as declared",
            super::TimeColumn::Playback => "taken as playback: the times only count frames",
        };
        report.notes.push(format!("{}: the times imply {implied:.6} rows/s ({meaning})", export.file));
    }
    if is_playback_rate(known.rate_hz) {
        report.warnings.push(format!(
            "{} frames/s is a rate of playback: if the camera recorded faster, every frequency is too low by the ratio; check the camera's own record",
            known.rate_hz
        ));
    }
}

fn is_synthetic(export: &Export) -> bool {
    let names = export.tracks.iter().map(|track| &track.name).chain(&export.texts);
    names.into_iter().any(|name| name.to_lowercase().contains(SYNTHETIC))
}

fn traces([tip, head]: [Point; 2]) -> Traces {
    Traces { tip_x_m: tip.x, tip_y_m: tip.y, head_x_m: head.x, head_y_m: head.y, tip_confidence: tip.confidence, head_confidence: head.confidence }
}

fn describe(
    sources: &[Source],
    decoded: &[Decoded],
    options: &Options,
    known: &Known,
    recording: &Recording,
    format: &str,
) -> Result<RecordingFile, ImportError> {
    let metres_per_pixel = if let Scale::MetresPerPixel(metres) = known.scale { Some(metres) } else { None };
    let camera = Camera { frame_rate_hz: known.rate_hz, exposure_s: options.exposure_s, metres_per_pixel, y_axis: Some(known.y_axis) };
    let mut encodings: Vec<&str> = decoded.iter().map(|d| d.encoding).collect();
    encodings.dedup();
    let mut file = RecordingFile::new(camera, recording.is_synthetic());
    file.source = Some(SourceTable {
        file: OneOrMany::from(sources.iter().map(|source| base_name(&source.name).to_owned()).collect::<Vec<_>>()),
        sha256: OneOrMany::from(sources.iter().map(|source| sha256(&source.bytes)).collect::<Vec<_>>()),
        detected_format: format.to_owned(),
        encoding: encodings.join(", "),
        findings: vec![],
    });
    file.quality = Some(quality(recording, options.exposure_s));
    file.conditions = options.conditions.clone();
    file.twin = options.twin.as_ref().map(|(name, text)| toml_file::parse(name, text)).transpose()?;
    Ok(file)
}

/// SHA-256 of `bytes`, hexadecimal, as `recording.toml` keeps it.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}
