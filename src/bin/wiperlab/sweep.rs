//! `wiperlab sweep`.

use crate::failure::{Failure, Outcome};
use crate::files::{Maker, Overwrite, Place, Writer};
use crate::global::Global;
use crate::interrupt;
use crate::journal::{JOURNAL, JournalFile};
use crate::load::read_scene;
use crate::{files, progress};
use clap::Args;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use wiperlab::journal::{Sink, header_line, text};
use wiperlab::report::figure::sweep_map::figure;
use wiperlab::simulate::scene::Scene;
use wiperlab::sweep::journal::{header, outcomes};
use wiperlab::sweep::outputs::{Summary, sweep_csv};
use wiperlab::sweep::{self, Outcome as Point, Reason, Study, SweepError};

const TABLE: &str = "sweep.csv";
const SUMMARY: &str = "summary.json";

#[derive(Debug, Args)]
pub struct SweepArgs {
    /// Study to run (sweep.toml): a scene, one or two of its parameters, and what is mapped
    pub sweep: PathBuf,
    /// Folder for sweep.csv, summary.json, one SVG a map, and journal.jsonl, which grows with every point
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    #[command(flatten)]
    pub overwrite: Overwrite,
    /// Go on from the journal in DIR; without it a study starts over and the old journal is kept as
    /// journal.previous-1.jsonl (the next free number)
    #[arg(long)]
    pub resume: bool,
}

impl SweepArgs {
    pub fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        let problem = Problem::load(&self.sweep)?;
        let writer = Writer::new(Maker::Sweep, self.overwrite);
        files::check_free(&self.out.join(JOURNAL))?;
        let names = problem.outputs();
        Place::check(&self.out, &writer, &names.iter().map(String::as_str).collect::<Vec<_>>())?;
        let Some(outcomes) = problem.solve(&self.out.join(JOURNAL), self.resume, global)? else {
            return Ok(Outcome::StoppedEarly);
        };
        let summary = problem.write(&self.out, &writer, &outcomes)?;
        warn_of_panics(&outcomes);
        if !global.quiet {
            print_summary(&problem.study, &summary);
            print_line!("written to {}", self.out.display());
        }
        Ok(if summary.shows_something() { Outcome::Done } else { Outcome::StoppedEarly })
    }
}

/// A checked study with its scene.
struct Problem {
    study: Study,
    scene: Scene,
    fingerprint: String,
}

impl Problem {
    fn load(path: &Path) -> Result<Self, Failure> {
        let file = path.display().to_string();
        let text = files::read_toml(path)?;
        let study = Study::parse(&file, &text).map_err(Failure::input)?;
        let scene = read_scene(&path.parent().unwrap_or(Path::new("")).join(&study.scene))?;
        study.check_scene(&file, &scene).map_err(Failure::input)?;
        let fingerprint = study.fingerprint(&scene);
        Ok(Self { study, scene, fingerprint })
    }

    /// Files that the study writes at its end, but for its maps on paper.
    fn outputs(&self) -> Vec<String> {
        let maps = self.study.maps.iter().map(|map| format!("{}.svg", map.slug));
        [TABLE, SUMMARY].map(str::to_owned).into_iter().chain(maps).collect()
    }

    /// Runs what the journal does not hold, and writes the journal as it goes; `None` where it was
    /// interrupted.
    fn solve(&self, path: &Path, resume: bool, global: &Global) -> Result<Option<Vec<Point>>, Failure> {
        let header = header(&self.study, &self.fingerprint);
        let (mut sink, resumed) = JournalFile::open(path, resume)?;
        let opening = match &resumed {
            None => header_line(&header),
            Some(journal) if journal.is_unchecked() => text(&header, &journal.records),
            Some(_) => String::new(),
        };
        if let Some(journal) = &resumed {
            let name = path.display().to_string();
            journal.check_problem(&name, &header).map_err(Failure::input)?;
            sweep::recheck(&self.study, &self.scene, &name, journal).map_err(Failure::input)?;
        }
        if !opening.is_empty() {
            sink.append(&opening).map_err(Failure::Internal)?;
        }
        let known = resumed.map_or_else(Vec::new, outcomes);
        let taken = known.iter().flatten().count();
        if taken > 0 {
            progress::say(
                global.quiet,
                &format!("{taken} of {} points are taken from the journal", self.study.points()),
            );
        }
        let bar = progress::bar((self.study.points() - taken) as u64, "sweep", "points", global.quiet);
        let journaled = Arc::new(AtomicUsize::new(taken));
        let kept = self.kept(path, &journaled);
        let stops = interrupt::stops(kept.clone());
        let done = || {
            bar.inc(1);
            journaled.fetch_add(1, Ordering::Relaxed);
        };
        let ran = sweep::run(&self.study, &self.scene, &known, &mut sink, &done, &interrupt::flow);
        bar.finish_and_clear();
        sink.finish()?;
        match ran {
            Ok(outcomes) => Ok(Some(outcomes)),
            Err(SweepError::Interrupted) => {
                stops.finishing(&kept());
                Ok(None)
            }
            Err(failed) => Err(Failure::internal(failed)),
        }
    }

    /// What is on the disk when the study is interrupted.
    fn kept(&self, journal: &Path, done: &Arc<AtomicUsize>) -> impl Fn() -> String + Clone + use<> {
        let (journal, points, done) = (journal.display().to_string(), self.study.points(), Arc::clone(done));
        move || {
            let done = done.load(Ordering::Relaxed);
            format!("{journal} holds {done} of {points} points; go on with --resume")
        }
    }

    fn write(&self, out: &Path, writer: &Writer, outcomes: &[Point]) -> Result<Summary, Failure> {
        let summary = Summary::new(&self.study, self.scene.title(), &self.fingerprint, outcomes);
        let maps = self.study.maps.iter().enumerate();
        let mut outputs: Vec<_> = maps
            .flat_map(|(at, map)| files::drawn(&map.slug, &figure(&self.study, &self.scene, outcomes, at)))
            .collect();
        outputs.push((TABLE.to_owned(), sweep_csv(&self.study, outcomes).into_bytes()));
        outputs.push((SUMMARY.to_owned(), summary.to_json().map_err(Failure::internal)?.into_bytes()));
        files::write_outputs(out, writer, &outputs)?;
        Ok(summary)
    }
}

/// A panic is a fault of the program, not of the study, and must not pass for one.
fn warn_of_panics(outcomes: &[Point]) {
    let panics = outcomes.iter().enumerate().filter_map(|(index, point)| {
        Some((index, point.ended.as_ref().filter(|e| e.reason == Reason::Panicked)?))
    });
    for (index, ended) in panics {
        warn_line!(
            "warning: point {} of the grid: the program failed: {}; please report it",
            index + 1,
            ended.why
        );
    }
}

fn print_summary(study: &Study, summary: &Summary) {
    let counts = |counts: &std::collections::BTreeMap<&str, usize>| {
        counts.iter().map(|(word, n)| format!("{n} {word}")).collect::<Vec<_>>().join(", ")
    };
    print_line!("{}: {} simulated runs: {}", summary.title, summary.points, counts(&summary.status));
    for axis in &study.axes {
        let ends = axis.values.first().zip(axis.values.last());
        let (from, to) = ends.map_or((0.0, 0.0), |(from, to)| (*from, *to));
        print_line!("over {}: {} values from {from} to {to}", axis.parameter.name, axis.values.len());
    }
    print_line!("{:<28} {:>9} {:>13} {:>13}  without a value", "map", "values", "least", "greatest");
    for map in &summary.maps {
        let end = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.6}"));
        print_line!(
            "{:<28} {:>9} {:>13} {:>13}  {}",
            map.column,
            map.values,
            end(map.least),
            end(map.greatest),
            counts(&map.missing)
        );
    }
}
