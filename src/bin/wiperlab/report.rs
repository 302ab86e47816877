//! `wiperlab report`.

use crate::args::Global;
use crate::failure::{Failure, Outcome};
use crate::files;
use crate::fit::RESULT;
use crate::problem::Problem;
use crate::simulate::early_end;
use clap::Args;
use std::path::{Path, PathBuf};
use wiperlab::fit::result::FitResult;
use wiperlab::import::sha256;
use wiperlab::report::comparison::{self, Measured};
use wiperlab::report::page::page;
use wiperlab::report::{Provenance, Report, SourceFile, report_json};

#[derive(Debug, Args)]
pub struct ReportArgs {
    /// Folder of a fit (fits/NAME), with its job.toml and result.json
    #[arg(required = true, value_name = "FIT")]
    pub fits: Vec<PathBuf>,
    /// Folder of the report (default: reports/NAME beside the fits)
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Exit with 3 when a component is missed
    #[arg(long)]
    pub check: bool,
}

impl ReportArgs {
    pub fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        let [fit] = self.fits.as_slice() else {
            let found = self.fits.len();
            return Err(Failure::Input(format!("FIT: found {found} fits, expected one; this version reports one fit at a time, so run it for each")));
        };
        let out = self.out.clone().unwrap_or_else(|| default_folder(fit));
        let missed = write(fit, &out, global)?;
        Ok(if self.check && missed { Outcome::StoppedEarly } else { Outcome::Done })
    }
}

/// `reports/NAME` beside the folder `fits` that holds `fits/NAME`.
fn default_folder(fit: &Path) -> PathBuf {
    let name = files::display_name(fit);
    let full = fit.canonicalize().unwrap_or_else(|_| fit.to_owned());
    full.parent().and_then(Path::parent).unwrap_or(Path::new("")).join("reports").join(name)
}

/// Writes the report of a fit; says whether a component was missed.
pub fn write(fit: &Path, out: &Path, global: &Global) -> Result<bool, Failure> {
    let problem = Problem::load(&fit.join("job.toml"))?;
    let path = fit.join(RESULT);
    if !path.is_file() {
        return Err(Failure::Input(format!("{}: no such file; run `wiperlab fit {}` first", path.display(), fit.join("job.toml").display())));
    }
    let name = path.display().to_string();
    let result = FitResult::parse(&name, &files::read_text(&path)?).map_err(Failure::input)?;
    if result.fingerprint != problem.fingerprint {
        return Err(Failure::Input(format!(
            "{name}: fingerprint {}, expected {}: job, scene, data or program have changed since the fit; run `wiperlab fit` again",
            result.fingerprint, problem.fingerprint
        )));
    }
    let report = build(fit, &problem, &result)?;
    let mut outputs: Vec<(&str, Vec<u8>)> = report.figures.iter().map(|f| (f.file.as_str(), f.svg.clone().into_bytes())).collect();
    outputs.push(("report.json", report_json(&report).map_err(Failure::internal)?.into_bytes()));
    outputs.push(("index.html", page(&report).into_bytes()));
    files::write_all(out, &outputs)?;
    if !global.quiet {
        report.verdict().iter().for_each(|line| print_line!("{line}"));
        print_line!("written to {}", out.join("index.html").display());
    }
    Ok(!result.passes())
}

fn build(fit: &Path, problem: &Problem, result: &FitResult) -> Result<Report, Failure> {
    let measured: Vec<Measured> = problem.measured.iter().flatten().map(|m| Measured { recording: &m.recording, file: m.file.as_ref() }).collect();
    let views =
        comparison::best_views(&problem.job, &problem.model(), result).map_err(|why| Failure::Internal(format!("the best model does not run: {why}")))?;
    for how in views.iter().filter_map(|seen| early_end(&seen.run)) {
        warn_line!("warning: the best model's run ended early: {how}");
    }
    let mut report = comparison::report(&problem.job, &measured, &views, result);
    report.provenance = provenance(fit, problem, result)?;
    Ok(report)
}

fn provenance(fit: &Path, problem: &Problem, result: &FitResult) -> Result<Provenance, Failure> {
    let hashed = |name: String, path: &Path| Ok(SourceFile { name, sha256: sha256(&files::read(path)?) });
    let job = format!("fits/{}/job.toml", files::display_name(fit));
    let mut sources = vec![hashed(job.clone(), &fit.join("job.toml"))?];
    let mut scenes: Vec<&String> = problem.job.conditions.iter().map(|condition| &condition.scene).collect();
    scenes.dedup();
    for scene in scenes {
        sources.push(hashed(scene.clone(), &problem.folder.join(scene))?);
    }
    for (recording, loaded) in problem.job.recordings().zip(problem.measured.iter().flatten()) {
        let folder = problem.folder.join(recording);
        let trace = if folder.is_dir() { folder.join("trace.csv") } else { folder };
        sources.push(hashed(format!("{recording} (trace.csv)"), &trace)?);
        let exports = loaded.file.iter().filter_map(|f| f.source.as_ref());
        sources.extend(
            exports.flat_map(|s| s.file.all().iter().zip(s.sha256.all()).map(|(name, sha256)| SourceFile { name: name.clone(), sha256: sha256.clone() })),
        );
    }
    let commands = vec![format!("wiperlab fit {job}"), format!("wiperlab report fits/{}", files::display_name(fit))];
    Ok(Provenance { version: result.version.clone(), seed: Some(result.seed), fingerprint: result.fingerprint.clone(), files: sources, commands })
}
