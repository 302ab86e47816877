//! Tables of a job that say how it is computed: ensemble, camera, plausibility, search, intervals.

use super::as_written;
use super::{JobRefusal, check_above_zero, refuse};
use crate::fit::search::{STAGNANT_GENERATIONS, SearchSettings};
use crate::fit::trace::MAX_TWINS;
use crate::simulate::twin::Camera;
use serde::Serialize;

/// Points of a cloud unless the job says otherwise: a few for each of up to six parameters, and a multiple of
/// common core counts.
pub(super) const PARTICLES: usize = 24;
/// Points from which a local search starts unless the job says otherwise: known cases have two or three
/// basins, and some starts share one.
pub(super) const STARTS: usize = 6;
/// Most of them: each takes its share of the local evaluations.
const MOST_STARTS: usize = 64;
/// Most evaluations of a stage: a bound on memory, weeks of computing away.
const MOST_EVALUATIONS: usize = 10_000_000;
/// Most starting states that are averaged over: eight bring a friction from 20 % to 1-3 %, and each costs a
/// run.
const MOST_MEMBERS: usize = 64;
/// Relative spread of the starting state unless the job says otherwise: how far a start guessed from a
/// recording is off.
const SPREAD: f64 = 0.1;
/// Most particles of a cloud: a thousand fill a box of many parameters.
const MOST_PARTICLES: usize = 10_000;
/// Most entries of a kind: a page and its figures show tens, and a job of more is a mistake of whatever wrote
/// it.
const MOST_ENTRIES: usize = 1000;
/// Fits to twins of the best model unless the job says otherwise: forty know a standard deviation to a tenth.
const REPLICATES: usize = 40;
/// Most of them: a thousand know a 95 % interval to a few hundredths of its width.
const MOST_REPLICATES: usize = MAX_TWINS;

/// Starting states of a model run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Ensemble {
    /// How many, 1 or more; 1 for the scene's own.
    pub members: usize,
    /// Relative spread of the starting state, above 0 and at most 1.
    pub spread: f64,
}

/// How intervals are found, apart from the linearised ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IntervalSettings {
    /// By profiles of the cost.
    pub profile: bool,
    /// By this many fits to twins of the best model; 0 for none.
    pub bootstrap: usize,
}

/// Refuses a job of more entries than anybody reads, before they are compared with each other.
pub(super) fn check_counts(written: &as_written::JobFile) -> Result<(), JobRefusal> {
    let counts = [
        ("recording", written.recording.len()),
        ("condition", written.condition.len()),
        ("parameter", written.parameter.len()),
        ("component", written.component.len()),
        ("feature", written.feature.len()),
        ("trace", written.trace.len()),
    ];
    counts.into_iter().try_for_each(|(key, found)| check_count(key, found, 0, MOST_ENTRIES, "leave some out"))
}

pub(super) fn check_camera_table(written: &as_written::JobFile) -> Result<Option<Camera>, JobRefusal> {
    let needed = written.recording.is_empty() || !written.condition.is_empty();
    match (&written.camera, needed) {
        (Some(camera), true) => check_camera(camera).map(Some),
        (None, false) => Ok(None),
        (Some(_), false) => {
            refuse("camera", "found with a [[recording]], which has its own camera; remove [camera]")
        }
        (None, true) => refuse(
            "camera",
            "missing; expected [camera] with `frame_rate_hz` and `exposure_s`, because there is a [[condition]], or no [[recording]] that has its own; add it",
        ),
    }
}

fn check_camera(camera: &Camera) -> Result<Camera, JobRefusal> {
    let frame_rate_hz = check_above_zero("camera.frame_rate_hz", camera.frame_rate_hz)?;
    let exposure_s = camera.exposure_s;
    if !(exposure_s >= 0.0 && exposure_s * frame_rate_hz <= 1.0) {
        return refuse(
            "camera.exposure_s",
            format!("found {exposure_s}, expected 0 to {} (one frame)", 1.0 / frame_rate_hz),
        );
    }
    Ok(Camera { frame_rate_hz, exposure_s })
}

pub(super) fn check_ensemble(written: &as_written::JobFile) -> Result<Ensemble, JobRefusal> {
    let (members, spread) = written.ensemble.as_ref().map_or((None, None), |e| (e.members, e.spread));
    let (members, spread) = (members.unwrap_or(1), spread.unwrap_or(SPREAD));
    check_count("ensemble.members", members, 1, MOST_MEMBERS, "starting states that are averaged over")?;
    if !(spread > 0.0 && spread <= 1.0) {
        return refuse(
            "ensemble.spread",
            format!("found {spread}, expected above 0 and at most 1: 0.1 spreads the starting state by 10 %"),
        );
    }
    Ok(Ensemble { members, spread })
}

pub(super) fn check_largest_tilt_rad(written: &as_written::JobFile) -> Result<Option<f64>, JobRefusal> {
    let Some(tilt_deg) = written.plausible.as_ref().and_then(|p| p.largest_tilt_deg) else { return Ok(None) };
    if tilt_deg > 0.0 && tilt_deg < 90.0 {
        return Ok(Some(tilt_deg.to_radians()));
    }
    refuse(
        "plausible.largest_tilt_deg",
        format!(
            "found {tilt_deg}, expected above 0 and below 90, such as 60; leave it out to allow any tilt"
        ),
    )
}

pub(super) fn check_intervals(written: &as_written::JobFile) -> Result<IntervalSettings, JobRefusal> {
    let (profile, bootstrap) = written.intervals.as_ref().map_or((None, None), |i| (i.profile, i.bootstrap));
    // (a trace has the scatter of its segments, and a refit of it takes as long as a tenth of the search)
    let bootstrap = bootstrap.unwrap_or(if written.trace.is_empty() { REPLICATES } else { 0 });
    check_count(
        "intervals.bootstrap",
        bootstrap,
        0,
        MOST_REPLICATES,
        "fits to twins of the best model; 0 for none",
    )?;
    Ok(IntervalSettings { profile: profile.unwrap_or(true), bootstrap })
}

/// Budgets of the search for features; a job that fits traces needs none, because its search ends by itself.
pub(super) fn check_search(written: &as_written::JobFile) -> Result<SearchSettings, JobRefusal> {
    let traced = !written.trace.is_empty();
    let Some(search) = &written.search else {
        return match traced {
            true => Ok(default_search_settings(written.seed)),
            false => refuse(
                "search",
                "missing; without a [[trace]] expected [search] with `global_evaluations` and `local_evaluations`; add it",
            ),
        };
    };
    let particles = search.particles.unwrap_or(PARTICLES);
    check_count("search.particles", particles, 2, MOST_PARTICLES, "a cloud needs at least two")?;
    let starts = search.starts.unwrap_or(STARTS);
    check_count("search.starts", starts, 1, MOST_STARTS, "points from which a local search starts")?;
    Ok(SearchSettings {
        seed: written.seed,
        global_evaluations: check_global_evaluations(search, particles, traced)?,
        local_evaluations: check_local_evaluations(search, written.parameter.len(), traced)?,
        particles,
        stagnation_generations: search.stagnation_generations.unwrap_or(STAGNANT_GENERATIONS),
        starts,
    })
}

fn default_search_settings(seed: u64) -> SearchSettings {
    SearchSettings {
        seed,
        global_evaluations: 0,
        local_evaluations: 0,
        particles: PARTICLES,
        stagnation_generations: STAGNANT_GENERATIONS,
        starts: STARTS,
    }
}

fn check_global_evaluations(
    search: &as_written::JobSearchTable,
    particles: usize,
    traced: bool,
) -> Result<usize, JobRefusal> {
    let key = "search.global_evaluations";
    let Some(found) = search.global_evaluations else { return missing_budget(key, traced) };
    check_count(key, found, particles, MOST_EVALUATIONS, "the first generation takes one a particle")?;
    Ok(found)
}

fn check_local_evaluations(
    search: &as_written::JobSearchTable,
    dimensions: usize,
    traced: bool,
) -> Result<usize, JobRefusal> {
    let key = "search.local_evaluations";
    let Some(found) = search.local_evaluations else { return missing_budget(key, traced) };
    if found > MOST_EVALUATIONS || (found != 0 && found <= dimensions) {
        return refuse(
            key,
            format!(
                "found {found}, expected 0, or {} to {MOST_EVALUATIONS}: the first simplex takes one more than there are parameters",
                dimensions + 1
            ),
        );
    }
    Ok(found)
}

fn missing_budget(key: &str, traced: bool) -> Result<usize, JobRefusal> {
    if traced {
        return Ok(0);
    }
    refuse(key, "missing; a job without a [[trace]] needs this budget; add it")
}

fn check_count(key: &str, found: usize, least: usize, most: usize, why: &str) -> Result<(), JobRefusal> {
    if (least..=most).contains(&found) {
        return Ok(());
    }
    refuse(key, format!("found {found}, expected {least} to {most}: {why}"))
}
