//! `wiperlab accuracy`.

use super::failure::describe_early_end;
use super::load::read_scene;
use super::prelude::*;
use crate::figures::work_precision::{WorkPrecision, WorkPrecisionRun, draw_figure};
use crate::simulate::accuracy::{
    AccuracyRow, HIGH_COMPONENT, LOW_COMPONENT, REFERENCE_TOLERANCE, ReferenceRun, TOLERANCES, list_settings,
    write_accuracy_csv, write_work_precision_csv,
};
use crate::simulate::scene::Scene;
use crate::simulate::{IntegrationMethod, RunStatus};
use crate::text::format_digits;
use std::time::{Duration, Instant};

#[derive(Debug, Args)]
pub(crate) struct AccuracyArgs {
    /// Scene to study (scene.toml)
    pub scene: PathBuf,
    /// Folder for work-precision.csv, accuracy.csv and work-precision.svg
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

const WORK_PRECISION: &str = "work-precision.csv";
const ACCURACY: &str = "accuracy.csv";
/// File names of the outputs.
const OUTPUTS: [&str; 5] = [
    WORK_PRECISION,
    ACCURACY,
    "work-precision.svg",
    "paper/work-precision-85mm.svg",
    "paper/work-precision-170mm.svg",
];
/// Number of rounds of timing. Each round times every setting once, so that other load on the machine affects
/// all settings alike.
const ROUNDS: u32 = 15;
/// Number of rounds that time every setting, and the minimum total time per setting. Later rounds time only
/// the settings that have not yet reached this total time.
const MIN_TIMING: (u32, Duration) = (3, Duration::from_millis(250));

impl AccuracyArgs {
    pub(crate) fn run(&self, global: &GlobalArgs) -> Outcome {
        let scene = read_scene(&self.scene)?;
        let writer = global.write_policy(OutputCommand::Accuracy, self.overwrite);
        OutputFolder::check(&self.out, &writer, &OUTPUTS)?;
        let settings = list_settings(&scene);
        let steps = settings.len() as u64 + u64::from(ROUNDS);
        let bar = progress::start_bar(steps, "accuracy", "settings and rounds", global.quiet);
        let reference = ReferenceRun::from_scene(&scene);
        let measured =
            settings.into_iter().map(|setting| reference.measure_setting(setting)).inspect(|_| bar.inc(1));
        let mut rows: Vec<AccuracyRow> = measured.collect();
        time_settings(&reference, &mut rows, || bar.inc(1));
        bar.finish_and_clear();
        let mut outputs = vec![
            (WORK_PRECISION.to_owned(), write_work_precision_csv(&rows).into_bytes()),
            (ACCURACY.to_owned(), write_accuracy_csv(&reference, &rows).into_bytes()),
        ];
        let diagram = draw_figure(&work_precision_diagram(&scene, &reference, &rows));
        outputs.extend(files::figure_files("work-precision", &diagram));

        files::write_outputs(&self.out, &writer, &outputs)?;
        if !global.quiet {
            print_study(&scene, &reference, &rows);
            print_line!("written to {}", self.out.display());
        }
        Ok(CommandOutcome::done_if(reference.run_result().status == RunStatus::Completed))
    }
}

/// Sets the wall time of every setting to its shortest time in any round.
fn time_settings(reference: &ReferenceRun<'_>, rows: &mut [AccuracyRow], after_round: impl Fn()) {
    let (least_rounds, long_enough) = MIN_TIMING;
    let mut taken = vec![Duration::ZERO; rows.len()];
    for round in 0..ROUNDS {
        for (row, taken) in
            rows.iter_mut().zip(&mut taken).filter(|(_, taken)| round < least_rounds || **taken < long_enough)
        {
            let clock = Instant::now();
            std::hint::black_box(reference.run_untracked(&row.setting));
            let elapsed = clock.elapsed();
            *taken += elapsed;
            row.wall_s = row.wall_s.min(elapsed.as_secs_f64());
        }
        after_round();
    }
}

fn work_precision_diagram(
    scene: &Scene,
    reference: &ReferenceRun<'_>,
    rows: &[AccuracyRow],
) -> WorkPrecision {
    let run = reference.run_result();
    let length_s = (1e4 * (run.stopped_at_s - scene.start_s)).round() / 1e4;
    // the drawn error is that of the transition times; if there are no transitions, or if the two reference
    // runs have different ones, it is the error of the deflection
    let timed = run.transitions > 0 && reference.lists_agree;
    let (unit, error_label, floor) = if timed {
        (" s", "worst error of a transition time, s", reference.apart_s)
    } else {
        ("", "worst error of the deflection over its range", Some(reference.state_apart))
    };
    let error = |row: &AccuracyRow| if timed { row.lists.worst_s } else { Some(row.state_worst) };
    let drawn_error = |row: &AccuracyRow| Some(error(row)?.max(floor.unwrap_or(0.0)));
    let point = |row: &AccuracyRow| WorkPrecisionRun {
        method: row.setting.name().to_owned(),
        wall_s: row.wall_s,
        error: error(row),
        wrong_transitions: if timed { row.lists.missed + row.lists.invented } else { 0 },
    };
    let predicted = |row: &AccuracyRow| {
        let is_shown = timed && row.predicted_time_error_s.is_some();
        is_shown.then(|| WorkPrecisionRun {
            method: format!("{}, predicted", row.setting.name()),
            error: row.predicted_time_error_s,
            wrong_transitions: 0,
            ..point(row)
        })
    };
    let (title, transitions) = (scene.title(), run.transitions);
    WorkPrecision {
        title: diagram_title(rows, drawn_error, unit),
        subtitle: format!("work-precision of {title}: {transitions} transitions in {length_s} s of motion"),
        error_label: error_label.to_owned(),
        points: rows.iter().map(point).chain(rows.iter().filter_map(predicted)).collect(),
        floor: floor.filter(|floor| *floor > 0.0),
    }
}

/// Heading of the diagram: the smallest error, with the setting that reaches it and the wall time of that
/// setting.
fn diagram_title(rows: &[AccuracyRow], error: impl Fn(&AccuracyRow) -> Option<f64>, unit: &str) -> String {
    let least = rows.iter().filter_map(|row| Some((error(row)?, row))).min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((error, row)) = least else { return "No setting has an error to show".to_owned() };
    let (error, wall_ms) = (format_digits(error, 2), format_digits(1e3 * row.wall_s, 2));
    format!("Least error {error}{unit}: {} in {wall_ms} ms", row.setting.name())
}

fn print_study(scene: &Scene, reference: &ReferenceRun<'_>, rows: &[AccuracyRow]) {
    let run = reference.run_result();

    let (title, start_s, stop_s) = (scene.title(), scene.start_s, run.stopped_at_s);
    print_line!("{title}: {} transitions from {start_s} s to {stop_s} s", run.transitions);

    if let Some(how) = describe_early_end(run) {
        print_line!("the reference ends early: {how}");
    }
    print_reference_error(reference);
    let [low, high] = [LOW_COMPONENT, HIGH_COMPONENT]
        .map(|i| reference.components.hz[i].map_or("none".to_owned(), |hz| format!("{hz:.3} Hz")));
    print_line!("components of the reference: low {low}, high {high}");
    print_line!(
        "method            tolerance transitions worst time, s predicted, s missed invented   deflection         rms   low, Hz  high, Hz   wall, ms         rhs"
    );
    rows.iter().for_each(|row| print_row(reference, row));
    print_line!(
        "times are the least of several runs; deflection: worst and rms error over its range; \"<\": below what the reference is sure of"
    );
}

/// Prints how accurate the reference run is.
fn print_reference_error(reference: &ReferenceRun<'_>) {
    let (method, other) = (IntegrationMethod::default().name(), reference.checked_by.name());
    if !reference.lists_agree {
        print_line!(
            "reference: {method} and {other} at {REFERENCE_TOLERANCE:e} have different transitions: errors of transition times are not to be trusted"
        );
        return;
    }
    let apart = reference.apart_s.map(|s| format!("{s:.1e} s apart in the transition times"));
    print_line!(
        "reference: {method} at {REFERENCE_TOLERANCE:e}; {other} at the same is {}, {:.1e} of its range in the deflection",
        apart.as_deref().unwrap_or("without transitions"),
        reference.state_apart
    );
    let finest = TOLERANCES.iter().fold(f64::INFINITY, |a: f64, b| a.min(*b));
    if let Some(apart) = reference.apart_s.filter(|apart| *apart > finest) {
        print_line!(
            "that is more than the finest tolerance, {finest:e}: errors below {apart:.1e} s do not count"
        );
    }
}

fn print_row(reference: &ReferenceRun<'_>, row: &AccuracyRow) {
    let small = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.1e}"));
    let bound = |s| if reference.resolves_error(s) { "" } else { "<" };
    let error = row.lists.worst_s.map_or("-".to_owned(), |s| format!("{}{s:.1e}", bound(s)));
    let predicted = small(row.predicted_time_error_s);
    let step = || row.setting.method.step_s().map_or(String::new(), |h| format!("{h:e} s"));
    let sets = row.setting.relative_tolerance.map_or_else(step, |r| format!("{r:e}"));
    let [worst, rms] = [row.state_worst, row.state_rms].map(|error| small(Some(error)));
    let [low, high] = [LOW_COMPONENT, HIGH_COMPONENT].map(|i| small(row.components_hz[i]));
    print_line!(
        "{:<17} {sets:>9} {:>11} {error:>13} {predicted:>12} {:>6} {:>8} {worst:>12} {rms:>11} {low:>9} {high:>9} {:>10.3} {:>11}",
        row.setting.name(),
        row.run.transitions,
        row.lists.missed,
        row.lists.invented,
        1e3 * row.wall_s,
        row.run.work.rhs_evaluations
    );
}
