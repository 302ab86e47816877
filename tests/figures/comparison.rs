//! The figures of the bundled fits: every one can be read by a strict reader of SVG, is small in every
//! medium, says what is synthetic or not measured, and its caption holds numbers that follow from the data.

use crate::claims::assert_claims;
use crate::raster::{colliding, inked, rasterised, sound};
use plain_charts::{Figure, MAX_HEIGHT_MM, Medium};
use std::path::{Path, PathBuf};
use wiperlab::compare::{FittedRecording, ModelRun, run_conditions};
use wiperlab::figures::{Drawing, FigureBlock};
use wiperlab::fit::job::Job;
use wiperlab::fit::result::FitResult;
use wiperlab::fit::scene_model::{Instrument, ModelCondition, PlausibilityLimits, SceneModel};
use wiperlab::fit::{MeasuredRecording, Problem};
use wiperlab::recording::Recording;
use wiperlab::recording::files::{RecordingFile, parse_trace_csv};
use wiperlab::report::Report;
use wiperlab::report::assembly;
use wiperlab::report::fit_comparison::compare_fits;
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::twin::Camera;

const MEDIA: [Medium; 3] = [Medium::Screen, Medium::Column, Medium::Page];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|problem| panic!("{}: {problem}", path.display()))
}

/// A bundled fit; without a recording where it has none.
struct Bundled {
    job: Job,
    result: FitResult,
    recorded: Option<(Recording, RecordingFile)>,
    best: Vec<ModelRun>,
}

impl Bundled {
    fn of(fit: &str) -> Self {
        let folder = root().join("fits").join(fit);
        let job = Job::parse("job.toml", &read(&folder.join("job.toml"))).unwrap();
        let result = FitResult::parse("result.json", &read(&folder.join("result.json"))).unwrap();
        let recorded = job.recordings().next().map(|path| {
            let data = folder.join(path);
            let (grid, traces) = parse_trace_csv("trace.csv", &read(&data.join("trace.csv"))).unwrap();
            let file = RecordingFile::parse("recording.toml", &read(&data.join("recording.toml"))).unwrap();
            (Recording::new("the <twin>", grid, traces, file.synthetic).unwrap(), file)
        });
        let camera = match &recorded {
            Some((recording, file)) => Camera {
                frame_rate_hz: recording.grid().frame_rate_hz,
                exposure_s: file.camera.exposure_s.unwrap_or(0.0),
            },
            None => job
                .camera
                .map(|c| Camera { frame_rate_hz: c.frame_rate_hz, exposure_s: c.exposure_s })
                .unwrap(),
        };
        let scene = Scene::parse("scene.toml", &read(&folder.join(&job.conditions[0].scene))).unwrap();
        let model = match &recorded {
            Some((recording, _)) => {
                let (recording, exposure_s) = (recording.clone(), Some(camera.exposure_s));
                let measured = MeasuredRecording { recording, exposure_s };
                let problem = Problem::new(job.clone(), vec![scene], vec![measured]).unwrap();
                problem.fitted_model(&result).unwrap()
            }
            None => {
                let instrument = Instrument { camera, noise_m: 0.0, dropout_fraction: 0.0 };
                let condition = ModelCondition { scene, instrument };
                SceneModel::new(vec![condition], job.parameter_names(), PlausibilityLimits::default())
            }
        };
        let best = run_conditions(&job, &model, &result).unwrap();
        Self { job, result, recorded, best }
    }

    fn measured(&self) -> Vec<FittedRecording<'_>> {
        self.recorded
            .iter()
            .map(|(recording, file)| FittedRecording { recording, file: Some(file), film: None })
            .collect()
    }

    fn report(&self) -> Report {
        assembly::build_report(&self.job, &self.measured(), &self.best, &self.result)
    }
}

fn report(fit: &str) -> Report {
    Bundled::of(fit).report()
}

fn figure<'a>(report: &'a Report, file: &str) -> &'a FigureBlock {
    report.all_figures().find(|f| f.file == file).unwrap_or_else(|| {
        panic!("no {file} among {:?}", report.all_figures().map(|f| &f.file).collect::<Vec<_>>())
    })
}

/// The figures that compare measurement and model; a report has further figures.
fn of_the_motion(report: &Report) -> impl Iterator<Item = &FigureBlock> {
    const FIRST: [&str; 8] =
        ["evidence", "stick-slip", "friction", "residuals", "history", "cycle", "spectrogram", "spectrum"];
    report.all_figures().filter(|f| FIRST.iter().any(|name| f.file.starts_with(name)))
}

/// Every figure in every medium as pixels.
fn assert_sound<'a>(blocks: impl Iterator<Item = &'a FigureBlock>) {
    /// Pixels that a frame with its title has.
    const LEAST_INK: usize = 4000;
    for block in blocks {
        let drawn: Vec<String> = match &block.drawing {
            Drawing::Chart(figure) => MEDIA.map(|medium| figure.to_svg(medium)).to_vec(),
            Drawing::Moving(svg) => vec![svg.clone()],
        };
        if let Drawing::Chart(figure) = &block.drawing {
            let in_print = [Medium::Column, Medium::Page].map(|medium| figure.height_mm(medium));
            assert!(in_print.iter().all(|mm| *mm <= MAX_HEIGHT_MM), "{}: {in_print:?} mm", block.file);
        }
        for svg in drawn {
            sound(&block.file, &svg);
            assert!(inked(&rasterised(&svg)) > LEAST_INK, "{}: {}", block.file, inked(&rasterised(&svg)));
            assert!(!svg.contains("<twin>"), "{}", block.file);
        }
        assert!(
            !block.caption.contains("NaN") && block.caption.len() > 20,
            "{}: {}",
            block.file,
            block.caption
        );
    }
}

/// Every heading is a claim of a length that fits, every caption one that a reader reads, and no page has too
/// many words under its figures.
fn assert_short(report: &Report) {
    const TITLE_LETTERS: usize = 76;
    const CAPTION_WORDS: usize = 50;
    const PAGE_WORDS: usize = 600;
    let words = |text: &str| text.split_whitespace().count();
    for block in report.all_figures() {
        assert!(words(&block.caption) <= CAPTION_WORDS, "{}: {}", block.file, block.caption);
        let Drawing::Chart(figure) = &block.drawing else { continue };
        let title = &figure.title;
        assert!(title.chars().count() <= TITLE_LETTERS, "{}: {title}", block.file);
        assert!(title.contains(|c: char| c.is_ascii_digit()), "{}: {title}", block.file);
    }
    let page: usize = report.all_figures().map(|block| words(&block.caption)).sum();
    assert!(page < PAGE_WORDS, "{page} words");
}

#[test]
fn every_heading_is_a_claim_with_its_number_and_captions_are_short() {
    for fit in ["actual-blade-twin", "published-experiment", "published-simulation"] {
        let report = report(fit);
        assert_short(&report);
        assert_claims(&report);
    }
}

/// A figure for print: neither heading nor the line under it, letters where there are several panels, and the
/// mark of synthetic data inside.
#[test]
fn in_print_there_is_no_heading_and_synthetic_data_are_marked() {
    let texts = |svg: &str| -> Vec<String> {
        svg.split("</text>")
            .filter_map(|part| Some(part.split_once("<text")?.1.lines().nth(1)?.to_owned()))
            .collect()
    };
    for fit in ["actual-blade-twin", "published-experiment"] {
        let report = report(fit);
        for block in report.all_figures() {
            let Drawing::Chart(figure) = &block.drawing else { continue };
            let [screen, column, page] = MEDIA.map(|medium| texts(&figure.to_svg(medium)));
            let heading = screen.first().unwrap();
            assert!(heading.starts_with(figure.title.split(' ').next().unwrap()), "{}", block.file);
            for print in [column, page] {
                let marks = print.iter().filter(|text| *text == "synthetic").count();
                assert_eq!(marks, usize::from(fit == "actual-blade-twin"), "{}: {print:?}", block.file);
                assert!(!print.contains(heading), "{}", block.file);
                let lettered =
                    print.iter().any(|text| text == "(a)") && print.iter().any(|text| text == "(b)");
                assert_eq!(lettered, figure.panels.len() > 1, "{}: {print:?}", block.file);
            }
        }
    }
}

/// What stands in every figure of the motion, and that its caption has no number missing.
fn assert_said(report: &Report, said: &str) {
    for block in of_the_motion(report) {
        let Drawing::Chart(figure) = &block.drawing else { continue };
        // (in print that belongs in the caption; the name for screen readers has it)
        for medium in MEDIA {
            assert!(figure.to_svg(medium).contains(said), "{} does not say `{said}`", block.file);
        }
        assert!(!block.caption.contains('?'), "{}: {}", block.file, block.caption);
        assert!(!block.details.contains('?'), "{}: {}", block.file, block.details);
    }
}

#[test]
fn a_twin_is_shown_against_its_model_from_the_motion_to_the_law() {
    let report = report("actual-blade-twin");
    assert_sound(report.all_figures());
    assert_said(&report, "synthetic recording: no camera took it");
    let own =
        ["evidence", "stick-slip", "friction", "residuals", "history", "cycle", "spectrogram", "spectrum"];
    assert_eq!(of_the_motion(&report).map(|f| f.file.trim_end_matches(".svg")).collect::<Vec<_>>(), own);
    the_evidence_has_the_numbers_of_the_report(&report);
    let history = &figure(&report, "history.svg").details;
    assert!(history.contains("1 high"), "{history}");
    let spectrum = &figure(&report, "spectrum.svg").caption;
    assert!(spectrum.contains("The model has all 3 target frequencies"), "{spectrum}");
    assert_ridges_are_courses(&report);
    let law = figure(&report, "friction.svg");
    assert!(
        law.caption.contains("slides evenly") && law.details.contains("At rest the law is known to"),
        "{law:?}"
    );
}

/// Residual and noise of the evidence are those of the verdict, in `result.json`, and those of the one run
/// are those of `report.json`.
fn the_evidence_has_the_numbers_of_the_report(report: &Report) {
    let summary = &report.comparison[0];
    let line = summary.restarted.iter().find(|line| line.channel == "deflection").unwrap();
    let ratio = line.rms_over_noise.unwrap();
    let tip = &report.misfit.as_ref().unwrap().channels[0];
    assert!((line.rms_m / tip.residual_rms_m - 1.0).abs() < 1e-9, "{line:?} {tip:?}");
    assert!((line.noise_m.unwrap() / tip.noise_m - 1.0).abs() < 1e-9, "{line:?} {tip:?}");
    let block = figure(report, "evidence.svg");
    let drawn = chart(block);
    assert!(drawn.title.contains("The model explains the deflection to within its noise"), "{}", drawn.title);
    assert!(
        drawn.panels[0].title.contains(&format!("{ratio:.2} times the noise")),
        "{}",
        drawn.panels[0].title
    );
    let single = summary.residuals.iter().find(|line| line.channel == "deflection").unwrap();
    let last = &drawn.panels.last().unwrap().title;
    let drift = format!("cycles {}", if summary.drift_cycles.unwrap() < 0.0 { "behind" } else { "ahead" });
    assert!(last.starts_with("one run: ") && last.contains(&drift), "{last} {drift}");
    assert!(single.rms_over_noise.unwrap() > ratio, "{single:?}");
    // every residual that is drawn has the root mean square that is written
    let points = drawn.panels[1].series[0].points.iter().flatten();
    assert!(points.clone().count() > 500 && points.map(|p| p.1.abs()).fold(0.0, f64::max) > ratio);
    assert!(drawn.subtitle.contains("restarted every 32 ms"), "{}", drawn.subtitle);
    // the noise of the twin is 2 um in every coordinate, and the path of the head is smooth
    assert!((line.noise_m.unwrap() / 2e-6 - 1.0).abs() < 0.05, "{:?}", line.noise_m);
}

#[test]
fn without_a_recording_every_figure_says_that_it_shows_the_model_alone() {
    for fit in ["published-simulation", "published-experiment"] {
        let report = report(fit);
        assert_sound(report.all_figures());
        assert_said(&report, "model alone: no traces are published");
        let law = &figure(&report, "friction.svg").details;
        assert!(law.contains("so the law has no interval"), "{law}");
        for block in of_the_motion(&report) {
            let said = [&block.caption, &block.details];
            assert!(!said.iter().any(|said| said.contains("the recording ")), "{}: {said:?}", block.file);
        }
    }
}

fn chart(block: &FigureBlock) -> &Figure {
    let Drawing::Chart(figure) = &block.drawing else { panic!("{} is no chart", block.file) };
    figure
}

/// Ridges have gaps where they would jump.
fn assert_ridges_are_courses(report: &Report) {
    /// Of a segment of 44.8 ms: no course here moves farther in a quarter of a segment.
    const RESOLUTION_HZ: f64 = 22.3;
    for panel in &chart(figure(report, "spectrogram.svg")).panels {
        let series = panel.series.iter().find(|series| series.label == "ridge").unwrap();
        let steps = series.points.windows(2).filter_map(|pair| Some((pair[1]?.1 - pair[0]?.1).abs()));
        assert!(steps.fold(0.0, f64::max) < RESOLUTION_HZ, "{}", panel.title);
        assert!(series.points.iter().flatten().count() > 25, "{}", panel.title);
    }
}

#[test]
fn the_figure_of_several_fits_is_sound_too() {
    let names = ["published-simulation", "published-experiment", "actual-blade-twin"];
    let reports = names.map(|name| Bundled::of(name).report());
    for count in [3, 8] {
        let fit = |i: usize| (format!("{}, {i}", names[i % 3]), reports[i % 3].clone());
        let several = compare_fits((0..count).map(fit).collect());
        let block = several.figure.as_ref().unwrap();
        assert_sound(std::iter::once(block));
        for medium in [Medium::Column, Medium::Page] {
            assert_eq!(colliding(&chart(block).to_svg(medium)), Vec::<[String; 2]>::new(), "{count} fits");
        }
    }
}
