//! Tracks to a recording: points, frames, scale, direction, and what deserves a warning.

use super::checks::{self, finding};
use super::encoding::Decoded;
use super::export::{Column, Export};
use super::known::{Known, known};
use super::options::{Options, Scale, TimeColumn};
use super::points::{self, Choice};
use super::timing::{self, Declared, Placed, Rows};
use super::{Import, ImportError, ImportReport, Source, base_name, beside};
use crate::recording::clock::MAX_FRAMES;
use crate::recording::files::{Camera, OneOrMany, RecordingFile, Source as SourceTable, YAxis};
use crate::recording::quality::{Finding, Severity, quality};
use crate::recording::{FrameGrid, Recording, Traces};
use crate::toml_file;
use sha2::{Digest, Sha256};

/// Word in a track's name or a header that marks data no camera took.
const SYNTHETIC: &str = "synthetic";

pub(super) fn assemble(
    sources: &[Source],
    decoded: &[Decoded],
    mut exports: Vec<Export>,
    options: &Options,
    mut report: ImportReport,
) -> Result<Import, ImportError> {
    beside::read_rates(sources, &mut exports, options.frame_rate_hz.is_some())?;
    points::number_twins(&mut exports);
    let known = known(&mut exports, options, &mut report)?;
    let chosen = points::choose(&exports, options)?;
    for export in &mut exports {
        report.notes.extend(export.notes.iter().map(|note| format!("{}: {note}", export.file)));
        report.findings.append(&mut export.findings);
    }
    let clocks = Clocks::place(&exports, &chosen, &known, options)?;
    clocks.findings(&exports, &known, options, &mut report);
    let synthetic = options.twin.is_some() || exports.iter().any(is_synthetic);
    let mut points = [0, 1].map(|index| Point::spread(&mut exports, &clocks, chosen[index]));
    refuse_no_position(&exports, &chosen, &points)?;
    note_points(&exports, &chosen, &points, &mut report);
    for (point, choice) in points.iter_mut().zip(chosen) {
        let Some((file, track)) = choice else { continue };
        let name = &exports[file].tracks[track].name;
        report.findings.extend(checks::positions(name, &point.x, &point.y, known.scale));
        point.reject(name, options.min_likelihood, &mut report)?;
        point.convert(&known);
    }
    drop(exports);
    let file_name = || sources.first().map_or_else(String::new, |source| source.name.clone());
    let recording = Recording::new(options.name.clone(), clocks.grid, traces(points), synthetic)
        .map_err(|problem| ImportError::Recording { file: file_name(), problem })?;
    let file = describe(sources, decoded, options, &known, &recording, &report)?;
    Ok(Import { recording, file, report })
}

/// The clocks of the chosen tracks on one frame grid.
struct Clocks {
    grid: FrameGrid,
    /// Export, clock, frames of its rows, and what to add to them to count from the start of the grid.
    used: Vec<(usize, usize, Placed, i64)>,
}

impl Clocks {
    fn place(exports: &[Export], chosen: &[Option<Choice>; 2], known: &Known, options: &Options) -> Result<Self, ImportError> {
        let playback = options.time == Some(TimeColumn::Playback);
        let declared = Declared { rate_hz: known.rate_hz, playback, step: options.frame_step.unwrap_or(1) };
        let mut used: Vec<(usize, usize, Placed, i64)> = vec![];
        for &(file, track) in chosen.iter().flatten() {
            let clock = exports[file].tracks[track].clock;
            if used.iter().any(|known| (known.0, known.1) == (file, clock)) {
                continue;
            }
            let placed = timing::place(Rows { export: &exports[file], clock: &exports[file].clocks[clock] }, declared)?;
            let shift = match used.first() {
                Some(first) => timing::offset((&exports[first.0], &first.2), (&exports[file], &placed), known.rate_hz)?,
                None => 0,
            };
            used.push((file, clock, placed, shift));
        }
        let begin = |(_, _, placed, shift): &(usize, usize, Placed, i64)| placed.frames.first().map_or(0, |frame| frame + shift);
        let end = |(_, _, placed, shift): &(usize, usize, Placed, i64)| placed.frames.last().map_or(0, |frame| frame + shift);
        let Some(earliest) = used.iter().min_by_key(|clock| begin(clock)) else { return Err(ImportError::NoSource) };
        let (from, to) = (begin(earliest), used.iter().map(end).max().unwrap_or(0));
        let frames = to - from + 1;
        if frames as f64 > MAX_FRAMES {
            return Err(ImportError::Grids {
                file: exports[earliest.0].file.to_owned(),
                found: format!("frames from {from} to {to}"),
                expected: format!("at most {MAX_FRAMES} frames"),
                other: "any one recording".to_owned(),
            });
        }
        let grid = FrameGrid { start_s: earliest.2.start_s, frame_rate_hz: known.rate_hz, frames: frames as usize };
        used.iter_mut().for_each(|clock| clock.3 -= from);
        Ok(Self { grid, used })
    }

    fn of(&self, file: usize, clock: usize) -> Option<(&[i64], i64)> {
        self.used.iter().find(|used| (used.0, used.1) == (file, clock)).map(|used| (used.2.frames.as_slice(), used.3))
    }

    fn findings(&self, exports: &[Export], known: &Known, options: &Options, report: &mut ImportReport) {
        for (file, clock, placed, _) in &self.used {
            let export = &exports[*file];
            let implied = placed.implied_hz.map(|hz| checks::implied_rate(export.file, hz, options.time == Some(TimeColumn::Playback)));
            let times: Vec<f64> = export.clocks[*clock].time.iter().flat_map(Column::iter).flatten().collect();
            let rounded = (options.time != Some(TimeColumn::Playback)).then(|| checks::rounded_times(export.file, &times, known.rate_hz)).flatten();
            let new: Vec<Finding> = implied.into_iter().chain(rounded).filter(|finding| !report.findings.contains(finding)).collect();
            report.findings.extend(new); // (clocks of one file often say the same)
        }
    }
}

/// A point on the frame grid.
#[derive(Default)]
struct Point {
    x: Vec<Option<f64>>,
    y: Vec<Option<f64>>,
    confidence: Option<Vec<Option<f64>>>,
}

impl Point {
    /// Absent rows stay missing. The track's columns are used up.
    fn spread(exports: &mut [Export], clocks: &Clocks, choice: Option<Choice>) -> Self {
        let empty = || vec![None; clocks.grid.frames];
        let none = || Self { x: empty(), y: empty(), confidence: None };
        let Some((file, track)) = choice else { return none() };
        let track = &mut exports[file].tracks[track];
        let Some((frames, shift)) = clocks.of(file, track.clock) else { return none() };
        let column = |values: Column| {
            let mut on_grid = empty();
            for (value, frame) in values.iter().zip(frames) {
                if let Some(cell) = usize::try_from(frame + shift).ok().and_then(|frame| on_grid.get_mut(frame)) {
                    *cell = value;
                }
            }
            on_grid
        };
        let x = column(std::mem::take(&mut track.x));
        Self { x, y: track.y.take().map_or_else(empty, column), confidence: track.confidence.take().map(column) }
    }

    /// Positions in which the tracker had too little confidence become missing.
    fn reject(&mut self, name: &str, limit: Option<f64>, report: &mut ImportReport) -> Result<(), ImportError> {
        let (Some(limit), Some(confidence)) = (limit, &self.confidence) else {
            let doubtful = self.confidence.as_ref().and_then(|confidence| checks::doubtful(name, &self.x, confidence));
            report.findings.extend(doubtful);
            return match limit {
                None => Ok(()),
                Some(limit) => {
                    let expected = format!(
                        "a confidence for {name}, which this export has not: leave the option out, or name its column (--columns ...,tip-confidence=N)"
                    );
                    Err(ImportError::Option { option: "--min-likelihood", found: limit.to_string(), expected })
                }
            };
        };
        let tracked = self.x.iter().flatten().count();
        let mut count = 0;
        for (frame, _) in confidence.iter().enumerate().filter(|(_, c)| c.is_some_and(|c| c < limit)) {
            count += usize::from(self.x[frame].is_some());
            (self.x[frame], self.y[frame]) = (None, None);
        }
        report.findings.push(checks::rejected(name, count, tracked, limit));
        Ok(())
    }

    fn convert(&mut self, known: &Known) {
        let metres = known.scale.metres();
        // a quotient by a whole number is the nearest double to the decimal that was written; a product with 1e-3 is not
        let parts = (1.0 / metres).round();
        let length = |value: f64| if matches!(known.scale, Scale::Unit(_)) && metres < 1.0 && metres == 1.0 / parts { value / parts } else { value * metres };
        for x in self.x.iter_mut().flatten() {
            *x = length(*x);
        }
        for y in self.y.iter_mut().flatten() {
            *y = if known.y_axis == YAxis::Down { 0.0 - length(*y) } else { length(*y) };
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
    let file = used.first().map_or_else(String::new, |(file, _)| exports[*file].file.to_owned());
    Err(ImportError::NoPosition { file, points: names.join(" or ") })
}

fn note_points(exports: &[Export], chosen: &[Option<Choice>; 2], points: &[Point; 2], report: &mut ImportReport) {
    let lacks = |found: String, advice: &str| finding("points", Severity::Caution, (0.0, ""), found, advice);
    for ((point, choice), on_grid) in ["tip", "head"].into_iter().zip(chosen).zip(points) {
        match choice {
            Some((file, track)) => {
                report.notes.push(format!("{point}: track `{}` of {}", exports[*file].tracks[*track].name, exports[*file].file));
                if on_grid.tracked().is_none() {
                    report
                        .findings
                        .push(lacks(format!("{point}: its track has no position in any row; its columns stay empty and there is no deflection"), ""));
                } else if on_grid.y.iter().all(Option::is_none) {
                    report.notes.push(format!("{point}: the export has no y; that column stays empty"));
                }
            }
            None => {
                let advice = points::unchosen(exports, chosen, point).unwrap_or_default();
                report.findings.push(lacks(format!("no track for the {point}: its columns stay empty and there is no deflection"), &advice));
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
    report: &ImportReport,
) -> Result<RecordingFile, ImportError> {
    let metres_per_pixel = if let Scale::MetresPerPixel(metres) = known.scale { Some(metres) } else { None };
    let camera = Camera { frame_rate_hz: known.rate_hz, exposure_s: options.exposure_s, metres_per_pixel, y_axis: Some(known.y_axis) };
    let mut encodings: Vec<&str> = decoded.iter().map(|d| d.encoding).collect();
    encodings.dedup();
    let names: Vec<String> = kept_files(sources).into_iter().map(|(name, _)| name.to_owned()).collect();
    let mut file = RecordingFile::new(camera, recording.is_synthetic());
    file.source = Some(SourceTable {
        file: OneOrMany::from(names),
        sha256: OneOrMany::Many(vec![]),
        detected_format: report.format.clone(),
        encoding: encodings.join(", "),
        findings: report.findings.clone(),
    });
    file.quality = Some(quality(recording, options.exposure_s));
    file.conditions = options.conditions.clone();
    file.twin = options.twin.as_ref().map(|(name, text)| toml_file::parse(name, text)).transpose()?;
    Ok(file)
}

/// Names and bytes of the files that are kept with the recording, in the order of `[source]`; a file beside several is kept once.
#[must_use]
pub fn kept_files(sources: &[Source]) -> Vec<(&str, &[u8])> {
    let mut kept: Vec<(&str, &[u8])> = sources.iter().map(|source| (base_name(&source.name), source.bytes.as_slice())).collect();
    for file in sources.iter().flat_map(|source| &source.beside) {
        let name = base_name(&file.name);
        if !kept.iter().any(|(known, _)| known.eq_ignore_ascii_case(name)) {
            kept.push((name, &file.bytes));
        }
    }
    kept
}

/// SHA-256 of every kept file, in their order.
pub(super) fn hashes(sources: &[Source]) -> Vec<String> {
    kept_files(sources).into_iter().map(|(_, bytes)| sha256(bytes)).collect()
}

/// SHA-256 of `bytes`, hexadecimal, as `recording.toml` keeps it.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}
