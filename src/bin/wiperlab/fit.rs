//! `wiperlab fit`.

use crate::args::Global;
use crate::failure::{Failure, Outcome};
use crate::load::{Loaded, load_recording, read_scene};
use crate::{files, progress};
use clap::Args;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;
use wiperlab::blade::parameters;
use wiperlab::fit::job::Job;
use wiperlab::fit::journal::{self, Ingredients, Journal, Sink};
use wiperlab::fit::result::{FitResult, Status};
use wiperlab::fit::scene_model::{Eye, SceneModel};
use wiperlab::fit::{Context, fit, warnings};
use wiperlab::recording::Recording;
use wiperlab::recording::files::trace_csv;
use wiperlab::recording::quality::quality;
use wiperlab::simulate::scene::{Drive, Scene};
use wiperlab::twin::Camera;

const JOURNAL: &str = "journal.jsonl";
/// What `fit` writes beside its job.
pub const RESULT: &str = "result.json";

#[derive(Debug, Args)]
pub struct FitArgs {
    /// Job of the fit (fits/NAME/job.toml)
    pub job: PathBuf,
    /// Go on from the journal beside the job
    #[arg(long)]
    pub resume: bool,
    /// Most evaluations of the model, those of the journal included (default: what the job allows)
    #[arg(long, value_name = "N")]
    pub max_evaluations: Option<usize>,
}

impl FitArgs {
    pub fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        let problem = Problem::load(&self.job)?;
        let result = problem.solve(global, self.resume, self.max_evaluations)?;
        if !global.quiet {
            print_summary(&result);
            print_line!("written to {}", problem.folder.join(RESULT).display());
        }
        Ok(if result.status == Status::Converged { Outcome::Done } else { Outcome::StoppedEarly })
    }
}

/// A job with everything that it names.
pub struct Problem {
    pub folder: PathBuf,
    pub job: Job,
    pub scene: Scene,
    pub measured: Vec<Loaded>,
    pub fingerprint: String,
    file: String,
}

impl Problem {
    /// Reads and checks a job, its scene and its recordings.
    pub fn load(path: &Path) -> Result<Self, Failure> {
        let file = path.display().to_string();
        let text = files::read_text(path)?;
        let job = Job::parse(&file, &text, &parameters::names()).map_err(Failure::input)?;
        let folder = path.parent().map_or_else(PathBuf::new, Path::to_owned);
        let scene_path = folder.join(&job.conditions[0].scene);
        let scene = read_scene(&scene_path)?;
        for parameter in &job.parameters {
            let ends = [parameter.bounds.lower(), parameter.bounds.upper()];
            for end in ends {
                scene.with(&parameter.name, end).map_err(|error| Failure::Input(format!("{file}: bounds of `{}`: {error}", parameter.name)))?;
            }
        }
        let measured = job.recordings().map(|path| load_recording(&folder.join(path))).collect::<Result<Vec<_>, _>>()?;
        let data: Vec<String> = measured.iter().map(fingerprinted).chain(recorded_drive(&scene)).collect();
        let bytes: Vec<&[u8]> = data.iter().map(String::as_bytes).collect();
        let scene_text = files::read_text(&scene_path)?;
        let version = env!("CARGO_PKG_VERSION");
        let fingerprint = journal::fingerprint(&Ingredients { job: &text, scene: &scene_text, data: &bytes, version, seed: job.search.seed });
        Ok(Self { folder, job, scene, measured, fingerprint, file })
    }

    /// The model of the job: its scene through the cameras of its recordings, or through the job's own.
    pub fn model(&self) -> SceneModel<'_> {
        let recorded = self.measured.iter().map(|loaded| {
            let exposure_s = loaded.file.as_ref().and_then(|f| f.camera.exposure_s);
            let camera = Camera { frame_rate_hz: loaded.recording.grid().frame_rate_hz, exposure_s: exposure_s.unwrap_or(0.0) };
            // the head moves most smoothly, so its noise is estimated best
            Eye { camera, noise_m: quality(&loaded.recording, exposure_s).head_x.noise_m.unwrap_or(0.0) }
        });
        let own = self.job.camera.iter().map(|c| Eye { camera: Camera { frame_rate_hz: c.frame_rate_hz, exposure_s: c.exposure_s }, noise_m: 0.0 });
        SceneModel::new(&self.scene, self.job.parameter_names(), recorded.chain(own).collect())
    }

    /// Fits, and writes the journal as it goes and the result at the end.
    pub fn solve(&self, global: &Global, resume: bool, max_evaluations: Option<usize>) -> Result<FitResult, Failure> {
        if max_evaluations == Some(0) {
            return Err(Failure::Input("--max-evaluations: found 0, expected 1 or more".to_owned()));
        }
        let journal_path = self.folder.join(JOURNAL);
        let resumed = if resume { self.resumed(&journal_path)? } else { None };
        let measured: Vec<Recording> = self.measured.iter().map(|loaded| loaded.recording.clone()).collect();
        // what cannot be fitted is refused before the old journal is touched
        wiperlab::fit::targets(&self.job, &measured).map_err(|error| Failure::Input(format!("{}: {error}", self.file)))?;
        for warning in warnings(&self.job) {
            warn_line!("warning: {warning}");
        }

        let allowed = max_evaluations.unwrap_or(usize::MAX).min(self.job.search.global_evaluations + self.job.search.local_evaluations);
        let bar = progress::bar(allowed as u64, "fit", global.quiet);
        let mut watch = |now: &wiperlab::fit::ledger::Progress| {
            bar.set_position(now.evaluations as u64);
            bar.set_message(format!("cost {:.4}", now.best_cost));
            ControlFlow::Continue(())
        };
        let name = journal_path.display().to_string();
        let context = Context {
            fingerprint: &self.fingerprint,
            version: env!("CARGO_PKG_VERSION"),
            max_evaluations,
            resume: resumed.as_ref().map(|journal| (name.as_str(), journal)),
        };
        let mut sink = JournalFile::open(&journal_path, resumed.as_ref())?;
        let clock = Instant::now();
        let mut result = fit(&self.job, &measured, &self.model(), &context, &mut sink, &mut watch).map_err(Failure::input)?;
        result.wall_s = Some(clock.elapsed().as_secs_f64());
        bar.finish_and_clear();
        files::write_all(&self.folder, &[(RESULT, result.to_json().into_bytes())])?;
        Ok(result)
    }

    /// The journal to be continued; a missing one means starting anew.
    fn resumed(&self, path: &Path) -> Result<Option<Journal>, Failure> {
        if !path.exists() {
            warn_line!("warning: {}: nothing to resume; starting anew", path.display());
            return Ok(None);
        }
        let name = path.display().to_string();
        let journal = journal::read(&name, &files::read_text(path)?).map_err(Failure::input)?;
        if let Some(journal) = &journal {
            journal::check_fingerprint(&name, journal, &self.fingerprint).map_err(Failure::input)?;
            if journal.torn {
                warn_line!("warning: {name}: the last line is incomplete and was dropped; its evaluation is made again");
            }
        }
        Ok(journal)
    }
}

/// What of a recording decides a fit: its traces and its camera.
fn fingerprinted(loaded: &Loaded) -> String {
    let camera = loaded.file.as_ref().map(|f| format!("{:?}", f.camera)).unwrap_or_default();
    format!("{camera}\n{}", trace_csv(&loaded.recording))
}

/// The measured motion of the head that drives the scene, where there is one: it decides a fit as the scene's numbers do.
fn recorded_drive(scene: &Scene) -> Option<String> {
    matches!(scene.drive, Drive::Recorded(_)).then(|| format!("{:?}", scene.drive))
}

/// The journal on disk; each line is handed to the system before the next evaluation.
struct JournalFile {
    file: File,
    name: String,
}

impl JournalFile {
    fn open(path: &Path, resumed: Option<&Journal>) -> Result<Self, Failure> {
        let failed = |error: std::io::Error| Failure::Internal(format!("{}: cannot be written: {error}", path.display()));
        let file = OpenOptions::new().create(true).append(true).open(path).map_err(failed)?;
        file.set_len(resumed.map_or(0, |journal| journal.intact_bytes as u64)).map_err(failed)?;
        Ok(Self { file, name: path.display().to_string() })
    }
}

impl Sink for JournalFile {
    fn append(&mut self, line: &str) -> Result<(), String> {
        self.file.write_all(line.as_bytes()).and_then(|()| self.file.flush()).map_err(|error| format!("{}: {error}", self.name))
    }
}

/// Components, parameters and reservations on standard output.
pub fn print_summary(result: &FitResult) {
    let failed: usize = result.evaluations.failed.values().sum();
    print_line!("{}: {} evaluations, {failed} failed, cost {:.4}", result.status.word(), result.evaluations.total, result.cost);
    print_line!("{:<26} {:>12} {:>12} {:>9}  met", "component", "target, Hz", "model, Hz", "error, %");
    for c in &result.components {
        let model = c.model_hz.map_or("none".to_owned(), |v| format!("{v:.3}"));
        let error = c.relative_error.map_or("-".to_owned(), |v| format!("{:+.2}", 100.0 * v));
        print_line!("{:<26} {:>12.3} {model:>12} {error:>9}  {}", c.name, c.target_hz, if c.pass { "yes" } else { "no" });
    }
    print_line!("{:<36} {:>12} {:>27}  verdict", "parameter", "estimate", "95 % interval (linearised)");
    for (name, p) in &result.parameters {
        let end = |value: Option<f64>| value.map_or("open".to_owned(), |v| format!("{v:.5}"));
        print_line!("{name:<36} {:>12.6} {:>13} {:>13}  {}", p.estimate, end(p.lower_95), end(p.upper_95), p.verdict.word());
    }
    for note in &result.notes {
        print_line!("note: {note}");
    }
}
