//! Tests of the key `camera` of a recording in a fit of features.

use super::*;
use crate::feature::LengthCalibration;
use crate::fit::target_value::TargetCalibration;

/// A job with the text `camera` in the table of its recording.
fn with(camera: &str) -> Job {
    super::job(&MEASURED.replacen(
        "path = \"../../data/x\"\n",
        &format!("path = \"../../data/x\"\n{camera}"),
        1,
    ))
    .unwrap()
}

fn calibrations(job: &Job) -> Vec<Option<TargetCalibration>> {
    job.targets.iter().map(|aim| job.target_calibration(aim)).collect()
}

#[test]
fn lengths_of_a_recording_have_a_camera_unless_the_job_says_otherwise() {
    let usual = |length| Some(TargetCalibration { condition: 0, scale_sd: 0.005, offset_sd_m: 1e-3, length });
    let both = [usual(LengthCalibration::Size { floor_m: 0.0 }), usual(LengthCalibration::Position)];
    let [frequency, size, place] = calibrations(&with("")).try_into().unwrap();
    assert_eq!((frequency, [size, place]), (None, both));
    let stated = with("[recording.camera]\nscale_sd = 0.002\noffset_sd_m = 0\n");
    assert_eq!(stated.conditions[0].camera, Some(FeatureCamera { scale_sd: 0.002, offset_sd_m: 0.0 }));
    let inline = with("camera = { scale_sd = 0.002, offset_sd_m = 0.0 }\n");
    assert_eq!(inline, stated);
    let exact = with("camera = \"exact\"\n");
    assert_eq!(exact, with("camera = { scale_sd = 0, offset_sd_m = 0 }\n"));
    assert_eq!(calibrations(&exact), [None, None, None]);
    let place_alone = with("camera = { scale_sd = 0 }\n");
    assert!(calibrations(&place_alone)[1].is_none() && calibrations(&place_alone)[2].is_some());
    let published = super::job(PUBLISHED).unwrap();
    assert_eq!((published.conditions[0].camera, calibrations(&published)), (None, vec![None, None]));
}

#[test]
fn a_number_that_the_job_gives_has_its_deviation_there() {
    let text = MEASURED.replacen("-0.1\"\nsd_relative = 0.05", "-0.1\"\ntarget = 3e-3\ntarget_sd = 1e-4", 1);
    let found = calibrations(&super::job(&text).unwrap());
    assert!(found[1].is_some() && found[2].is_none());
}

#[test]
fn a_camera_is_part_of_the_problem_where_a_length_depends_on_it() {
    let content = |job: &Job| serde_json::to_string(&job.identity()).unwrap();
    let exact = content(&with("camera = \"exact\"\n"));
    assert!(!exact.contains("cameras"), "what was exact stays the same problem");
    let usual = content(&with(""));
    assert!(usual.contains("cameras") && usual == content(&with("camera = { scale_sd = 0.005 }\n")));
    assert_ne!(usual, content(&with("camera = { scale_sd = 0.004 }\n")));
    let start = MEASURED.find("[[feature]]").unwrap();
    let frequency = MEASURED[..start].to_owned() + &MEASURED[MEASURED.find("[search]").unwrap()..];
    assert!(!content(&super::job(&frequency).unwrap()).contains("cameras"));
}

#[test]
fn cameras_are_checked() {
    for (camera, words) in [
        ("camera = \"exakt\"\n", "recording 1, `camera`: found \"exakt\", expected \"exact\", or a table"),
        ("camera = 0\n", "expected \"exact\", or a table such as { scale_sd = 0.005, offset_sd_m = 0.001 }"),
        (
            "camera = { scale_sd = 0.2 }\n",
            "recording 1, `camera.scale_sd`: found 0.2, expected 0 (held) to 0.1",
        ),
        (
            "camera = { offset_sd_m = nan }\n",
            "recording 1, `camera.offset_sd_m`: found NaN, expected 0 (held)",
        ),
        (
            "camera = { tilt_sd_deg = 0.3 }\n",
            "recording 1, `camera.tilt_sd_deg`: found in the camera of features",
        ),
        (
            "camera = { clock_sd_s = 0.001 }\n",
            "recording 1, `camera.clock_sd_s`: found in the camera of features",
        ),
        (
            "camera = { drift_sd_m_per_s = 1e-3 }\n",
            "`camera.drift_sd_m_per_s`: found in the camera of features, whose",
        ),
        ("[recording.camera]\nofset_sd_m = 1\n", "did you mean `offset_sd_m`?"),
    ] {
        let refused =
            refusal(MEASURED, "path = \"../../data/x\"\n", &format!("path = \"../../data/x\"\n{camera}"));
        assert!(refused.contains(words), "{refused}");
    }
    let traced = "path = \"../../data/x\"\ncamera = \"exact\"\n[[trace]]\n";
    let refused = refusal(MEASURED, "path = \"../../data/x\"\n", traced);
    assert!(refused.contains("recording 1, `camera`: found in a job with a [[trace]]"), "{refused}");
}
