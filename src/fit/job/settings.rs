//! Tables of a job that set how the fit is computed: ensemble, camera, plausibility, search and intervals.

use super::checks::find_repeated;
use super::{KeyRefusal, as_written, check_above_zero};
use crate::fit::search::{STAGNANT_GENERATIONS, SearchSettings};
use crate::fit::trace::MAX_TWINS as MOST_REPLICATES;
use crate::model::friction::FrictionShape;
use crate::simulate::twin::Camera;
use crate::text::join_with_and;
use crate::toml_file::suggest_key;
use serde::Serialize;

/// Default number of points in a cloud: a few points for each of up to six parameters, and a multiple of
/// common numbers of processor cores.
pub(super) const PARTICLES: usize = 24;
/// Default number of local searches: known cases have two or three basins of the cost, and several starts may
/// be in the same basin.
pub(super) const STARTS: usize = 6;
/// Maximum number of local searches; with more, each search would get too few of the evaluations, which all
/// searches share.
const MOST_STARTS: usize = 64;
/// Maximum number of evaluations in a stage. The limit bounds the memory; a run with so many evaluations
/// would take weeks.
const MOST_EVALUATIONS: usize = 10_000_000;
/// Maximum number of starting states in an ensemble. Eight states reduce the error of a friction coefficient
/// from 20 % to 1-3 %, and each state needs a run of the model.
const MOST_MEMBERS: usize = 64;
/// Default relative spread of the starting state: the relative error of a state that is guessed from a
/// recording.
const SPREAD: f64 = 0.1;
/// Maximum number of points in a cloud; a thousand points are enough for many parameters.
const MOST_PARTICLES: usize = 10_000;
/// Maximum number of entries of one kind. A page and its figures have room for tens of entries; a job with
/// more than a thousand must be a mistake of the program that wrote it.
const MOST_ENTRIES: usize = 1000;
/// Default number of fits to twins of the best model: forty fits give a standard deviation that is accurate
/// to about a tenth.
const REPLICATES: usize = 40;

/// Ensemble of starting states over which features are averaged.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Ensemble {
    /// Number of starting states, at least 1. With 1, only the starting state of the scene is used.
    pub members: usize,
    /// Relative spread of the starting states, above 0 and at most 1.
    pub spread: f64,
}

/// Methods by which intervals are computed, in addition to the linear model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IntervalSettings {
    /// Whether profiles of the cost are computed.
    pub profile: bool,
    /// Number of fits to twins of the best model; 0 for none.
    pub bootstrap: usize,
}

/// Refuses a job with too many entries, before they are compared with each other.
pub(super) fn check_counts(written: &as_written::JobFile) -> Result<(), KeyRefusal> {
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

/// The laws of friction that are compared with that of the scene.
pub(super) fn check_laws(written: &as_written::JobFile) -> Result<Option<Vec<FrictionShape>>, KeyRefusal> {
    const FORMS: [&str; 3] = ["exponential", "stribeck", "rational"];
    let Some(names) = &written.laws else { return Ok(None) };
    if written.trace.is_empty() {
        refuse!("laws", "found without a [[trace]]; features do not tell laws apart: remove `laws`");
    }
    if !names.is_empty() && !written.parameter.iter().any(|free| free.name.starts_with("friction.")) {
        refuse!(
            "laws",
            "found without a free parameter of friction; add one as [[parameter]], or remove `laws`"
        );
    }
    if let Some(name) = find_repeated(names.iter().map(String::as_str)) {
        refuse!("laws", "found \"{name}\" twice; remove one of them");
    }
    let law = |name: &String| match FrictionShape::from_name(name) {
        Some(law) => Ok(law),
        None if name == "table" => {
            refuse!(
                "laws",
                "found \"table\", whose points are no parameters; expected {}",
                join_with_and(&FORMS.map(|form| format!("\"{form}\"")))
            )
        }
        None => refuse!("laws", "found \"{name}\"; {}", suggest_key(name, &FORMS)),
    };
    names.iter().map(law).collect::<Result<_, _>>().map(Some)
}

pub(super) fn check_camera_table(written: &as_written::JobFile) -> Result<Option<Camera>, KeyRefusal> {
    let needed = written.recording.is_empty() || !written.condition.is_empty();
    match (&written.camera, needed) {
        (Some(camera), true) => check_camera(camera).map(Some),
        (None, false) => Ok(None),
        (Some(_), false) => {
            refuse!("camera", "found with a [[recording]], which has its own camera; remove [camera]")
        }
        (None, true) => refuse!(
            "camera",
            "missing; expected [camera] with `frame_rate_hz` and `exposure_s`, because there is a [[condition]], or no [[recording]] that has its own; add it"
        ),
    }
}

fn check_camera(camera: &Camera) -> Result<Camera, KeyRefusal> {
    let frame_rate_hz = check_above_zero("camera.frame_rate_hz", camera.frame_rate_hz)?;
    let exposure_s = camera.exposure_s;
    if !(exposure_s >= 0.0 && exposure_s * frame_rate_hz <= 1.0) {
        refuse!("camera.exposure_s", "found {exposure_s}, expected 0 to {} (one frame)", 1.0 / frame_rate_hz);
    }
    Ok(Camera { frame_rate_hz, exposure_s })
}

pub(super) fn check_ensemble(written: &as_written::JobFile) -> Result<Ensemble, KeyRefusal> {
    let (members, spread) = written.ensemble.as_ref().map_or((None, None), |e| (e.members, e.spread));
    let (members, spread) = (members.unwrap_or(1), spread.unwrap_or(SPREAD));
    check_count("ensemble.members", members, 1, MOST_MEMBERS, "starting states that are averaged over")?;
    if !(spread > 0.0 && spread <= 1.0) {
        refuse!(
            "ensemble.spread",
            "found {spread}, expected above 0 and at most 1: 0.1 spreads the starting state by 10 %"
        );
    }
    Ok(Ensemble { members, spread })
}

pub(super) fn check_largest_tilt_rad(written: &as_written::JobFile) -> Result<Option<f64>, KeyRefusal> {
    let Some(tilt_deg) = written.plausible.as_ref().and_then(|p| p.largest_tilt_deg) else { return Ok(None) };
    if tilt_deg > 0.0 && tilt_deg < 90.0 {
        return Ok(Some(tilt_deg.to_radians()));
    }
    refuse!(
        "plausible.largest_tilt_deg",
        "found {tilt_deg}, expected above 0 and below 90, such as 60; leave it out to allow any tilt"
    )
}

pub(super) fn check_intervals(written: &as_written::JobFile) -> Result<IntervalSettings, KeyRefusal> {
    let (profile, bootstrap) = written.intervals.as_ref().map_or((None, None), |i| (i.profile, i.bootstrap));
    // a trace fit already has intervals from the scatter of its segments, and each refit takes a tenth of the
    // time of the search
    let bootstrap = bootstrap.unwrap_or(if written.trace.is_empty() { REPLICATES } else { 0 });
    let why = "fits to twins of the best model; 0 for none";
    check_count("intervals.bootstrap", bootstrap, 0, MOST_REPLICATES, why)?;
    Ok(IntervalSettings { profile: profile.unwrap_or(true), bootstrap })
}

/// Checks the budgets of a search on features. A job with traces needs no budgets, because its search ends by
/// itself.
pub(super) fn check_search(written: &as_written::JobFile) -> Result<SearchSettings, KeyRefusal> {
    let traced = !written.trace.is_empty();
    if written.search.is_none() && !traced {
        refuse!(
            "search",
            "missing; without a [[trace]] expected [search] with `global_evaluations` and `local_evaluations`; add it"
        );
    }
    let usual = as_written::JobSearchTable::default();
    let search = written.search.as_ref().unwrap_or(&usual);
    let particles = search.particles.unwrap_or(PARTICLES);
    check_count("search.particles", particles, 2, MOST_PARTICLES, "a cloud needs at least two")?;
    let starts = search.starts.unwrap_or(STARTS);
    check_count("search.starts", starts, 1, MOST_STARTS, "points from which a local search starts")?;
    let required = |key: &str, found: Option<usize>| match found {
        None if !traced => refuse!(key, "missing; a job without a [[trace]] needs this budget; add it"),
        found => Ok(found),
    };
    let key = "search.global_evaluations";
    let global = required(key, search.global_evaluations)?;
    if let Some(found) = global {
        check_count(key, found, particles, MOST_EVALUATIONS, "the first generation takes one a particle")?;
    }
    let key = "search.local_evaluations";
    let local = required(key, search.local_evaluations)?.unwrap_or(0);
    let least = written.parameter.len() + 1;
    if local > MOST_EVALUATIONS || (local != 0 && local < least) {
        refuse!(
            key,
            "found {local}, expected 0, or {least} to {MOST_EVALUATIONS}: the first simplex takes one more than there are parameters"
        );
    }
    Ok(SearchSettings {
        seed: written.seed,
        global_evaluations: global.unwrap_or(0),
        local_evaluations: local,
        particles,
        stagnation_generations: search.stagnation_generations.unwrap_or(STAGNANT_GENERATIONS),
        starts,
    })
}

fn check_count(key: &str, found: usize, least: usize, most: usize, why: &str) -> Result<(), KeyRefusal> {
    if (least..=most).contains(&found) {
        return Ok(());
    }
    refuse!(key, "found {found}, expected {least} to {most}: {why}")
}
