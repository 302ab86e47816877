//! `wiperlab stability`.

use super::checkpoint::{CHECKPOINT_FILE, CheckpointWriter};
use super::files::RESULT_FILE;
use super::job::job_path;
use super::load::{print_warnings, read_scene};
use super::prelude::*;
use crate::figures::stability::draw_figure;
use crate::fit::result::FitResult;
use crate::model::parameter_spread::ParameterSpread;
use crate::simulate::scene::Scene;
use crate::stability::chatter::ChatterSummary;
use crate::stability::cycle_branch::CycleBranch;
use crate::stability::journal::{EvaluationLog, StudyStop};
use crate::stability::outputs::{
    describe_cycle_end, write_cycles_csv, write_stability_csv, write_stability_json,
};
use crate::stability::speed_intervals::{SlidingState, SpeedInterval, unstable_range};
use crate::stability::steady_sliding::Instability;
use crate::stability::study::{StabilityStudy, StudyRange, default_top_speed};
use crate::text::{format_digits, to_ascii};

#[derive(Debug, Args)]
pub(crate) struct StabilityArgs {
    /// Scene of the blade or slider (scene.toml)
    pub scene: PathBuf,
    /// Folder for stability.csv, cycles.csv, stability.json and stability.svg
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Speeds of the head, m/s; 0 stands for the limit of slow sliding (default: from 0 to twice the top
    /// speed of the scene's drive)
    #[arg(long, value_name = "FROM..TO", value_parser = parse_range, allow_hyphen_values = true)]
    pub speed_m_per_s: Option<NumberRange>,
    /// Preloads of the blade, or normal forces of the slider, N (default: that of the scene alone)
    #[arg(long, value_name = "FROM..TO", value_parser = parse_range, allow_hyphen_values = true)]
    pub preload_n: Option<NumberRange>,
    /// Number of speeds, and number of preloads of a range, from 2 to 1000
    #[arg(long, value_name = "N", default_value_t = 100,
          value_parser = clap::value_parser!(u16).range(2..=1000))]
    pub points: u16,
    /// Folder of the fit that wrote the scene (fits/NAME): numbers get their 95 % intervals
    #[arg(long, value_name = "FIT")]
    pub fit: Option<PathBuf>,
    #[command(flatten)]
    pub overwrite: Overwrite,
    /// Continue an interrupted study from DIR/journal.jsonl, which contains its finished evaluations; without
    /// this option a study starts anew, and the old journal is kept as journal.previous-1.jsonl
    #[arg(long)]
    pub resume: bool,
}

/// Two numbers, the second above the first.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NumberRange([f64; 2]);

fn parse_range(text: &str) -> Result<NumberRange, String> {
    let numbers = text.split_once("..").and_then(|(from, to)| Some([from.parse().ok()?, to.parse().ok()?]));
    let is_range = |[from, to]: &[f64; 2]| *from >= 0.0 && from < to && to.is_finite();
    numbers.filter(is_range).map(NumberRange).ok_or_else(|| {
        "expected FROM..TO, two numbers of 0 or more with FROM below TO, such as 0..0.5".to_owned()
    })
}

const TABLE: &str = "stability.csv";
const CYCLES: &str = "cycles.csv";
const SUMMARY: &str = "stability.json";
/// File names of the outputs.
const OUTPUTS: [&str; 6] =
    [TABLE, CYCLES, SUMMARY, "stability.svg", "paper/stability-85mm.svg", "paper/stability-170mm.svg"];
/// Largest number of changes that are printed.
const PRINTED_CHANGES: usize = 5;

impl StabilityArgs {
    pub(crate) fn run(&self, global: &GlobalArgs) -> Outcome {
        let scene = read_scene(&self.scene)?;
        let writer = global.write_policy(OutputCommand::Stability, self.overwrite);
        OutputFolder::check(&self.out, &writer, &OUTPUTS)?;
        print_warnings(&self.scene, &scene.find_implausible(), global);
        let spread =
            self.fit.as_deref().map(|fit| read_spread(fit, &self.scene, &scene)).transpose()?.flatten();
        let top = default_top_speed(&scene);
        let speeds_m_per_s = self.speed_m_per_s.map_or([0.0, top], |range| range.0);
        if speeds_m_per_s[1] <= speeds_m_per_s[0] {
            let expected = "a drive that moves the head; name speeds with --speed-m-per-s 0..0.5";
            return Err(Failure::at(
                self.scene.display(),
                format!("found a head at rest, expected {expected}"),
            ));
        }
        let preloads_n = self.preload_n.map(|range| range.0);
        let range = StudyRange { speeds_m_per_s, preloads_n, points: usize::from(self.points) };
        let journal = self.out.join(CHECKPOINT_FILE);
        let is_new = !self.out.exists();
        let solved = self.solve(&scene, range, spread.as_ref(), &journal, global)?;
        let Some((study, chatter)) = solved else { return Ok(CommandOutcome::StoppedEarly) };
        let remove_journal =
            || std::fs::remove_file(&journal).map_err(|error| Failure::at(journal.display(), error));
        if let Some(reason) = study.why_impossible() {
            let [from, to] = speeds_m_per_s;
            let preloads = preloads_n
                .map_or(String::new(), |[from, to]| format!(" and no preload from {from} to {to} N"));
            let body = if scene.linkage.is_slider() { "slider" } else { "blade" };
            let problem = format!(
                "at no speed from {from} to {to} m/s{preloads} can the {body} slide steadily: {}; expected a {body} that \
                 slides steadily; change preload, friction or speeds",
                reason.meaning()
            );
            remove_journal()?;
            if is_new {
                let _ = std::fs::remove_dir(&self.out); // another program may have written a file to it
            }
            return Err(Failure::at(self.scene.display(), problem));
        }
        let json = write_stability_json(&study, &chatter);
        let json = serde_json::to_vec_pretty(&json).map_err(Failure::internal)?;
        let mut outputs =
            vec![(TABLE.to_owned(), write_stability_csv(&study).into_bytes()), (SUMMARY.to_owned(), json)];
        outputs.push((CYCLES.to_owned(), write_cycles_csv(&study).into_bytes()));
        outputs.extend(files::figure_files("stability", &draw_figure(scene.title(), &study)));
        files::write_outputs(&self.out, &writer, &outputs)?;
        remove_journal()?; // the outputs contain its results
        if !global.quiet {
            print_study(scene.title(), &study, &chatter);
            print_line!("written to {}", self.out.display());
        }
        Ok(CommandOutcome::Done)
    }

    /// Makes the evaluations that the journal does not contain; `None` if interrupted.
    fn solve(
        &self,
        scene: &Scene,
        range: StudyRange,
        spread: Option<&ParameterSpread>,
        journal: &Path,
        global: &GlobalArgs,
    ) -> Outcome<Option<(StabilityStudy, ChatterSummary)>> {
        let name = journal.display().to_string();
        let kept = {
            let name = name.clone();
            move || format!("{name} holds the finished evaluations; go on with --resume")
        };
        let (mut sink, found) = CheckpointWriter::open(journal, self.resume)?;
        let stops = interrupt::register_stoppable(kept.clone());
        let solve = || {
            let problem = (scene, &range, spread);
            let mut log = EvaluationLog::open(problem, (&name, found), &mut sink, interrupt::control_flow)?;
            if log.written > 0 {
                let line = format!("{} evaluations are taken from the journal", log.written);
                progress::print_progress(global.quiet, &line);
            }
            let study = StabilityStudy::from_scene(scene, range.clone(), &mut log)?;
            let chatter = study.summarise_chatter(scene, spread, &mut log)?;
            Ok((study, chatter))
        };
        match solve() {
            Ok(solved) => {
                sink.finish()?;
                Ok(Some(solved))
            }
            Err(StudyStop::Interrupted) => {
                stops.announce_stop(&kept());
                Ok(None)
            }
            Err(failed @ StudyStop::JournalWrite(_)) => Err(Failure::internal(failed)),
            Err(refused) => Err(Failure::input(refused)),
        }
    }
}

/// A number with this number of digits, for the terminal.
fn format_ascii(value: f64, digits: usize) -> String {
    to_ascii(&format_digits(value, digits)).to_string()
}

fn print_study(title: &str, study: &StabilityStudy, chatter: &ChatterSummary) {
    print_line!("{title}");
    for survey in &study.own {
        let direction = match study.own.len() {
            1 => "both directions",
            _ if survey.direction < 0.0 => "backward",
            _ => "forward",
        };
        print_line!("");
        print_line!("steady sliding, {direction}, preload {} N", format_ascii(survey.preload_n, 3));
        survey.intervals.iter().for_each(print_interval);
    }
    print_line!("");
    match study.unstable_range() {
        None => print_line!("no instability of steady sliding at these speeds"),
        Some([onset, end]) => {
            print_line!("unstable between {} and {} m/s", format_ascii(onset, 4), format_ascii(end, 4));
            if end == study.range.speeds_m_per_s[1] {
                print_line!("the range ends there; name higher speeds with --speed-m-per-s");
            }
        }
    }
    print_preloads(study);
    print_chatter(study, chatter);
    if !study.changes.is_empty() {
        print_line!("");
        print_line!(
            "largest changes of the onset, the end and the end of the cycle (a damping of 0 becomes a ratio of 0.001):"
        );
    }
    for change in study.changes.iter().take(PRINTED_CHANGES) {
        let shown = |moved: Option<f64>| moved.map_or_else(|| "-".to_owned(), |v| format!("{v:+.2e} m/s"));
        let meaning = change.parameter.meaning.split(',').next().unwrap_or_default();
        let size = if change.value == 0.0 { "ratio 0.001" } else { "+1 %" };
        print_line!(
            "  {meaning:52} {size:>11}: onset {:>14}, end {:>14}, cycle {:>14}",
            shown(change.onset_m_per_s),
            shown(change.end_m_per_s),
            shown(change.fold_m_per_s)
        );
    }
}

/// Prints at how many preloads of a range steady sliding is unstable, and up to which speeds.
fn print_preloads(study: &StabilityStudy) {
    let Some([from, to]) = study.range.preloads_n else { return };
    let mut ends: Vec<(f64, f64)> = Vec::new();
    for survey in &study.by_preload {
        let Some([_, end]) = unstable_range(&survey.intervals) else { continue };
        match ends.iter_mut().find(|(preload_n, _)| *preload_n == survey.preload_n) {
            Some((_, known)) => *known = known.max(end),
            None => ends.push((survey.preload_n, end)),
        }
    }
    let [from, to, own] = [from, to, study.preload_n].map(|preload_n| format_ascii(preload_n, 3));
    let points = study.range.points;
    print_line!("at {} of {points} loads from {from} to {to} N steady sliding is unstable", ends.len());
    let by_end = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
    if let (Some(low), Some(high)) = (ends.iter().min_by(by_end), ends.iter().max_by(by_end)) {
        let words = |(preload_n, end): &(f64, f64)| {
            format!("{} m/s at {} N", format_ascii(*end, 4), format_ascii(*preload_n, 3))
        };
        let top = study.range.speeds_m_per_s[1];
        let open = if high.1 == top { ", the highest speed examined" } else { "" };
        print_line!("the instability ends between {} and {}{open}", words(low), words(high));
    }
    print_line!("what follows holds at {own} N, the load of the scene");
}

/// Prints where the cycle ends, why there is one, and what ends it sooner.
fn print_chatter(study: &StabilityStudy, chatter: &ChatterSummary) {
    let end = match study.leading_branch().and_then(CycleBranch::fold_m_per_s) {
        Some(speed) => format!("the stick-slip cycle goes on up to {} m/s: ", format_ascii(speed, 4)),
        None => String::new(),
    };
    print_line!("{end}{}", to_ascii(&describe_cycle_end(study)));
    print_line!("");
    chatter.sentences.iter().for_each(|sentence| print_line!("{}", to_ascii(sentence)));
}

/// The uncertainty of a scene that a fit wrote; `None` if the fitted model does not explain the recordings.
fn read_spread(fit: &Path, path: &Path, scene: &Scene) -> Outcome<Option<ParameterSpread>> {
    /// Largest relative difference between a value of the scene and the estimate.
    const SAME: f64 = 1e-9;
    if !fit.exists() {
        return Err(Failure::at(
            fit.display(),
            "no such fit; expected the folder of a fit, such as fits/NAME",
        ));
    }
    let file = files::containing_folder(&job_path(fit)).join(RESULT_FILE);
    let name = file.display().to_string();
    let result = FitResult::parse(&name, &files::read_json(&file)?).map_err(Failure::input)?;
    let spread = result.parameter_spread();
    for (key, estimate) in spread.names.iter().zip(&spread.estimates) {
        let found = scene.value(key);
        let is_same = found.is_some_and(|found| (found - estimate).abs() <= SAME * estimate.abs());
        if !is_same {
            let found = found.map_or_else(|| format!("no {key}"), |found| format!("{key} = {found}"));
            let problem = format!(
                "found {found}, expected {key} = {estimate}, the estimate in {name}; give the scene that this fit wrote"
            );
            return Err(Failure::at(path.display(), problem));
        }
    }
    if !result.explains_recordings() {
        warn_line!("warning: {name}: the model does not explain the recordings, so there are no intervals");
        return Ok(None);
    }
    Ok(Some(spread))
}

fn print_interval(interval: &SpeedInterval) {
    let [from, to] = interval.speeds_m_per_s.map(|speed| format_ascii(speed, 4));
    let words = match (interval.state, interval.modes) {
        // the growth is usually zero at the upper end, so the mode at the lower end is printed
        (SlidingState::Unstable, Some([mode, _])) => {
            let [growth, hz] = [format_ascii(mode.growth_per_s, 3), format_ascii(mode.frequency_hz, 4)];
            match mode.instability {
                Instability::Divergence => format!("unstable: divergence, {growth} 1/s"),
                Instability::Flutter => {
                    let band = mode.band.map_or_else(String::new, |band| format!(" ({})", band.name()));
                    format!("unstable: flutter at {hz} Hz{band}, {growth} 1/s")
                }
            }
        }
        (SlidingState::Impossible(reason), _) => format!("impossible: {}", reason.meaning()),
        _ => "stable".to_owned(),
    };
    print_line!("  {from:>8} to {to:>8} m/s  {words}");
}
