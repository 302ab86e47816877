//! Holds the program against measured stick-slip of sliders (docs/measured.md names the sources). The
//! recordings are not part of this repository. `cargo run --release --example measured -- DIR` expects
//! `DIR/frame/load-{250,350,550}g.csv` with the columns `time_s, mass_x_m, base_x_m`, and
//! `DIR/paper/kSTIFFNESS-vSPEED.csv` with `time_s, tip_x_m, head_x_m`, all in SI units. It prints what the
//! fits find, as tables in Markdown.

use std::path::Path;
use wiperlab::fit::job::Job;
use wiperlab::fit::result::{FitResult, ParameterResult};
use wiperlab::fit::{MeasuredRecording, Problem};
use wiperlab::recording::{FrameGrid, Recording, Traces};
use wiperlab::simulate::scene::Scene;

const GRAVITY: f64 = 9.81;
/// Loads of the frame, kg, each with the friction force, N, that the equation of motion gives.
const LOADS: [(f64, f64); 3] = [(0.25, 0.683), (0.35, 0.999), (0.55, 1.623)];
/// Mass of the slider on paper, kg.
const PAPER_KG: f64 = 0.0307;

fn main() {
    let folder = std::env::args().nth(1).expect("the folder with `frame` and `paper`");
    let folder = Path::new(&folder);
    measure_frame(folder);
    measure_paper(folder);
}

/// A recording from the first three columns of a table: time, tip and head.
fn read_recording(path: &Path, name: &str) -> Recording {
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let number = |cell: &str| cell.parse::<f64>().expect("a number");
    let rows: Vec<Vec<f64>> =
        text.lines().skip(1).map(|row| row.split(',').take(3).map(number).collect()).collect();
    let frames = rows.len();
    let frame_rate_hz = ((frames - 1) as f64 / (rows[frames - 1][0] - rows[0][0])).round();
    let column = |k: usize| rows.iter().map(|row| Some(row[k])).collect();
    let traces = Traces {
        tip_x_m: column(1),
        head_x_m: column(2),
        tip_y_m: vec![None; frames],
        head_y_m: vec![None; frames],
        ..Traces::default()
    };
    Recording::new(name, FrameGrid { start_s: rows[0][0], frame_rate_hz, frames }, traces, false)
        .expect("a recording")
}

fn slider_scene(mass: f64, stiffness: f64, normal: f64, law: &str) -> Scene {
    let text = format!(
        "format = 1\ntitle = \"slider\"\n[slider]\nmass_kg = {mass}\nnormal_force_n = {normal}\n\
         stiffness_n_per_m = {stiffness}\ndamping_n_s_per_m = 0.1\n[friction]\n{law}\n\
         [drive]\nspeed_m_per_s = 0.0\n[run]\nstop_s = 10.0\nsample_rate_hz = 250.0\n"
    );
    Scene::parse("scene.toml", &text).expect("a scene")
}

const COULOMB: &str = "a = 0.0\nb_s_per_m = 0.0\nc = 0.3";

/// Fits recordings, each with its normal force, N; `window` and `parameters` are lines of the job.
fn fit_records(recordings: &[(&Recording, f64)], scene: &Scene, window: &str, parameters: &str) -> FitResult {
    let mut text =
        "format = 1\ntitle = \"measured\"\nscene = \"scene.toml\"\nseed = 1\nnuisance = \"exact\"\n"
            .to_owned();
    for (recording, normal) in recordings {
        text += &format!(
            "[[recording]]\nname = \"{}\"\npath = \"recording\"\nset = {{ \"slider.normal_force_n\" = {normal} }}\n\
             [[trace]]\nrecording = \"{0}\"\nchannels = [\"tip-x\"]\n{window}\n\
             [trace.camera]\noffset_sd_m = 0.002\nscale_sd = 0.0\n",
            recording.name()
        );
    }
    let job = Job::parse("job.toml", &(text + parameters)).expect("a job");
    let measured = recordings
        .iter()
        .map(|(recording, _)| MeasuredRecording { recording: (*recording).clone(), exposure_s: Some(0.0) });
    let problem = Problem::new(job, vec![scene.clone(); recordings.len()], measured.collect());
    problem.expect("a problem").fit().expect("a fit")
}

fn write_parameter(name: &str, [lower, upper]: [f64; 2], more: &str) -> String {
    format!("[[parameter]]\nname = \"{name}\"\nlower = {lower}\nupper = {upper}\nscale = \"log\"\n{more}\n")
}

/// The estimate times `factor` with its interval.
fn format_estimate(found: &ParameterResult, factor: f64, digits: usize) -> String {
    let end = |end: Option<f64>| end.map_or("open".to_owned(), |end| format!("{:.digits$}", factor * end));
    let (low, high) = (end(found.lower_95), end(found.upper_95));
    format!("{:.digits$} ({low} to {high})", factor * found.estimate)
}

/// The estimate times `factor` at the end of each stage, the shortest segments first.
fn format_stages(result: &FitResult, key: &str, factor: f64) -> String {
    let stages = &result.misfit.as_ref().expect("a fit to traces").stages;
    stages.iter().map(|stage| format!("{:.3}", factor * stage.estimates[key])).collect::<Vec<_>>().join(", ")
}

/// Root mean square of the residual of a recording and noise of the sensor, um.
fn format_residual(result: &FitResult, recording: &Recording) -> String {
    let channels = &result.misfit.as_ref().expect("a fit to traces").channels;
    let own = channels.iter().find(|channel| channel.recording == recording.name()).expect("the recording");
    format!("{:.1}, {:.2}", 1e6 * own.residual_rms_m, 1e6 * own.noise_m)
}

/// A fit and the time that it takes, s.
fn time_fit(fit: impl Fn() -> FitResult) -> (FitResult, f64) {
    let begun = std::time::Instant::now();
    let result = fit();
    (result, begun.elapsed().as_secs_f64())
}

fn measure_frame(folder: &Path) {
    let records = LOADS.map(|(load, _)| {
        let grams = (1e3 * load).round();
        read_recording(&folder.join(format!("frame/load-{grams}g.csv")), &format!("{grams} g"))
    });
    let frame = slider_scene(3.0799, 1191.0, 1.0, COULOMB);
    let free = |scope: &str| {
        write_parameter("friction.c", [0.03, 1.5], scope)
            + &write_parameter("slider.stiffness_n_per_m", [200.0, 6000.0], "")
            + &write_parameter("slider.damping_n_s_per_m", [0.01, 20.0], "")
    };
    let force = |at: usize| GRAVITY * LOADS[at].0;
    println!(
        "| record | friction, N | by length of segments | expected, N | stiffness, N/m | damping, N s/m | \
         residual, noise, um | time, s |"
    );
    println!("|---|---|---|---:|---|---|---:|---:|");
    let line = |name: &str, at: usize, key: &str, (result, time_s): &(FitResult, f64)| {
        let found = |name: &str| &result.parameters[name];
        println!(
            "| {name} | {} | {} | {} | {} | {} | {} | {time_s:.1} |",
            format_estimate(found(key), force(at), 3),
            format_stages(result, key, force(at)),
            LOADS[at].1,
            format_estimate(found("slider.stiffness_n_per_m"), 1.0, 0),
            format_estimate(found("slider.damping_n_s_per_m"), 1.0, 1),
            format_residual(result, &records[at])
        );
    };
    for (at, record) in records.iter().enumerate() {
        let result = time_fit(|| fit_records(&[(record, force(at))], &frame, "", &free("")));
        line(&format!("{} alone", record.name()), at, "friction.c", &result);
        result.0.notes.iter().filter(|note| note.contains("zeros")).for_each(|note| eprintln!("{note}"));
    }
    let all: Vec<_> = records.iter().enumerate().map(|(at, record)| (record, force(at))).collect();
    let together = time_fit(|| fit_records(&all, &frame, "", &free("scope = \"recording\"")));
    for (at, record) in records.iter().enumerate() {
        line(&format!("{} together", record.name()), at, &format!("friction.c@{}", at + 1), &together);
    }
    let together = together.0;
    let ends = |at: usize| {
        let found = &together.parameters[&format!("friction.c@{at}")];
        [found.lower_95.unwrap_or(0.0), found.upper_95.unwrap_or(f64::INFINITY)]
    };
    let apart = ends(1)[1] < ends(3)[0] || ends(3)[1] < ends(1)[0];
    let words = match apart {
        true => "are apart: friction is not proportional to the load",
        false => "overlap: friction may be proportional to the load",
    };
    println!("\nThe intervals of the friction coefficient at the least and the largest load {words}.");
    let known = together.parameters.values().filter(|found| found.verdict.name() == "identified").count();
    println!("Parameters that are identified in the fit of all loads: {known}.");
    // the middle load is predicted: friction is interpolated, stiffness and damping are those of the others
    let others = fit_records(&[all[0], all[2]], &frame, "", &free("scope = \"recording\""));
    let value = |name: &str| others.parameters[name].estimate;
    let [low, high] = [value("friction.c@1") * force(0), value("friction.c@2") * force(2)];
    let expected = low + (high - low) * (force(1) - force(0)) / (force(2) - force(0));
    let held = |name: &str, value: f64| {
        let near = [value / 1.0001, value * 1.0001];
        write_parameter(name, near, "")
    };
    let pinned = held("friction.c", expected / force(1))
        + &held("slider.stiffness_n_per_m", value("slider.stiffness_n_per_m"))
        + &held("slider.damping_n_s_per_m", value("slider.damping_n_s_per_m"));
    let predicted = fit_records(&[all[1]], &frame, "", &pinned);
    println!(
        "\nThe record at 350 g predicted from the others: friction {expected:.4} N, residual and noise {} um.\n",
        format_residual(&predicted, &records[1])
    );
}

fn measure_paper(folder: &Path) {
    println!(
        "| record | slips a second | scatter of the period | slips, um | scatter | falls | static | kinetic | \
         explained |"
    );
    println!("|---|---:|---:|---:|---:|---:|---:|---:|---|");
    for (stiffness, speed) in [(168, 1100), (1002, 1100), (168, 4300), (2254, 1100), (2254, 4300)] {
        let name = format!("k{stiffness}-v{speed}");
        let record = read_recording(&folder.join(format!("paper/{name}.csv")), &name);
        let (stiffness, weight) = (f64::from(stiffness), GRAVITY * PAPER_KG);
        let law = "a = 0.0\nb_s_per_m = 0.0\nc = 0.3\nstatic_ratio = 1.5";
        let free = write_parameter("friction.c", [0.05, 1.0], "")
            + &write_parameter("friction.static_ratio", [1.001, 4.0], "")
            + &write_parameter("slider.damping_n_s_per_m", [0.001, 2.0], "");
        let paper = slider_scene(PAPER_KG, stiffness, weight, law);
        let result = fit_records(&[(&record, weight)], &paper, "window = \"0.1..2.1\"", &free);
        let misfit = result.misfit.as_ref().expect("a fit to traces");
        let explained = if misfit.explained { "yes" } else { "no" };
        let identified = result.parameters.values().filter(|p| p.verdict.name() == "identified").count();
        let explained = format!("{explained}; {identified} identified");
        let pulls: Vec<f64> =
            deflections(&record).map(|deflection| -deflection * stiffness / weight).collect();
        let slips = find_slips(&pulls);
        let [limit, kinetic] = [|slip: &[f64; 2]| slip[0], |slip: &[f64; 2]| 0.5 * (slip[0] + slip[1])]
            .map(|force| format_mean(&slips.iter().map(force).collect::<Vec<_>>()));
        let cycle = record.count_cycles(0..record.grid().frames).map_or_else(
            |why| format!("{why} | | |"),
            |cycle| {
                format!(
                    "{:.1}({:.1}) | {:.0} % | {:.0} | {:.0} %",
                    cycle.rate_hz,
                    cycle.rate_sd_hz,
                    100.0 * cycle.period_scatter,
                    1e6 * cycle.size_m,
                    100.0 * cycle.size_scatter
                )
            },
        );
        println!("| {name} | {cycle} | {} | {limit} | {kinetic} | {explained} |", slips.len());
    }
}

/// Position of the slider minus that of its head in every frame, m.
fn deflections(record: &Recording) -> impl Iterator<Item = f64> {
    let traces = record.traces();
    let each = traces.tip_x_m.iter().zip(&traces.head_x_m);
    each.map(|(tip, head)| tip.unwrap_or(f64::NAN) - head.unwrap_or(f64::NAN))
}

/// The largest pull before each slip and the smallest after it. A slip is a fall of the pull by more than 0.3
/// of the range in which nine of ten pulls lie.
fn find_slips(pulls: &[f64]) -> Vec<[f64; 2]> {
    let mut sorted = pulls.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| sorted[(share * sorted.len() as f64) as usize];
    let least = 0.3 * (at(0.95) - at(0.05));
    let (mut slips, mut most, mut extreme): (Vec<[f64; 2]>, Option<f64>, f64) = (Vec::new(), None, pulls[0]);
    for &pull in pulls {
        let falls = most.is_some();
        match most {
            _ if (pull < extreme) == falls => extreme = pull,
            None if extreme - pull > least => (most, extreme) = (Some(extreme), pull),
            Some(before) if pull - extreme > least => {
                slips.push([before, extreme]);
                (most, extreme) = (None, pull);
            }
            _ => {}
        }
    }
    slips
}

/// The mean with its 95 % interval and the scatter. Neighbouring slips are alike, so the interval comes from
/// the means of ten blocks.
fn format_mean(values: &[f64]) -> String {
    const BLOCKS: usize = 10;
    /// 97.5 % quantile of Student's t with nine degrees of freedom.
    const T: f64 = 2.262;
    let mean_and_sd = |values: &[f64]| {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        (mean, (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt())
    };
    let block = |k: usize| &values[k * values.len() / BLOCKS..(k + 1) * values.len() / BLOCKS];
    let blocks: Vec<f64> = (0..BLOCKS).map(|k| mean_and_sd(block(k)).0).collect();
    let ((mean, sd), of_blocks) = (mean_and_sd(values), mean_and_sd(&blocks).1);
    format!("{mean:.3} +- {:.3} (scatter {sd:.3})", T * of_blocks / (BLOCKS as f64).sqrt())
}
