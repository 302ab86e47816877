//! Tests that jobs with wrong conditions, tables or kinds of features are refused.

use super::*;
use crate::checkpoint::fingerprint;

#[test]
fn recordings_and_conditions_are_checked() {
    let of = |from: &str, to: &str| refusal(WHOLE, from, to);
    assert_eq!(
        of("name = \"slow\"", "name = \"fast\""),
        "job.toml: recording or condition `fast`: the name is used twice; give each its own `name`"
    );
    assert!(
        of("name = \"slow\"", "name = \"recording 1\"").contains("`recording 1`: the name is used twice")
    );
    assert!(of("name = \"slow\"", "name = \" \"").contains("condition, `name`: found \" \""));
    assert!(
        of("\"t.toml\"", "\"\"").contains("recording 2, `scene`: found \"\", expected the path of a scene")
    );
    assert!(of("path = \"../../data/x\"", "path = \"\"").contains("recording 1, `path`: found \"\""));
    assert_eq!(
        of("{ friction.c = 0.5 }", "{ friction.d = 0.5 }"),
        "job.toml: condition `slow`, `set`, `friction.d`: not a parameter of a scene; did you mean `friction.c`?"
    );
    assert!(
        of("\"friction.c\" = 1", "\"friction.c\" = nan")
            .contains("recording 2, `set`, `friction.c`: found nan, expected a finite number")
    );
    assert!(
        of("\"friction.c\" = 1", "\"friction.c\" = \"soft\"")
            .contains("found \"soft\", expected a finite number")
    );
    assert!(
        of("{ friction.c = 0.5 }", "{ friction.c = 0.5, \"friction.c\" = 0.4 }")
            .contains("condition `slow`, `set`: found `friction.c` twice")
    );
    assert!(
        of("{ friction.c = 0.5 }", "{ friction.a = 0.5 }")
            .contains("parameter `friction.a`: found free while `slow` sets `friction.a`")
    );
    assert!(
        of("recording = \"fast\"", "recording = \"fats\"")
            .contains("`recording`: no recording or condition is called `fats`; did you mean `fast`?")
    );
    assert!(of("recording = 3", "recording = 4").contains("`recording`: found 4, expected 1 to 3"));
    assert!(
        of("recording = 3", "recording = 1.5")
            .contains("expected the number of a recording, counted from 1, or its name")
    );
    assert!(
        of("[camera]\nframe_rate_hz = 1000\nexposure_s = 0\n", "")
            .contains("camera: missing; expected [camera]")
    );
    let slow = "recording = \"slow\"\ntarget_hz = 80\ntarget_sd_hz = 1\n";
    assert!(
        of("recording = \"fast\"\n", slow)
            .contains("[40, 700], expected at most half the camera's frame rate, 500 Hz"),
        "a recording brings its own rate"
    );
    assert!(
        of("target = 0.0\ntarget_sd = 0.002", "sd_relative = 0.1")
            .contains("`target`: missing; without a [[recording]] expected `target` and `target_sd`")
    );
    assert!(
        of("held_out = true\n", "held_out = 1\n").contains(".held_out`: found 1, expected true or false")
    );
}

#[test]
fn what_a_condition_sets_in_other_words_cannot_be_free() {
    let text = PUBLISHED.replace("friction.a", "blade.neck_stiffness_n_m_per_rad");
    let text = text.replace(
        "[camera]",
        "[[condition]]\nname = \"x\"\nset = { \"blade.neck_natural_frequency_hz\" = 195 }\n[camera]",
    );
    let error = Job::parse("job.toml", &text).unwrap_err().to_string();
    assert!(
        error.contains(
            "`blade.neck_stiffness_n_m_per_rad`: found free while `x` sets `blade.neck_natural_frequency_hz`"
        ),
        "{error}"
    );
}

#[test]
fn something_has_to_be_fitted() {
    let held_out = MEASURED.replace("path = \"../../data/x\"", "path = \"../../data/x\"\nheld_out = true");
    assert!(
        job(&held_out)
            .unwrap_err()
            .to_string()
            .contains("belongs to something that is held out; expected at least one thing to fit")
    );
    assert!(
        refusal(WHOLE, "members = 8", "members = 65")
            .contains("ensemble.members: found 65, expected 1 to 64")
    );
    assert!(refusal(WHOLE, "members = 8", "members = 0").contains("found 0, expected 1 to 64"));
    assert!(
        refusal(WHOLE, "spread = 0.2", "spread = 0.0")
            .contains("ensemble.spread: found 0, expected above 0 and at most 1")
    );
    assert!(
        refusal(WHOLE, "spread = 0.2", "spraed = 0.2")
            .contains("unknown key `ensemble.spraed`; did you mean `spread`?")
    );
    for tilt in ["0", "90", "nan", "-5"] {
        assert!(
            refusal(WHOLE, "deg = 60", &format!("deg = {tilt}"))
                .contains("plausible.largest_tilt_deg: found"),
            "{tilt}"
        );
    }
    assert!(
        refusal(WHOLE, "starts = 2", "starts = 65").contains("search.starts: found 65, expected 1 to 64")
    );
    assert!(
        refusal(WHOLE, "bootstrap = 0", "bootstrap = 1001")
            .contains("intervals.bootstrap: found 1001, expected 0 to 1000")
    );
}

/// The error message for the job `MEASURED` with one more feature, whose table consists of `lines` only.
fn refused_feature(lines: &str) -> String {
    refusal(
        MEASURED,
        "[[feature]]\nkind = \"rms\"",
        &format!("[[feature]]\n{lines}\n[[feature]]\nkind = \"rms\""),
    )
}

#[test]
fn the_keys_of_each_kind_are_checked() {
    let spectral = "channel = \"deflection\"\nwindow = \"after\"\nband_hz = [500, 900]";
    let cases = [
        (
            "kind = \"mean-deflecton\"".to_owned(),
            "feature, `kind`: unknown kind `mean-deflecton`; did you mean `mean-deflection`?",
        ),
        (
            "kind = \"longest-stick\"".to_owned(),
            "feature, `kind`: found \"longest-stick\", which only a simulated run shows; map it in a study",
        ),
        (
            format!("kind = \"frequency\"\n{spectral}"),
            "feature, `kind`: found \"frequency\", which is a [[component]]",
        ),
        (
            "kind = \"stick-duration\"\nwindow = \"after\"".to_owned(),
            "`window`: has no meaning for this kind of feature, which takes reversal; remove it",
        ),
        ("kind = \"flip-duration\"\nreversal = 0".to_owned(), "`reversal`: found 0, expected 1 or more"),
        (
            "kind = \"damping-ratio\"\nwindow = \"after\"\nband_hz = [40, 160]".to_owned(),
            "`channel`: missing; expected one of deflection",
        ),
        (format!("kind = \"damping-ratio\"\n{spectral}\nsegment_s = 0.1"), "`segment_s`: has no meaning"),
        (
            format!("kind = \"cycle-frequency-low\"\n{spectral}"),
            "`segment_s`: missing; expected the length of a segment, s",
        ),
        (
            format!("kind = \"cycle-frequency-low\"\n{spectral}\nsegment_s = -1"),
            "`segment_s`: found -1, expected a finite number above 0",
        ),
        (
            "kind = \"deflection-at-speed\"\nspeed_m_per_s = 0.1".to_owned(),
            "`part`: expected either `part` = \"before\" or \"after\" (the flip), or `window`",
        ),
        (
            "kind = \"deflection-at-speed\"\npart = \"after\"".to_owned(),
            "`speed_m_per_s`: missing; expected a speed of the head, m/s",
        ),
        (
            "kind = \"deflection-at-speed\"\nspeed_m_per_s = 0.1\npart = \"flip\"".to_owned(),
            "`part`: found \"flip\", expected \"before\" or \"after\"",
        ),
        (
            "kind = \"deflection-at-speed\"\nspeed_m_per_s = 0.1\nwindow = \"after\"\nreversal = 2"
                .to_owned(),
            "`reversal`: has no meaning together with `window`",
        ),
        (
            "kind = \"deflection-at-speed\"\nspeed_m_per_s = 0.1\npart = \"after\"\nwidth_relative = 0.6"
                .to_owned(),
            "`width_relative`: found 0.6, expected above 0 and at most 0.5",
        ),
        (
            "kind = \"friction-curve\"\npart = \"after\"".to_owned(),
            "`speeds_m_per_s`: found 0 speeds, expected 1 to 100",
        ),
        (
            "kind = \"friction-curve\"\npart = \"after\"\nspeeds_m_per_s = [0.1, -0.1]".to_owned(),
            "`speeds_m_per_s`: found -0.1, expected a finite number above 0",
        ),
        (
            "kind = \"friction-curve\"\npart = \"after\"\nspeeds_m_per_s = [0.1, 0.1]".to_owned(),
            "`friction-curve at 0.1 m/s`: the name is used twice",
        ),
        (
            "kind = \"friction-curve\"\npart = \"after\"\nspeeds_m_per_s = [0.1]\ntarget = 1\ntarget_sd = 1"
                .to_owned(),
            "`target`: one target has no meaning for several features",
        ),
        (
            format!("kind = \"log-spectrum\"\n{spectral}"),
            "`floor_m`: missing; expected the rms of the noise in one line, m",
        ),
        (
            format!("kind = \"log-spectrum\"\n{spectral}\nfloor_m = 1e-7\nlines = 1"),
            "`lines`: found 1, expected 2 to 100",
        ),
    ];
    for (lines, expected) in cases {
        let message = refused_feature(&lines);
        assert!(message.contains(expected), "{message}\nexpected {expected}");
    }
    let published = "kind = \"friction-curve\"\npart = \"after\"\nspeeds_m_per_s = [0.1]";
    assert!(
        refusal(PUBLISHED, "kind = \"release-after-reversal\"\ntarget = 0.05\ntarget_sd = 0.002", published)
            .contains("`kind`: found without a [[recording]]")
    );
}

#[test]
fn the_problem_is_what_decides_a_cost_and_nothing_else() {
    let of = |from: &str, to: &str| fingerprint(&job(&WHOLE.replacen(from, to, 1)).unwrap().identity());
    let problem = of("", "");
    let same = [
        ("title = \"whole\"", "title = \"w\""),
        ("seed = 7", "seed = 8"),
        ("evaluations = 100", "evaluations = 900"),
        ("starts = 2", "starts = 3"),
    ];
    for (from, to) in same.into_iter().chain([
        ("bootstrap = 0", "bootstrap = 9"),
        ("profile = false", "profile = true"),
        ("local_evaluations = 0", "local_evaluations = 9"),
        // the fingerprint depends on the contents of the recordings but not on their paths
        ("data/x", "data/z"),
        ("t.toml", "u.toml"),
    ]) {
        assert_eq!(of(from, to), problem, "{to}");
    }
    let other = [
        ("members = 8", "members = 7"),
        ("spread = 0.2", "spread = 0.1"),
        ("friction.c = 0.5", "friction.c = 0.6"),
        ("held_out = true", "held_out = false"),
        ("rate_hz = 1000", "rate_hz = 2000"),
        ("upper = 2.0", "upper = 2.1"),
        ("sd = 0.5", "sd = 0.6"),
        ("deg = 60", "deg = 61"),
        ("window = \"after\"", "window = \"before\""),
        ("target_sd = 0.002", "target_sd = 0.003"),
        ("floor_m = 1e-7", "floor_m = 2e-7"),
        ("\"slow\"", "\"slower\""),
    ];
    for (from, to) in other {
        assert_ne!(of(from, to), problem, "{to}");
    }
}
