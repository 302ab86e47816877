//! `wiperlab import`.

use crate::args::Global;
use crate::failure::{Failure, Outcome};
use crate::files;
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};
use wiperlab::import::{self, Columns, Import, Options, Scale, Source, TimeColumn};
use wiperlab::recording::channel::Instants;
use wiperlab::recording::files::{DESCRIPTION_FILE, TRACE_FILE, YAxis, trace_csv};
use wiperlab::recording::quality::{self, Optics};

const AFTER_HELP: &str = "\
Points: tracks called `tip` and `head` are found by themselves. Otherwise name them: NAME, FILE:NAME when several files
have a track of that name, or FILE when the file holds a single track.

Columns (any plain table): KEY=COLUMN pairs; a column is a number from 1 or a name of the header. Keys: frame (whole
numbers), time (s), time-ms, tip-x, tip-y, head-x, head-y, tip-confidence, head-confidence. Needed are frame or time and
one x; columns left out stay empty.

Coordinates keep the file's origin: they are scaled, and y is mirrored when it points down.

Examples:
  wiperlab import run7.txt --out data/run7 --frame-rate-hz 10000 --scale mm --y-axis up --point tip=lip --point head=holder
  wiperlab import run7.csv --out data/run7 --frame-rate-hz 10000 --scale 21.5um/px --y-axis down \\
      --columns frame=1,tip-x=2,tip-y=3,head-x=4,head-y=5";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct ImportArgs {
    #[command(flatten)]
    typed: Box<Typed>, // far larger than the arguments of any other command
}

impl ImportArgs {
    pub fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        self.typed.run(global)
    }
}

#[derive(Debug, Args)]
pub struct Typed {
    /// Exported tables; several are merged on one frame grid
    #[arg(value_name = "FILE", required = true)]
    pub sources: Vec<PathBuf>,
    /// Folder of the recording, e.g. data/NAME
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// auto, tracker, generic (others are recognised and refused with advice)
    #[arg(long, default_value = "auto", value_name = "FORMAT")]
    pub format: String,
    /// Rate at which the camera recorded, frames/s (required: no file says it)
    #[arg(long, value_name = "N")]
    pub frame_rate_hz: Option<f64>,
    /// Length a pixel such as 21.5um/px, or the unit of the file: m, cm, mm, um (required)
    #[arg(long, value_name = "SCALE")]
    pub scale: Option<String>,
    /// Direction of y in the file (required)
    #[arg(long, value_enum)]
    pub y_axis: Option<Direction>,
    /// Track of a point: tip=NAME or head=NAME
    #[arg(long, value_name = "POINT=TRACK")]
    pub point: Vec<String>,
    /// Columns of a plain table, e.g. time=1,tip-x=2,tip-y=3,head-x=4,head-y=5
    #[arg(long, value_name = "KEY=COLUMN,...")]
    pub columns: Option<String>,
    /// What the time column holds: seconds of the recording, or of its playback (then it only counts frames)
    #[arg(long, value_enum, default_value = "real")]
    pub time: TimeMeaning,
    /// Frames from row to row where only every n-th frame was tracked and the table has no frame column
    #[arg(long, value_name = "N")]
    pub frame_step: Option<usize>,
    /// Exposure of a frame, s
    #[arg(long, value_name = "SECONDS")]
    pub exposure_s: Option<f64>,
    /// Positions of less confidence count as missing, 0 to 1
    #[arg(long, value_name = "P")]
    pub min_likelihood: Option<f64>,
    /// Text encoding if the content does not show it, e.g. shift_jis
    #[arg(long, value_name = "NAME")]
    pub encoding: Option<String>,
    /// A fact of the test for [conditions], e.g. glass=wet (repeatable)
    #[arg(long, value_name = "KEY=VALUE")]
    pub condition: Vec<String>,
    /// Specification of the twin that made the export; marks the recording as synthetic
    #[arg(long, value_name = "SPEC.toml")]
    pub twin: Option<PathBuf>,
    /// Check and report only; write nothing
    #[arg(long)]
    pub dry_run: bool,
    /// Replace the recording that is already in the folder
    #[arg(long)]
    pub force: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Direction {
    Up,
    Down,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum TimeMeaning {
    Real,
    Playback,
}

impl Typed {
    fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        let options = self.options()?;
        let sources = self.sources.iter().map(|path| Ok(Source { name: path.display().to_string(), bytes: files::read(path)? }));
        let sources = sources.collect::<Result<Vec<_>, Failure>>()?;
        let imported = import::import(&sources, &options).map_err(Failure::input)?;
        let outputs = outputs(&sources, &imported)?;
        self.refuse_to_overwrite(&outputs)?;
        if !self.dry_run {
            let named: Vec<(&str, Vec<u8>)> = outputs.iter().map(|(name, bytes)| (name.as_str(), bytes.clone())).collect();
            files::write_all(&self.out, &named)?;
        }
        for warning in &imported.report.warnings {
            warn_line!("warning: {warning}");
        }
        if !global.quiet {
            self.summarise(&imported);
        }
        Ok(Outcome::Done)
    }

    /// The options as typed become the library's.
    fn options(&self) -> Result<Options, Failure> {
        let mut options = Options {
            name: self.out.file_name().map_or_else(|| self.out.display().to_string(), |name| name.to_string_lossy().into_owned()),
            format: Some(self.format.clone()),
            encoding: self.encoding.clone(),
            frame_rate_hz: self.frame_rate_hz,
            scale: self.scale.as_deref().map(Scale::parse).transpose().map_err(Failure::input)?,
            y_axis: self.y_axis.map(|direction| if direction == Direction::Up { YAxis::Up } else { YAxis::Down }),
            exposure_s: self.exposure_s,
            time: if self.time == TimeMeaning::Real { TimeColumn::Real } else { TimeColumn::Playback },
            frame_step: self.frame_step,
            columns: self.columns.as_deref().map(Columns::parse).transpose().map_err(Failure::input)?,
            min_likelihood: self.min_likelihood,
            ..Options::default()
        };
        for point in &self.point {
            options.add_point(point).map_err(Failure::input)?;
        }
        for condition in &self.condition {
            options.add_condition(condition).map_err(Failure::input)?;
        }
        if let Some(path) = &self.twin {
            options.twin = Some((path.display().to_string(), files::read_text(path)?));
        }
        Ok(options)
    }

    /// A folder keeps one recording; files of other origin are never replaced.
    fn refuse_to_overwrite(&self, outputs: &[(String, Vec<u8>)]) -> Result<(), Failure> {
        let here = |name: &str| self.out.join(name);
        if self.force {
            return Ok(());
        }
        for name in [TRACE_FILE, DESCRIPTION_FILE] {
            if here(name).exists() {
                let advice = "choose another --out, or add --force to replace the recording";
                return Err(Failure::Input(format!("{}: found another recording's {name}, expected a new folder; {advice}", self.out.display())));
            }
        }
        let differs = |path: &Path, bytes: &[u8]| path.exists() && !files::read(path).is_ok_and(|found| found == bytes);
        match outputs.iter().find(|(name, bytes)| differs(&here(name), bytes)) {
            Some((name, _)) => Err(Failure::Input(format!(
                "{}: found another file of this name, expected none; rename the export or choose another --out",
                here(name).display()
            ))),
            None => Ok(()),
        }
    }

    fn summarise(&self, imported: &Import) {
        let grid = imported.recording.grid();
        let verb = if self.dry_run { "would write" } else { "wrote" };
        let kind = if imported.recording.is_synthetic() { "synthetic recording" } else { "recording" };
        print_line!("{verb} {}: {kind}, {} frames at {} frames/s, {:.6} s", self.out.display(), grid.frames, grid.frame_rate_hz, grid.duration_s());
        print_line!("format: {} ({})", imported.report.format, imported.report.reason);
        for note in &imported.report.notes {
            print_line!("note: {note}");
        }
        for line in verdict(imported) {
            print_line!("verdict: {line}");
        }
    }
}

/// What is said of the quality, as `inspect` says it of the recording afterwards.
fn verdict(imported: &Import) -> Vec<String> {
    let (recording, file) = (&imported.recording, &imported.file);
    let Some(measured) = &file.quality else { return vec![] };
    let of_export = file.source.as_ref().map_or(&[][..], |source| &source.findings);
    let found = quality::findings(recording, measured, &Optics::from(&file.camera), &Instants::find(recording), of_export);
    quality::verdict(measured, &found)
}

/// Imports sources into a folder, whatever it holds.
pub fn import_into(folder: &Path, sources: &[Source], options: &Options) -> Result<(), Failure> {
    let imported = import::import(sources, options).map_err(Failure::input)?;
    let outputs = outputs(sources, &imported)?;
    files::write_all(folder, &outputs.iter().map(|(name, bytes)| (name.as_str(), bytes.clone())).collect::<Vec<_>>())
}

/// The exports as they came, the traces and the description.
fn outputs(sources: &[Source], imported: &Import) -> Result<Vec<(String, Vec<u8>)>, Failure> {
    let names = imported.file.source.iter().flat_map(|source| source.file.all().to_vec());
    let mut outputs: Vec<(String, Vec<u8>)> = names.zip(sources).map(|(name, source)| (name, source.bytes.clone())).collect();
    outputs.push((TRACE_FILE.to_owned(), trace_csv(&imported.recording).into_bytes()));
    let description = imported.file.to_toml().map_err(Failure::internal)?;
    outputs.push((DESCRIPTION_FILE.to_owned(), description.into_bytes()));
    Ok(outputs)
}
