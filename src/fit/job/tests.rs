mod cameras;
mod refusals;
mod traces;
mod whole;

use super::settings::{PARTICLES, STARTS};
use super::targets::TOLERANCE_RELATIVE;
use super::*;
use crate::feature::{Reading, ReversalInterval};
use crate::fit::bounds::Prior;
use crate::fit::search::STAGNANT_GENERATIONS;
use crate::model::parameters::find_parameter;
use crate::recording::channel::Channel;
use short_spectra::Detrend;

const KNOWN: [&str; 3] = ["friction.a", "friction.c", "blade.neck_stiffness_n_m_per_rad"];

const PUBLISHED: &str = r#"format = 1
title = "published"
scene = "../../data/scenes/x.toml"
seed = 1
[camera]
frame_rate_hz = 10000
exposure_s = 5e-5
[[parameter]]
name = "friction.a"
lower = 0.05
upper = 1.0
scale = "log"
[[component]]
name = "low"
channel = "head-drop"
window = "release+0.02..release+0.20"
band_hz = [40, 160]
target_hz = 78.4
target_sd_hz = 0.5
[[feature]]
kind = "release-after-reversal"
target = 0.05
target_sd = 0.002
[search]
global_evaluations = 240
local_evaluations = 100
"#;

const MEASURED: &str = r#"format = 1
title = "measured"
scene = "s.toml"
seed = 7
[[recording]]
path = "../../data/x"
[[parameter]]
name = "friction.c"
lower = 0.0
upper = 1.0
scale = "linear"
[[component]]
name = "high"
channel = "deflection"
window = "release+0.02..release+0.10"
band_hz = [500, 1500]
target_sd_hz = 4
tolerance_relative = 0.05
detrend = "line"
[[feature]]
kind = "rms"
name = "chatter"
channel = "deflection"
window = "release..release+0.1"
band_hz = [500, 1500]
sd_relative = 0.1
[[feature]]
kind = "mean-deflection"
window = "reversal-0.2..reversal-0.1"
sd_relative = 0.05
[search]
global_evaluations = 100
local_evaluations = 0
particles = 10
stagnation_generations = 5
"#;

/// A job with every kind of recording, condition, prior and table.
const WHOLE: &str = r#"format = 1
title = "whole"
scene = "s.toml"
seed = 7
ensemble = { members = 8, spread = 0.2 }
[[recording]]
path = "../../data/x"
[[recording]]
name = "fast"
path = "../../data/y"
scene = "t.toml"
set = { "friction.c" = 1 }
held_out = true
[[condition]]
name = "slow"
set = { friction.c = 0.5 }
[camera]
frame_rate_hz = 1000
exposure_s = 0
[[parameter]]
name = "friction.a"
lower = 0.5
upper = 2.0
scale = "log"
prior = { mean = 1.0, sd_relative = 0.1 }
[[parameter]]
name = "blade.neck_stiffness_n_m_per_rad"
lower = -1.0
upper = 1.0
scale = "linear"
prior = { mean = 0.0, sd = 0.5 }
[plausible]
largest_tilt_deg = 60
[[component]]
name = "low"
channel = "head-drop"
window = "after"
band_hz = [40, 160]
[[component]]
name = "low, fast"
channel = "head-drop"
window = "after"
band_hz = [40, 700]
recording = "fast"
[[feature]]
kind = "flip-after-reversal"
recording = 3
target = 0.0
target_sd = 0.002
[[feature]]
kind = "friction-curve"
name = "friction"
speeds_m_per_s = [0.05, 0.1]
part = "before"
[[feature]]
kind = "log-spectrum"
name = "cycle"
channel = "deflection"
window = "after"
band_hz = [500, 900]
lines = 4
floor_m = 1e-7
[[feature]]
kind = "cycle-frequency-high"
window = "after"
band_hz = [500, 1500]
segment_s = 0.02
[search]
global_evaluations = 100
local_evaluations = 0
starts = 2
[intervals]
profile = false
bootstrap = 0
"#;
fn job(text: &str) -> Result<Job, JobError> {
    Job::parse_with_names("job.toml", text, &KNOWN)
}

/// The error message for the valid job `text` in which `from` is replaced by `to`.
fn refusal(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from}");
    job(&text.replacen(from, to, 1)).unwrap_err().to_string()
}

#[test]
fn a_job_against_published_numbers() {
    let job = job(PUBLISHED).unwrap();
    assert_eq!(job.camera, Some(Camera { frame_rate_hz: 10_000.0, exposure_s: 5e-5 }));
    assert_eq!(job.parameter_names(), ["friction.a"]);
    assert_eq!(job.targets.len(), 2);
    assert_eq!(
        (job.targets[0].source, job.targets[0].tolerance_relative),
        (TargetSource::Given { target: 78.4, sd: 0.5 }, Some(TOLERANCE_RELATIVE))
    );
    let reading = Reading::Interval { interval: ReversalInterval::ReleaseAfterReversal, reversal: 1 };
    assert_eq!(
        job.targets[1].feature,
        Feature { name: "release-after-reversal".to_owned(), reading, condition: 0 }
    );
    assert_eq!(
        job.search,
        SearchSettings {
            seed: 1,
            global_evaluations: 240,
            local_evaluations: 100,
            particles: PARTICLES,
            stagnation_generations: STAGNANT_GENERATIONS,
            starts: STARTS
        }
    );
}

#[test]
fn a_job_against_a_recording() {
    let job = job(MEASURED).unwrap();
    assert_eq!((job.recordings().collect::<Vec<_>>(), job.camera), (vec!["../../data/x"], None));
    assert_eq!(job.targets[0].source, TargetSource::Measured { least_sd: 4.0, least_sd_relative: 1e-3 });
    assert_eq!(job.targets[0].tolerance_relative, Some(0.05));
    let Reading::Frequency(band) = &job.targets[0].feature.reading else { panic!() };
    assert_eq!(
        (band.channel, band.band_hz, band.detrend),
        (Channel::Deflection, (500.0, 1500.0), Detrend::Line)
    );
    assert_eq!(
        job.targets.iter().map(|a| a.feature.name.as_str()).collect::<Vec<_>>(),
        ["high", "chatter", "mean-deflection"]
    );
    assert_eq!(job.targets[2].source, TargetSource::Measured { least_sd: 0.0, least_sd_relative: 0.05 });
}

#[test]
fn keys_and_versions_are_refused_with_their_place() {
    assert_eq!(
        refusal(PUBLISHED, "seed = 1", "seeds = 1"),
        "job.toml:4:1: unknown key `seeds`; did you mean `seed`?"
    );
    assert!(refusal(PUBLISHED, "format = 1", "format = 2").contains("found 2, expected 1"));
    assert!(
        refusal(PUBLISHED, "\"log\"", "\"cubic\"")
            .starts_with("job.toml:12:9: key `parameter[1].scale`: found the text \"cubic\", expected one of \"log\", \"linear\"")
    );
    assert!(refusal(PUBLISHED, "seed = 1", "seed = -1").starts_with("job.toml:4:8: "));
}

#[test]
fn parameters_are_checked() {
    assert_eq!(
        refusal(PUBLISHED, "friction.a", "friction.aa"),
        "job.toml: parameter `friction.aa`: not a parameter of a scene; did you mean `friction.a`?"
    );
    assert!(refusal(PUBLISHED, "friction.a", "friction.A").ends_with("did you mean `friction.a`?"));
    assert!(refusal(PUBLISHED, "upper = 1.0", "upper = 0.05").starts_with(
        "job.toml: parameter `friction.a`: `lower` = 0.05 and `upper` = 0.05: expected lower < upper"
    ));
    assert!(
        refusal(PUBLISHED, "lower = 0.05", "lower = 0.0")
            .contains("expected a number above 0 because `scale` is \"log\"")
    );
    assert!(
        refusal(PUBLISHED, "upper = 1.0", "upper = inf")
            .contains("`upper`: found inf, expected a finite number")
    );
    let twice =
        "[[parameter]]\nname = \"friction.a\"\nlower = 1.0\nupper = 2.0\nscale = \"log\"\n[[component]]";
    assert_eq!(
        refusal(PUBLISHED, "[[component]]", twice),
        "job.toml: parameter `friction.a`: found twice; remove one of them"
    );
    let second = "[[parameter]]\nname = \"NAME\"\nlower = 1.0\nupper = 2.0\nscale = \"log\"\n[[component]]";
    let [stiffness, frequency] = ["neck_stiffness_n_m_per_rad", "neck_natural_frequency_hz"]
        .map(|name| find_parameter(&format!("blade.{name}")).unwrap().name);
    let same = PUBLISHED.replace("friction.a", stiffness);
    assert_eq!(
        refusal(&same, "[[component]]", &second.replace("NAME", frequency)),
        format!(
            "job.toml: parameter `{frequency}`: sets the same quantity as the parameter `{stiffness}`; remove \
             one of them"
        )
    );
}

#[test]
fn the_camera_is_asked_for_exactly_when_no_recording_brings_one() {
    assert!(
        refusal(PUBLISHED, "[camera]\nframe_rate_hz = 10000\nexposure_s = 5e-5\n", "")
            .starts_with("job.toml: camera: missing;")
    );
    assert!(
        refusal(MEASURED, "[[parameter]]", "[camera]\nframe_rate_hz = 1.0\nexposure_s = 0.0\n[[parameter]]")
            .contains("remove [camera]")
    );
    assert_eq!(
        refusal(PUBLISHED, "= 5e-5", "= 5e-4"),
        "job.toml: camera.exposure_s: found 0.0005, expected 0 to 0.0001 (one frame)"
    );
    assert!(refusal(PUBLISHED, "= 10000", "= nan").contains("camera.frame_rate_hz: found NaN"));
}

#[test]
fn components_are_checked() {
    assert!(
        refusal(PUBLISHED, "head-drop", "head-dorp")
            .contains("component `low`, `channel`: unknown channel `head-dorp`; did you mean `head-drop`?")
    );
    assert!(
        refusal(PUBLISHED, "release+0.02..release", "relase+0.02..release")
            .contains("component `low`, `window`: ")
    );
    assert!(
        refusal(PUBLISHED, "[40, 160]", "[40, 160, 3]")
            .ends_with("found [40.0, 160.0, 3.0] (3), expected two numbers, as in [40.0, 140.0]")
    );
    assert!(refusal(PUBLISHED, "[40, 160]", "[160, 40]").contains("expected 0 <= lowest < highest"));
    assert!(refusal(PUBLISHED, "[40, 160]", "[40, 6000]").contains("half the camera's frame rate, 5000 Hz"));
    assert!(
        refusal(PUBLISHED, "target_sd_hz = 0.5\n", "")
            .contains("a given `target_hz` needs its standard deviation")
    );
    assert!(
        refusal(PUBLISHED, "target_hz = 78.4\n", "").contains("without a [[recording]] expected `target_hz`")
    );
    assert!(
        refusal(PUBLISHED, "= 0.5\n", "= 0.0\n")
            .contains("`target_sd_hz`: found 0, expected a finite number above 0")
    );
    assert!(
        refusal(PUBLISHED, "= 0.5\n", "= 0.5\nrecording = 2\n")
            .contains("`recording`: found 2, expected 1 to 1")
    );
    assert!(refusal(MEASURED, "\"line\"", "\"parabola\"").contains("unknown detrending `parabola`"));
}

#[test]
fn features_are_checked() {
    assert!(refusal(PUBLISHED, "target = 0.05\n", "").contains(
        "feature `release-after-reversal` (release-after-reversal), `sd_relative`: expected either"
    ));
    assert!(
        refusal(PUBLISHED, "target = 0.05\ntarget_sd = 0.002\n", "")
            .contains("`target`: missing; without a [[recording]]")
    );
    assert!(
        refusal(PUBLISHED, "target = 0.05\n", "target = 0.0\n")
            .contains("found 0, expected a finite number that is not 0")
    );
    assert!(
        refusal(PUBLISHED, "target_sd = 0.002", "target_sd = 0.002\nwindow = \"0..1\"")
            .contains("`window`: has no meaning for this kind")
    );
    assert!(
        refusal(PUBLISHED, "target_sd = 0.002", "target_sd = 0.002\nreversal = 0")
            .contains("the first reversal is 1")
    );
    assert!(
        refusal(MEASURED, "sd_relative = 0.1\n", "sd_relative = 0.0\n")
            .contains("`sd_relative`: found 0, expected")
    );
    assert!(
        refusal(MEASURED, "name = \"chatter\"", "name = \"high\"")
            .contains("component or feature `high`: the name is used twice")
    );
    assert!(
        refusal(MEASURED, "window = \"reversal-0.2..reversal-0.1\"\n", "")
            .contains("feature `mean-deflection` (mean-deflection), `window`: missing")
    );
}

#[test]
fn budgets_are_checked() {
    assert!(
        refusal(MEASURED, "global_evaluations = 100", "global_evaluations = 9")
            .contains("search.global_evaluations: found 9, expected 10 to")
    );
    assert!(
        refusal(MEASURED, "local_evaluations = 0", "local_evaluations = 1")
            .contains("search.local_evaluations: found 1, expected 0, or 2 to")
    );
    assert!(
        refusal(MEASURED, "particles = 10", "particles = 1")
            .contains("search.particles: found 1, expected 2 to")
    );
}
