//! Reports on input unlike the bundled fits: films, recordings cut short or full of holes, runs that end
//! early, blades that never stick, several conditions.

use crate::claims::{MOST_FIGURES, assert_claims};
use crate::thorough::pick;
use plain_charts::{Figure, Medium};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use wiperlab::compare::{FittedRecording, ModelRun, run_conditions};
use wiperlab::figures::{Drawing, FigureBlock};
use wiperlab::fit::job::Job;
use wiperlab::fit::result::FitResult;
use wiperlab::fit::scene_model::{Instrument, ModelCondition, PlausibilityLimits, SceneModel};
use wiperlab::recording::files::parse_trace_csv;
use wiperlab::recording::{FrameGrid, Recording, Traces};
use wiperlab::report::assembly;
use wiperlab::report::{FigureSubject, Report};
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::twin::Camera;

const SCENE: &str = include_str!("../../data/scenes/actual-blade.toml");
const TRACE: &str = include_str!("../../data/actual-blade-twin/trace.csv");
const JOB: &str = include_str!("../../fits/actual-blade-twin/job.toml");
const RESULT: &str = include_str!("../../fits/actual-blade-twin/result.json");

/// Everything that a report is made of.
struct Case {
    scene: String,
    /// That of every condition but the first, where it is another.
    another: Option<String>,
    job: Job,
    result: FitResult,
    recordings: Vec<Recording>,
}

/// The bundled fit to this recording.
fn case(recordings: Vec<Recording>) -> Case {
    let job = Job::parse("job.toml", JOB).unwrap();
    Case {
        scene: SCENE.to_owned(),
        another: None,
        job,
        result: FitResult::parse("result.json", RESULT).unwrap(),
        recordings,
    }
}

/// The bundled traces in another form.
fn traced(synthetic: bool, change: impl FnOnce(FrameGrid, Traces) -> (FrameGrid, Traces)) -> Recording {
    let (grid, traces) = parse_trace_csv("trace.csv", TRACE).unwrap();
    let (grid, traces) = change(grid, traces);
    Recording::new("blade", grid, traces, synthetic).unwrap()
}

fn columns(traces: &mut Traces) -> [&mut Vec<Option<f64>>; 4] {
    [&mut traces.tip_x_m, &mut traces.tip_y_m, &mut traces.head_x_m, &mut traces.head_y_m]
}

impl Case {
    fn best(&self) -> Vec<ModelRun> {
        let condition = |i: usize| {
            let frame_rate_hz = self.recordings.get(i).map_or(5000.0, |r| r.grid().frame_rate_hz);
            let camera = Camera { frame_rate_hz, exposure_s: 5e-6 };
            let scene = self.another.as_ref().filter(|_| i > 0).unwrap_or(&self.scene);
            ModelCondition {
                scene: Scene::parse("s", scene).unwrap(),
                instrument: Instrument { camera, noise_m: 0.0, dropout_fraction: 0.0 },
            }
        };
        let conditions = (0..self.job.conditions.len()).map(condition).collect();
        let model = SceneModel::new(conditions, self.job.parameter_names(), PlausibilityLimits::default());
        run_conditions(&self.job, &model, &self.result).unwrap()
    }

    fn measured(&self) -> Vec<FittedRecording<'_>> {
        self.recordings
            .iter()
            .map(|recording| FittedRecording { recording, file: None, film: None })
            .collect()
    }

    fn report(&self) -> Report {
        let report = assembly::build_report(&self.job, &self.measured(), &self.best(), &self.result);
        one_sentence_each(&report);
        assert_claims(&report);
        report
    }
}

/// Captions of what was measured and of the blade are one sentence of at most fifty words.
fn one_sentence_each(report: &Report) {
    for figure in
        report.figures.iter().filter(|g| g.subject != FigureSubject::Parameters).flat_map(|g| &g.figures)
    {
        let words = figure.caption.split_whitespace().count();
        assert!((5..=50).contains(&words), "{}: {words} words: {}", figure.file, figure.caption);
        assert!(
            figure.caption.ends_with('.') && !figure.caption.contains(". "),
            "{}: {}",
            figure.file,
            figure.caption
        );
    }
}

fn block<'a>(report: &'a Report, file: &str) -> &'a FigureBlock {
    report.all_figures().find(|f| f.file == file).unwrap_or_else(|| panic!("no {file}"))
}

fn chart<'a>(report: &'a Report, file: &str) -> &'a Figure {
    let Drawing::Chart(figure) = &block(report, file).drawing else { panic!("{file} is no chart") };
    figure
}

#[test]
fn a_film_is_nowhere_called_synthetic() {
    let mut film = case(vec![traced(false, |grid, traces| (grid, traces))]);
    (film.job.title, film.result.synthetic) = ("A blade".to_owned(), false);
    let report = film.report();
    assert!(report.parameters.iter().all(|p| p.truth.is_none()));
    for figure in report.all_figures() {
        let drawn = figure.drawing.on_screen();
        assert!(
            !drawn.contains("synthetic")
                && ![&figure.caption, &figure.details].iter().any(|said| said.contains("synthetic")),
            "{}: {}",
            figure.file,
            figure.details
        );
    }
}

/// Recordings with random losses, noise and ends: [`Case::report`] checks every title.
#[test]
fn titles_of_generated_recordings_have_the_numbers_of_their_figures() {
    let count = if std::env::var_os("WIPERLAB_THOROUGH").is_some() { 30 } else { 5 };
    for seed in 0..count {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let lost = random.random_range(0.0..0.4);
        let noise_m = 10f64.powf(random.random_range(-7.0..-4.5));
        let share = random.random_range(0.3..1.0);
        let worse = |grid: FrameGrid, mut traces: Traces| {
            let frames = (share * grid.frames as f64) as usize;
            for column in columns(&mut traces) {
                column.truncate(frames);
                for x in column.iter_mut() {
                    let moved_m = noise_m * random.random_range(-1.0..1.0);
                    *x = x.map(|x| x + moved_m).filter(|_| random.random_range(0.0..1.0) > lost);
                }
            }
            (FrameGrid { frames, ..grid }, traces)
        };
        case(vec![traced(true, worse)]).report();
    }
}

#[test]
fn without_a_release_both_spectrograms_show_what_the_camera_saw() {
    let before = |grid: FrameGrid, mut traces: Traces| {
        let frames = (0.1 * grid.frame_rate_hz) as usize; // the head turns then, and the tip is held
        columns(&mut traces).into_iter().for_each(|column| column.truncate(frames));
        (FrameGrid { frames, ..grid }, traces)
    };
    let report = case(vec![traced(true, before)]).report();
    let maps: Vec<_> =
        chart(&report, "spectrogram.svg").panels.iter().filter_map(|p| p.heat_map.as_ref()).collect();
    assert_eq!(maps.len(), 2);
    assert!(
        maps[0].x.iter().zip(&maps[1].x).all(|(measured, model)| (measured - model).abs() < 1e-3),
        "{:?} {:?}",
        maps[0].x,
        maps[1].x
    );
}

#[test]
fn a_recording_of_holes_has_no_empty_map() {
    let holes = |grid: FrameGrid, mut traces: Traces| {
        traces.tip_x_m.iter_mut().enumerate().filter(|(i, _)| i % 7 > 1).for_each(|(_, x)| *x = None);
        (grid, traces)
    };
    let report = case(vec![traced(true, holes)]).report();
    let titles: Vec<&str> =
        chart(&report, "spectrogram.svg").panels.iter().map(|p| p.title.as_str()).collect();
    assert_eq!(titles.first(), Some(&"model"), "{titles:?}");
}

#[test]
fn a_run_that_ends_early_is_said_to_and_shown_as_far_as_it_went() {
    let fast =
        Case { scene: SCENE.replace("frequency_hz = 0.749", "frequency_hz = 12.0"), ..case(Vec::new()) };
    let report = fast.report();
    let said = &block(&report, "history.svg").details;
    assert!(
        said.contains("The model's run ended early, at 0.58") && said.contains("the tip lifts off the glass"),
        "{said}"
    );
    let stopped_s = report.runs[0].stopped_at_s;
    let (_, end_s) = chart(&report, "history.svg").panels[0].x.range.unwrap();
    assert!(end_s <= stopped_s, "{end_s} {stopped_s}");
}

#[test]
fn a_tip_that_flies_and_lands_is_said_to() {
    let light = SCENE.replace("frequency_hz = 0.749", "frequency_hz = 12.0")
        + "\n[contact]\nloss = \"fly\"\njam = \"impact\"\n";
    let report = Case { scene: light, ..case(Vec::new()) }.report();
    let flights = report.runs[0].contact_losses;
    let page = report.render_page();
    assert!(flights > 10 && page.contains(&format!("leaves the glass {flights} times")), "{flights}");
}

#[test]
fn a_blade_that_never_sticks_is_said_to() {
    let mut smooth = case(Vec::new());
    for (name, found) in &mut smooth.result.parameters {
        found.estimate = if name == "friction.a" || name == "friction.c" { 0.0 } else { found.estimate };
    }
    let report = smooth.report();
    let said = &block(&report, "history.svg").caption;
    assert_eq!(said, "The model's tip never sticks: 0 % of the time.");
    let law = chart(&report, "friction.svg").to_svg(Medium::Column);
    assert!(!law.contains("10\u{207b}\u{b9}"), "a coefficient of zero needs no powers of ten");
}

/// The bundled fit with a second recording, in the same scene or in another.
fn takes(another: Option<String>) -> Case {
    let two = JOB.replacen("[[recording]]\n", "[[recording]]\nname = \"first\"\n", 1).replacen(
        "[[parameter]]",
        "[[recording]]\nname = \"second\"\npath = \"../../data/other\"\n\n[[parameter]]",
        1,
    );
    let first = traced(true, |grid, traces| (grid, traces));
    let second = Recording::new("sword", first.grid(), first.traces().clone(), true).unwrap();
    Case { another, job: Job::parse("job.toml", &two).unwrap(), ..case(vec![first, second]) }
}

#[test]
fn figures_of_two_conditions_tell_which_they_are_of() {
    let report = takes(Some(SCENE.replace("preload_force_n = 0.126", "preload_force_n = 0.127"))).report();
    assert!(report.all_figures().count() <= MOST_FIGURES, "one set of figures for both");
    for figure in ["history.svg", "spectrogram.svg", "stick-slip.svg", "spectrum.svg"] {
        let drawn = chart(&report, figure);
        let named = ["first", "second"].map(|name| {
            drawn.panels.iter().any(|panel| panel.title.starts_with(name)) || drawn.title.starts_with(name)
        });
        assert_eq!(named, [true; 2], "{figure}");
        let said = &block(&report, figure).caption;
        assert!(said.starts_with("first: ") || said.starts_with("second: "), "{figure}: {said}");
    }
    let cycles = &chart(&report, "cycle.svg").panels[0].series;
    assert!(["first", "second"].iter().all(|name| cycles.iter().any(|s| s.label.starts_with(name))));
    for figure in ["poses.svg", "animation.svg"] {
        let FigureBlock { caption, details, .. } = block(&report, figure);
        assert!(
            (caption.starts_with("first: ") || caption.starts_with("second: "))
                && !details.contains("is the same"),
            "{figure}: {caption} {details}"
        );
    }
}

#[test]
fn the_sticks_of_the_animation_come_one_after_the_other() {
    let recording = traced(true, |grid, traces| (grid, traces));
    let report = case(vec![recording]).report();
    // over most of the animation
    let Drawing::Moving(svg) = &block(&report, "animation.svg").drawing else {
        panic!("the animation is none")
    };
    let before = svg.split_once("tip: stick").unwrap().0;
    let shares: Vec<f64> = before
        .rsplit_once("keyTimes=\"")
        .unwrap()
        .1
        .split('"')
        .next()
        .unwrap()
        .split(';')
        .map(|share| share.parse().unwrap())
        .collect();
    assert!(
        shares.windows(2).all(|pair| pair[0] < pair[1]) && shares.last().unwrap() - shares[0] > 0.5,
        "{shares:?}"
    );
}

#[test]
fn takes_of_one_condition_share_the_figures_of_the_model_alone() {
    let report = takes(None).report();
    for figure in ["poses.svg", "animation.svg"] {
        let details = &block(&report, figure).details;
        assert!(
            details.ends_with("The model's run is the same in second, but for the clock of the recording."),
            "{details}"
        );
    }
    assert!(report.all_figures().count() <= MOST_FIGURES);
}

#[test]
fn a_recording_of_the_tip_alone_is_shown_as_far_as_it_goes() {
    const LATE_S: f64 = 3.0;
    let tip = |grid: FrameGrid, mut traces: Traces| {
        let frames = grid.frames;
        (traces.head_x_m, traces.head_y_m) = (vec![None; frames], vec![None; frames]);
        (FrameGrid { start_s: grid.start_s + LATE_S, ..grid }, traces)
    };
    let report = case(vec![traced(true, tip)]).report();
    let labels = chart(&report, "history.svg").panels.iter().map(|p| p.y.label.as_str()).collect::<Vec<_>>();
    assert_eq!(
        labels[..5],
        ["tip x, mm", labels[1], "head x, mm", "deflection, mm", "head drop, mm"],
        "only the tip has a residual"
    );
    let velocity = &chart(&report, "stick-slip.svg").panels[0];
    assert_eq!(velocity.series.len(), 2, "a velocity needs no head");
}

#[test]
fn a_blade_filmed_on_its_way_back_is_told_from_the_model() {
    let back = |grid: FrameGrid, mut traces: Traces| {
        [&mut traces.tip_x_m, &mut traces.head_x_m]
            .into_iter()
            .for_each(|column| column.iter_mut().flatten().for_each(|x| *x = -*x));
        (grid, traces)
    };
    let report = case(vec![traced(true, back)]).report();
    assert!(report.runs[0].opposite_turn);
    let said = &block(&report, "history.svg").caption;
    assert!(said.contains("The recorded head turns the other way than the model's"), "{said}");
    let both = &chart(&report, "history.svg").panels[0].series;
    assert!(both.iter().all(|line| line.points.iter().any(Option::is_some)), "both are seen");
}

#[test]
fn a_map_without_a_ridge_promises_none() {
    const FRAMES: usize = 30;
    let short = |grid: FrameGrid, mut traces: Traces| {
        columns(&mut traces)
            .into_iter()
            .for_each(|column| *column = column.split_off(1700)[..FRAMES].to_vec());
        (FrameGrid { start_s: grid.time_s(1700), frames: FRAMES, ..grid }, traces)
    };
    // without a band that is sought, thirty frames show nothing that could be followed
    let head = JOB.find("# What the whole run must show").unwrap();
    let sought = "[[feature]]\nkind = \"mean-deflection\"\nwindow = \"0.341..0.345\"\n\n";
    let job = Job::parse("job.toml", &[&JOB[..head], sought].concat()).unwrap();
    let report = Case { job, ..case(vec![traced(true, short)]) }.report();
    let said = &block(&report, "spectrogram.svg").caption;
    assert!(said.contains("Nothing stands out long enough to be followed"), "{said}");
}

#[test]
fn a_law_without_correlations_names_what_is_not_fixed() {
    let mut case = case(Vec::new());
    case.result.correlations.clear();
    let said = block(&case.report(), "friction.svg").details.clone();
    assert!(said.contains("The data do not fix A, B and C, so the law has no interval"), "{said}");
}

#[test]
fn a_fast_camera_makes_no_large_figure_and_none_of_noise() {
    /// Largest error of a place, m.
    const NOISE_M: f64 = 4e-6;
    let times: usize = pick(4, 8);
    let finer = |grid: FrameGrid, mut traces: Traces| {
        let frames = (grid.frames - 1) * times;
        let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
        for column in columns(&mut traces) {
            let between = |i: usize| {
                let (low, high) = (column[i / times]?, column[i / times + 1]?);
                Some(
                    low + (high - low) * (i % times) as f64 / times as f64
                        + NOISE_M * random.random_range(-1.0..1.0),
                )
            };
            *column = (0..frames).map(between).collect();
        }
        (FrameGrid { frames, frame_rate_hz: grid.frame_rate_hz * times as f64, ..grid }, traces)
    };
    let report = case(vec![traced(true, finer)]).report();
    for figure in report.all_figures() {
        let bytes = figure.drawing.on_screen().len();
        assert!(bytes < 300_000, "{}: {bytes} bytes", figure.file);
    }
    let low = &chart(&report, "spectrum.svg").panels[0];
    let (_, top_hz) = low.x.range.unwrap();
    assert!(
        low.title.starts_with("head drop") && top_hz <= 5e3,
        "75 Hz is not seen on an axis to {top_hz} Hz"
    );
}

#[test]
fn names_of_many_words_leave_captions_short() {
    let name = "tip, and a head that turns; ".repeat(20);
    let recording = traced(true, |grid, traces| (grid, traces));
    let recording = Recording::new(&name, recording.grid(), recording.traces().clone(), true).unwrap();
    let mut case = case(vec![recording]);
    case.job.title = name.clone();
    case.job.conditions[0].name = name.clone();
    case.job.targets.iter_mut().for_each(|aim| aim.feature.name = name.clone());
    case.report();
    case.recordings.clear();
    case.report();
}

#[test]
fn a_comparison_is_data_with_a_unit_in_every_column() {
    let report = case(vec![traced(true, |grid, traces| (grid, traces))]).report();
    let [summary] = report.comparison.as_slice() else { panic!("{:?}", report.comparison) };
    let (shift_s, sd_s) = (summary.clock_shift_s.unwrap(), summary.clock_shift_sd_s.unwrap());
    // (the recording counts from 0 at 0.56 s of the scene)
    assert!((shift_s + 0.56).abs() < 1e-5 && sd_s > 0.0 && sd_s < 1e-5, "{shift_s} {sd_s}");
    let head = summary.residuals.iter().find(|r| r.channel == "head-x").unwrap();
    assert!((head.rms_m / 2e-6 - 1.0).abs() < 0.05, "{head:?}"); // the noise of the twin
    assert!((head.rms_over_noise.unwrap() - 1.0).abs() < 0.1, "{head:?}");
    let [measured, model] = [&summary.ridge.measured, &summary.ridge.model].map(|r| r.as_ref().unwrap());
    assert_eq!(measured.segment_s, model.segment_s);
    assert!(summary.windows.iter().all(|w| w.measured_s.is_some() && w.model_s.is_some()));

    let lines = |file: &str| {
        let table = report.tables.iter().find(|t| t.file == file).unwrap();
        table
            .text
            .lines()
            .map(|line| line.split(',').map(str::to_owned).collect())
            .collect::<Vec<Vec<String>>>()
    };
    let [residuals, ridge, transitions] = ["residuals.csv", "ridge.csv", "transitions.csv"].map(lines);
    for table in [&residuals, &ridge, &transitions] {
        assert!(table.iter().all(|row| row.len() == table[0].len()));
    }
    let columns = ["condition", "recording", "time_s", "tip_x_m", "head_x_m", "deflection_m", "head_drop_m"];
    assert_eq!(residuals[0], columns);
    assert!(residuals[1..].iter().all(|row| row[1] == "synthetic"));
    let squares: Vec<f64> =
        residuals[1..].iter().filter_map(|row| row[4].parse().ok()).map(|x: f64| x * x).collect();
    let rms_m = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    assert_eq!(rms_m, head.rms_m, "the columns are those that the numbers are of");
    assert_eq!(ridge.len() - 1, measured.points + model.points);
    assert_eq!(transitions.len() - 1, summary.transitions);
    assert_eq!(summary.transitions, report.runs[0].transitions);
}
