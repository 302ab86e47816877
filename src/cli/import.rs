//! `wiperlab import`.

use super::args::parse_count;
use super::files::OutputStaging;
use super::inspect::Inspection;
use super::prelude::*;
use crate::import;
use crate::import::source::{CompanionFile, Import, ImportSource};
use crate::import::{ColumnMap, CoordinateScale, ImportOptions, TimeColumn};
use crate::recording::files::{DESCRIPTION_FILE, RecordingFile, TRACE_FILE, YAxis, trace_blocks};
use clap::ValueEnum;
use serde::Serialize;

/// Number of names of formats per line of the help.
const NAMES_A_LINE: usize = 8;

fn after_help() -> String {
    let lines: Vec<String> =
        import::format_names().chunks(NAMES_A_LINE).map(|names| names.join(", ")).collect();
    let names = lines.join(",\n");
    format!("The format is found from the content (docs/formats.md describes each):\n{names}.\n\n{DETAILS}")
}

const DETAILS: &str = "\
Points: tracks called `tip` and `head` need no option. Otherwise name them: NAME, or FILE:NAME when several
files have a track of that name, or FILE when the file has a single track.

Columns (any plain table): KEY=COLUMN pairs; a column is a number from 1 or a name of the header. Keys: frame
(whole numbers; frame=row if every row is a frame), time (in the unit of the header, else s), time-ms,
tip-x, tip-y, head-x, head-y, tip-confidence, head-confidence; or track, x, y, confidence if each row names
its point. Frame or time and one x are required; other columns stay empty. The header, or a row below it,
may name the unit of each column; an option that names another unit is refused.

Coordinates keep the file's origin: they are scaled, and y is mirrored if it points down. The import asks for
every rate, unit or direction of y that neither the file, nor its format, nor a camera's .cih fixes.

Examples:
  wiperlab import run7.txt --out data/run7 --frame-rate-hz 10000 --scale mm --y-axis up \\
      --point tip=lip --point head=holder
  wiperlab import run7.csv --out data/run7 --frame-rate-hz 10000 --scale 21.5um/px --y-axis down \\
      --columns frame=1,tip-x=2,tip-y=3,head-x=4,head-y=5";

#[derive(Debug, Args)]
#[command(after_help = after_help())]
pub(crate) struct ImportArgs {
    #[command(flatten)]
    pub typed: Box<ImportOptionArgs>, // far larger than the arguments of any other command
}

#[derive(Debug, Args)]
pub(crate) struct ImportOptionArgs {
    /// Exported tables; several are merged on one frame grid
    #[arg(value_name = "FILE", required = true)]
    pub sources: Vec<PathBuf>,
    /// Folder of the recording, such as data/NAME
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Format of the file: auto, or the name of a format (see below)
    #[arg(long, default_value = "auto", value_name = "FORMAT")]
    pub format: String,
    /// Rate at which the camera recorded, frames/s (required unless the file or the camera's record states
    /// it)
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub frame_rate_hz: Option<f64>,
    /// Length per pixel such as 21.5um/px, or the unit of the file: m, cm, mm, um (required unless the file
    /// states a unit of length)
    #[arg(long, value_name = "SCALE", allow_hyphen_values = true)]
    pub scale: Option<String>,
    /// Direction of y in the file (required unless the format fixes it)
    #[arg(long, value_enum)]
    pub y_axis: Option<YDirection>,
    /// Track of a point: tip=NAME or head=NAME
    #[arg(long, value_name = "POINT=TRACK")]
    pub point: Vec<String>,
    /// Columns of a plain table, such as time=1,tip-x=2,tip-y=3,head-x=4,head-y=5
    #[arg(long, value_name = "KEY=COLUMN,...")]
    pub columns: Option<String>,
    /// Meaning of the time column: seconds or milliseconds of the recording itself (the frame rate may then
    /// be omitted), numbers of frames, or times of playback (these only count the frames)
    #[arg(long, value_enum)]
    pub time: Option<TimeMeaning>,
    /// Number of frames from row to row, if only every n-th frame was tracked and the table has no frame
    /// column
    #[arg(long, value_name = "N", value_parser = parse_count, allow_negative_numbers = true)]
    pub frame_step: Option<usize>,
    /// Exposure of a frame, s
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    pub exposure_s: Option<f64>,
    /// Treat positions with a lower confidence than this as missing, 0 to 1
    #[arg(long, value_name = "P", allow_negative_numbers = true)]
    pub min_likelihood: Option<f64>,
    /// Treat positions that nobody tracked as missing: exact repeats, straight lines between others,
    /// outliers, doubtful ones
    #[arg(long)]
    pub drop_untracked: bool,
    /// Measure the tilt of the camera from the path of the tip, and rotate both tracks by it
    #[arg(long)]
    pub level: bool,
    /// Text encoding, if the contents do not show it, such as shift_jis
    #[arg(long, value_name = "NAME")]
    pub encoding: Option<String>,
    /// A fact of the test for [conditions], such as glass=wet (repeatable)
    #[arg(long, value_name = "KEY=VALUE")]
    pub condition: Vec<String>,
    /// Specification of the twin from which the export was made; marks the recording as synthetic
    #[arg(long, value_name = "SPEC.toml")]
    pub twin: Option<PathBuf>,
    /// Print one JSON object to standard output: format, notes, and everything that `inspect --json` prints
    #[arg(long)]
    pub json: bool,
    /// Only check and report, with the first rows; write nothing
    #[arg(long)]
    pub dry_run: bool,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum YDirection {
    Up,
    Down,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum TimeMeaning {
    Real,
    Ms,
    Frames,
    Playback,
}

impl ImportOptionArgs {
    pub(crate) fn run(&self, global: &GlobalArgs) -> Outcome {
        let options = self.import_options()?;
        let steps = progress::start_steps("import", global.quiet);
        steps.show_step("reading the export");
        let sources = self.sources.iter().map(|path| read_source(path)).collect::<Outcome<Vec<_>>>()?;
        let imported = import::import(&sources, &options).map_err(Failure::input)?;
        let writer = self.write_policy(&imported);
        OutputFolder::check(&self.out, &writer, &[TRACE_FILE, DESCRIPTION_FILE])?;
        if !self.dry_run {
            steps.show_step("writing the recording");
            write_recording(&self.out, &writer, &sources, &imported)?;
        }
        drop(steps);
        // (the exports are as large as the traces, and the report needs memory too)
        let names: Vec<String> = output_names(&sources).map(str::to_owned).collect();
        drop(sources);
        if self.json {
            let text = serde_json::to_string_pretty(&self.json_summary(&imported, names));
            output::print_lines(&text.map_err(Failure::internal)?);
        } else if global.quiet {
            imported.report.warnings().for_each(|warning| warn_line!("warning: {warning}"));
        } else {
            self.print_report(&imported, &names);
        }
        Ok(CommandOutcome::Done)
    }

    /// Converts the arguments to the options of the library.
    fn import_options(&self) -> Outcome<ImportOptions> {
        let named = self.out.file_name().map(|name| name.to_string_lossy().into_owned());
        let mut options = ImportOptions {
            name: named.unwrap_or_else(|| self.out.display().to_string()),
            format: Some(self.format.clone()),
            encoding: self.encoding.clone(),
            frame_rate_hz: self.frame_rate_hz,
            scale: self.scale.as_deref().map(CoordinateScale::parse).transpose().map_err(Failure::input)?,
            y_axis: self.y_axis.map(|to| if to == YDirection::Up { YAxis::Up } else { YAxis::Down }),
            exposure_s: self.exposure_s,
            time: self.time.map(|meaning| match meaning {
                TimeMeaning::Real => TimeColumn::Real,
                TimeMeaning::Ms => TimeColumn::Milliseconds,
                TimeMeaning::Frames => TimeColumn::Frames,
                TimeMeaning::Playback => TimeColumn::Playback,
            }),
            frame_step: self.frame_step,
            columns: self.columns.as_deref().map(ColumnMap::parse).transpose().map_err(Failure::input)?,
            min_likelihood: self.min_likelihood,
            drop_untracked: self.drop_untracked,
            level: self.level,
            ..ImportOptions::default()
        };
        for point in &self.point {
            options.add_point(point).map_err(Failure::input)?;
        }
        for condition in &self.condition {
            options.add_condition(condition).map_err(Failure::input)?;
        }
        if let Some(path) = &self.twin {
            options.twin = Some((path.display().to_string(), files::read_toml(path)?));
        }
        Ok(options)
    }

    /// Files that the import may overwrite; a measured recording only if it was imported from the same
    /// exported files.
    fn write_policy(&self, imported: &Import) -> WritePolicy {
        let exports =
            imported.file.source.iter().flat_map(|source| source.sha256.as_slice().iter().cloned()).collect();
        WritePolicy { exports, ..WritePolicy::new(OutputCommand::Import, self.overwrite) }
    }

    fn json_summary(&self, imported: &Import, files: Vec<String>) -> ImportSummary {
        ImportSummary {
            out: self.out.display().to_string(),
            written: !self.dry_run,
            files,
            format: imported.report.format.clone(),
            reason: imported.report.reason.clone(),
            notes: imported.report.notes.clone(),
            inspection: Inspection::from_import(&imported.recording, &imported.file),
        }
    }

    fn print_report(&self, imported: &Import, files: &[String]) {
        let grid = imported.recording.grid();
        let verb = if self.dry_run { "would write" } else { "wrote" };
        let kind = if imported.recording.is_synthetic() { "synthetic recording" } else { "recording" };
        let (out, rate, duration_s) = (self.out.display(), grid.frame_rate_hz, grid.duration_s());
        print_line!("{verb} {out}: {kind}, {} frames at {rate} frames/s, {duration_s:.6} s", grid.frames);
        print_line!("format: {} ({})", imported.report.format, imported.report.reason);
        imported.report.notes.iter().for_each(|note| print_line!("note: {note}"));
        if self.dry_run {
            print_preview(imported, files);
        }
        let inspection = Inspection::from_import(&imported.recording, &imported.file);
        inspection.verdict_lines().iter().for_each(|line| print_line!("verdict: {line}"));
    }
}

/// Output of an import with `--json`.
#[derive(Debug, Serialize)]
struct ImportSummary {
    out: String,
    /// Whether the files were written; false for a dry run.
    written: bool,
    /// Files in the folder.
    files: Vec<String>,
    format: String,
    reason: String,
    notes: Vec<String>,
    #[serde(flatten)]
    inspection: Inspection,
}

/// Names of the files that an import writes.
fn output_names(sources: &[ImportSource]) -> impl Iterator<Item = &str> {
    import::source::preserved_files(sources)
        .into_iter()
        .map(|(name, _)| name)
        .chain([TRACE_FILE, DESCRIPTION_FILE])
}

/// Number of rows of the trace that a dry run shows.
const PREVIEWED_ROWS: usize = 3;

/// Prints the names of the files and the first rows of the traces.
fn print_preview(imported: &Import, files: &[String]) {
    print_line!("files: {}", files.join(", "));
    let start: String = trace_blocks(&imported.recording).take(2).collect();
    for line in start.lines().take(PREVIEWED_ROWS + 1) {
        print_line!("{TRACE_FILE}: {line}");
    }
}

/// Maximum length of a line of an exported table, in bytes: enough for a hundred thousand columns.
const LONGEST_LINE: usize = 1_000_000;
/// Number of bytes at the start of a refused line that the error message shows.
const LINE_SHOWN: usize = 40;

/// Reads an exported table. A file without line ends is refused, since its cells would fill the memory; only
/// a file with markup may be a single line.
fn read_table(path: &Path) -> Outcome<Vec<u8>> {
    let bytes = files::read_data(path)?;
    let is_markup = bytes.iter().take(16).any(|byte| *byte == b'<');
    match find_long_line(&bytes).filter(|_| !is_markup) {
        Some(line) => Err(Failure::at(
            path.display(),
            format!(
                "found a line of {} bytes, which begins with `{}`, expected at most {LONGEST_LINE} and a row a frame; export the table again, with line ends",
                line.len(),
                String::from_utf8_lossy(&line[..LINE_SHOWN])
            ),
        )),
        None => Ok(bytes),
    }
}

/// The first line that is longer than [`LONGEST_LINE`]; `None` if no line is.
fn find_long_line(bytes: &[u8]) -> Option<&[u8]> {
    let is_end = |byte: &u8| matches!(byte, b'\n' | b'\r');
    let mut rest = bytes;
    while let Some(start) = rest.get(..=LONGEST_LINE) {
        match start.iter().rposition(is_end) {
            Some(end) => rest = &rest[end + 1..],
            None => return rest.split(is_end).next(),
        }
    }
    None
}

/// Reads an exported file with the companion files that belong to it.
fn read_source(path: &Path) -> Outcome<ImportSource> {
    if files::is_standard_input(path) {
        return Ok(ImportSource::without_companions(files::display_name(path), read_table(path)?));
    }
    let name = path.display().to_string();
    let mut names = import::companion_names(&name);
    names.retain(|companion| *companion != name && Path::new(companion).is_file());
    // a file system that ignores case finds one file under two spellings
    names.dedup_by(|a, b| a.eq_ignore_ascii_case(b));
    let read = |name: String| Ok(CompanionFile { bytes: files::read_data(Path::new(&name))?, name });
    let companions = names.into_iter().map(read).collect::<Outcome<Vec<_>>>()?;
    Ok(ImportSource { bytes: read_table(path)?, name, companions })
}

/// Imports the given sources into a folder.
pub(crate) fn import_into(
    folder: &Path,
    sources: &[ImportSource],
    options: &ImportOptions,
    overwrite: Overwrite,
) -> Outcome<()> {
    let imported = import::import(sources, options).map_err(Failure::input)?;
    write_recording(folder, &WritePolicy::new(OutputCommand::Import, overwrite), sources, &imported)
}

/// Copies what the user wrote into the existing description (facts of the test, folder of the video frames)
/// to the description that replaces it, unless the command line gives it.
fn keep_user_notes(folder: &Path, description: &mut RecordingFile) {
    let Ok(text) = files::read_text(&folder.join(DESCRIPTION_FILE)) else { return };
    let Ok(replaced) = RecordingFile::parse(DESCRIPTION_FILE, &text) else { return };
    description.video = replaced.video;
    for (key, value) in replaced.conditions {
        description.conditions.entry(key).or_insert(value);
    }
}

/// Writes the unchanged exports, the traces and the description.
fn write_recording(
    folder: &Path,
    writer: &WritePolicy,
    sources: &[ImportSource],
    imported: &Import,
) -> Outcome<()> {
    let names: Vec<&str> = output_names(sources).collect();
    let mut staging = OutputStaging::new(folder, writer, &names)?;
    let hashes = imported.file.source.iter().flat_map(|source| source.sha256.as_slice());
    for ((name, bytes), sha256) in import::source::preserved_files(sources).into_iter().zip(hashes) {
        staging.stage_hashed_file(name, bytes, sha256)?;
    }
    let trace = staging.stage_file(TRACE_FILE, files::ChunkReader::new(trace_blocks(&imported.recording)))?;
    let mut description = RecordingFile { trace_sha256: Some(trace), ..imported.file.clone() };
    keep_user_notes(folder, &mut description);
    staging.stage_file(DESCRIPTION_FILE, description.to_toml().map_err(Failure::internal)?.as_bytes())?;
    staging.commit()
}
