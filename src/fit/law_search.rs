//! Fits other laws of friction to the recordings of a fit, and judges which of them the recordings support.
//!
//! The law of the scene is compared with the same law with two further terms, a limit at rest above the
//! friction of slip and a rise of friction with speed, and with the other laws that the job names. Each law
//! is fitted to the same frames, from the best end of the search. Laws are compared by the criterion of
//! Schwarz (Ann. Stat. 6 (1978) 461), which prefers the law with fewer parameters among laws that fit equally
//! well.

use super::job::{Job, is_same_quantity};
use super::journal::{Journal, StopReason};
use super::law::{LawCandidate, LawComparison, LawEstimate, LawVerdict, TERM_SEPARATOR};
use super::problem::Problem;
use super::result::ParameterResult;
use super::trace::{
    Iterate, SearchEnd, TraceDescent, TraceModel, TraceRecording, TraceSearchSettings, TraceUnknown,
    UnknownKind, Z_95, chi2_per_dof, follow_stages, outer_step, restart_search, start_stage,
};
use super::trace_run::{judge_descent, trace_verdict};
use crate::model::friction::{FrictionLaw, FrictionShape};
use crate::model::parameters::{find_parameter, name_if_in_recording, name_in_scene};
use crate::text::{format_trimmed, join_with_and};
use portable_math as math;
use std::collections::{BTreeMap, BTreeSet};

/// Difference of the criterion at which a law has lost: odds of 20 to 1. Kass and Raftery (J. Am. Stat.
/// Assoc. 90 (1995) 773) call this strong evidence.
const LOST_FROM: f64 = 6.0;
/// The same for a law that contains the chosen one: it must fit better, not only as well.
const LOST_FROM_IF_LARGER: f64 = 2.0;
/// Lowest and highest limit at rest, divided by the friction of slip. The search starts at the lowest. It is
/// above 1, because a release at a ratio of 1 is tangential, and its time has no derivative by the ratio.
const STATIC_RATIOS: [f64; 2] = [1.0001, 2.0];
/// Ratios at which further searches start, because the cost has a minimum of its own near a ratio of 1.
const FURTHER_RATIOS: [f64; 3] = [1.03, 1.1, 1.3];
/// A search ends after this number of steps in a row that lower the cost by less than `LEAST_GAIN` each. A
/// law has lost only if its cost is higher by much more.
const SMALL_STEPS: usize = 2;
const LEAST_GAIN: f64 = 0.1;
/// Highest rise of friction over the mean speed of the head, divided by the friction at zero speed.
const MAX_RISE: f64 = 2.0;
/// Range of a parameter of another law: the value that comes near the law of the scene, divided and
/// multiplied by this factor.
const RANGE_FACTOR: f64 = 30.0;
/// Range of the exponent of a Stribeck law.
const EXPONENTS: [f64; 2] = [0.25, 4.0];
/// Distance from the end of a range, in the coordinate of an unknown, within which an end of an interval
/// counts as at the end of the range.
const NEAR: f64 = 1e-9;
/// Smallest friction at zero speed that is a unit for other values.
const MIN_LIMIT: f64 = 0.01;

/// A law with its fit.
struct LawTrial {
    law: String,
    model: TraceModel,
    at: Iterate,
    explains: bool,
}

impl LawTrial {
    /// Whether the other law is this one with fixed values of some parameters.
    fn contains(&self, other: &Self) -> bool {
        let rest = self.law.strip_prefix(&*other.law);
        let [stribeck, exponential] = [FrictionShape::Stribeck, FrictionShape::Exponential];
        rest.is_some_and(|rest| rest.starts_with(TERM_SEPARATOR))
            || (self.law == stribeck.name() && other.law == exponential.name())
    }
}

/// A law that is compared with that of the scene: its name, its model, and whether its formula differs from
/// that of the scene.
struct RivalLaw {
    law: String,
    model: TraceModel,
    is_other_shape: bool,
}

impl Problem {
    /// Compares the law of the scenes with other laws. `end` is the best end of the search, and `explained`
    /// says whether it explains the recordings. `None` if no parameter of the law is free, if the scenes
    /// have different laws, if the job excludes the comparison, or if there is no other law.
    ///
    /// # Errors
    /// [`StopReason`] if the fit is to end.
    pub(super) fn compare_laws(
        &self,
        model: &TraceModel,
        end: &Iterate,
        explained: bool,
        journal: &mut Journal<'_>,
    ) -> Result<Option<LawComparison>, StopReason> {
        let named = self.job().laws.as_deref();
        let mut shapes = model.recordings.iter().map(|shoot| shoot.scene.linkage.friction.shape);
        let shape = shapes.next().filter(|first| shapes.all(|shape| shape == *first));
        let frees_law = self.job().parameters.iter().any(|free| free.name.starts_with("friction."));
        let Some(shape) = shape.filter(|_| frees_law && named != Some(&[])) else { return Ok(None) };
        let mut others: Vec<RivalLaw> = add_free_terms(model, self.job(), shape).into_iter().collect();
        let named = named.unwrap_or_default().iter().filter(|other| **other != shape);
        others.extend(named.filter_map(|other| change_shape(model, end, shape, *other)));
        let mut trials = vec![LawTrial {
            law: shape.name().to_owned(),
            model: model.clone(),
            at: end.clone(),
            explains: explained,
        }];
        for other in others {
            let mut check_stop = || journal.announce(format!("fitting friction with the law {}", other.law));
            check_stop()?;
            trials.extend(self.fit_law(&other, model, end, explained, &mut check_stop)?);
        }
        if trials.len() == 1 {
            return Ok(None);
        }
        let chi2 = |trial: &&LawTrial| chi2_per_dof(&trial.model, &trial.at).0;
        let best =
            trials[1..].iter().filter(|trial| trial.explains).min_by(|a, b| chi2(a).total_cmp(&chi2(b)));
        if let Some(best) = best.filter(|_| !explained) {
            // the search may have missed the minimum of the law of the scene
            let point = model.unknowns.carry_point(&end.point, &best.model.unknowns, &best.at.point);
            let mut check_stop = || journal.announce("comparing laws of friction".to_owned());
            if let Some(at) = search_on_segments(model, &best.at, &[point], &mut check_stop)? {
                let descent = TraceDescent { start: 0, stages: vec![at.clone()], iterates: 1 };
                if judge_descent(self, model, &descent).is_some_and(|misfit| misfit.explained) {
                    (trials[0].at, trials[0].explains) = (at, true);
                }
            }
        }
        if !explained {
            compare_on_same_segments(&mut trials, &mut || {
                journal.announce("comparing laws of friction".to_owned())
            })?;
        }
        Ok(Some(self.judge_laws(&trials)))
    }

    /// Fits a law; `None` if no scene accepts it.
    fn fit_law(
        &self,
        RivalLaw { law, model, is_other_shape }: &RivalLaw,
        from: &TraceModel,
        end: &Iterate,
        explained: bool,
        check_stop: &mut dyn FnMut() -> Result<(), StopReason>,
    ) -> Result<Option<LawTrial>, StopReason> {
        let settings = TraceSearchSettings::without_twins(self.segment_s().to_vec());
        let starts: Vec<f64> = model.unknowns.0.iter().map(|unknown| unknown.start).collect();
        let near = model.unknowns.carry_point(&starts, &from.unknowns, &end.point);
        let (mut points, mut stages) = (vec![near], Vec::new());
        if !explained || *is_other_shape {
            let start = if explained { &points[0] } else { &starts };
            let first = start_stage(model, &settings, (0, false), start, &[]);
            let descent =
                first.map(|first| follow_stages(model, &settings, first, check_stop)).transpose()?;
            points.extend(descent.iter().filter_map(|descent| Some(descent.last_iterate()?.point.clone())));
            stages = descent.filter(|_| !explained).map_or_else(Vec::new, |descent| descent.stages);
        }
        let at_rest = model.unknowns.position("friction.static_ratio").filter(|_| !is_other_shape);
        for point in points.clone() {
            points.extend(at_rest.iter().flat_map(|&at_rest| {
                let unknown = &model.unknowns.0[at_rest];
                let places = FURTHER_RATIOS.map(|ratio| unknown.coordinate(ratio));
                let inside = places.into_iter().filter(|z| (unknown.range[0]..=unknown.range[1]).contains(z));
                let points = inside.map(|z| {
                    let mut point = point.clone();
                    point[at_rest] = z;
                    point
                });
                points.collect::<Vec<_>>()
            }));
        }
        let of_frames = stages.last().unwrap_or(end).clone();
        let Some(at) = search_on_segments(model, &of_frames, &points, check_stop)? else { return Ok(None) };
        let is_last = at.stage + 1 == settings.segment_s.len();
        let rest = if is_last { vec![at] } else { follow_stages(model, &settings, at, check_stop)?.stages };
        stages.retain(|before| rest.iter().all(|after| after.stage != before.stage));
        stages.extend(rest);
        let Some(at) = stages.last().cloned() else { return Ok(None) };
        if !at.cost.is_finite() {
            return Ok(None);
        }
        let misfit = judge_descent(self, model, &TraceDescent { start: 0, stages, iterates: 1 });
        let is_last = at.stage + 1 == settings.segment_s.len();
        let explains =
            (explained && at.cost <= end.cost) || is_last && misfit.is_some_and(|misfit| misfit.explained);
        Ok(Some(LawTrial { law: law.clone(), model: model.clone(), at, explains }))
    }
}

/// Fits the laws that explain the recordings to the segments of the one with the lowest chi2, so that their
/// costs can be compared.
fn compare_on_same_segments(
    trials: &mut [LawTrial],
    check_stop: &mut dyn FnMut() -> Result<(), StopReason>,
) -> Result<(), StopReason> {
    let chi2 = |trial: &&LawTrial| chi2_per_dof(&trial.model, &trial.at).0;
    let best = trials.iter().filter(|trial| trial.explains).min_by(|a, b| chi2(a).total_cmp(&chi2(b)));
    let Some((anchor, unknowns)) = best.map(|best| (best.at.clone(), best.model.unknowns.clone())) else {
        return Ok(());
    };
    for trial in trials.iter_mut().filter(|trial| trial.explains && trial.at != anchor) {
        let own = trial.at.point.clone();
        // the same law beside the constants of the best law
        let beside = trial.model.unknowns.carry_point(&own, &unknowns, &anchor.point);
        if let Some(at) = search_on_segments(&trial.model, &anchor, &[own, beside], check_stop)? {
            trial.at = at;
        }
    }
    Ok(())
}

/// The end of a search with plain chi2 on the segments of `end`, from the point of `points` with the lowest
/// cost. `None` if a scene refuses all points.
fn search_on_segments(
    model: &TraceModel,
    end: &Iterate,
    points: &[Vec<f64>],
    check_stop: &mut dyn FnMut() -> Result<(), StopReason>,
) -> Result<Option<Iterate>, StopReason> {
    let begun = points.iter().filter_map(|point| restart_search(model, end, point.clone()));
    let Some(mut at) = begun.min_by(|a, b| a.cost.total_cmp(&b.cost)) else { return Ok(None) };
    let mut small = 0;
    while !at.settled && small < SMALL_STEPS {
        check_stop()?;
        let next = outer_step(model, &at, false);
        small = if at.cost - next.cost < LEAST_GAIN { small + 1 } else { 0 };
        at = next;
    }
    Ok(Some(at))
}

// Models with other laws.

/// The model with a limit at rest above the friction of slip, and with a rise of friction with speed, both
/// free; `None` if the job frees both.
fn add_free_terms(model: &TraceModel, job: &Job, shape: FrictionShape) -> Option<RivalLaw> {
    let scene = &model.recordings.first()?.scene;
    let limit = scene.linkage.friction.nearest_value("friction.limit_at_zero")?;
    let highest_s_per_m = MAX_RISE * limit.max(MIN_LIMIT) / travel_speed_m_per_s(model);
    let terms =
        [("friction.static_ratio", STATIC_RATIOS), ("friction.viscous_s_per_m", [0.0, highest_s_per_m])];
    let is_free = |name: &str| job.parameters.iter().any(|free| is_same_quantity(&free.name, name));
    let value = |shoot: &TraceRecording, name: &str| shoot.scene.value(name);
    // a value that differs between the recordings is a condition, not a term
    let is_shared =
        |name: &str| model.recordings.windows(2).all(|pair| value(&pair[0], name) == value(&pair[1], name));
    let mut changed = model.clone();
    let mut names = Vec::new();
    for (name, [lowest, highest]) in terms.into_iter().filter(|(name, _)| !is_free(name) && is_shared(name)) {
        let start = scene.value(name).map_or(lowest, |value| value.max(lowest));
        let highest = highest.max(2.0 * start);
        let unit = highest - lowest;
        let kind = UnknownKind::Parameter { name: name.to_owned(), unit: Some(unit) };
        let range = [lowest / unit, highest / unit];
        let unknown = TraceUnknown { kind, range, prior: None, start: start / unit };
        changed.unknowns.0.insert(job.parameters.len(), unknown);
        names.push(name.trim_start_matches("friction.").to_owned());
    }
    let law = format!("{}{TERM_SEPARATOR}{}", shape.name(), join_with_and(&names));
    (!names.is_empty()).then_some(RivalLaw { law, model: changed, is_other_shape: false })
}

/// The model with another law of friction, whose parameters are all free. The search starts near the law
/// at `end`.
fn change_shape(
    model: &TraceModel,
    end: &Iterate,
    old: FrictionShape,
    shape: FrictionShape,
) -> Option<RivalLaw> {
    let mut changed = model.clone();
    let is_own = |unknown: &TraceUnknown| match &unknown.kind {
        UnknownKind::Parameter { name, .. } => old.own_parameters().contains(&name_in_scene(name)),
        UnknownKind::Camera { .. } => false,
    };
    let mut suffixes = BTreeSet::new();
    for (unknown, z) in model.unknowns.0.iter().zip(&end.point).filter(|(unknown, _)| is_own(unknown)) {
        let UnknownKind::Parameter { name, .. } = &unknown.kind else { continue };
        suffixes.insert(&name[name_in_scene(name).len()..]);
        for shoot in &mut changed.recordings {
            if let Some(key) = name_if_in_recording(name, shoot.condition) {
                shoot.scene = shoot.scene.with_parameter(key, unknown.value(*z)).ok()?;
            }
        }
    }
    match suffixes.len() {
        // the parameters of a table are its points
        0 => suffixes.insert(""),
        1 => true,
        _ => suffixes.remove(""),
    };
    changed.unknowns.0.retain(|unknown| !is_own(unknown));
    let mut found = Vec::new();
    for suffix in suffixes {
        for key in shape.own_parameters() {
            let name = format!("{key}{suffix}");
            let shoot = changed
                .recordings
                .iter()
                .find(|shoot| name_if_in_recording(&name, shoot.condition).is_some())?;
            found.push(make_law_unknown(name, &shoot.scene.linkage.friction, travel_speed_m_per_s(model)));
        }
    }
    for shoot in &mut changed.recordings {
        shoot.scene = shoot.scene.with_friction_shape(shape).ok()?;
    }
    changed.unknowns.0.splice(0..0, found);
    Some(RivalLaw { law: shape.name().to_owned(), model: changed, is_other_shape: true })
}

/// An unknown of a law, near the value in `law`.
fn make_law_unknown(name: String, law: &FrictionLaw, speed_m_per_s: f64) -> TraceUnknown {
    let key = name_in_scene(&name);
    let is_exponent = key == "friction.stribeck_exponent";
    let near = law.nearest_value(key).filter(|value| value.is_finite() && *value > 0.0);
    if is_exponent {
        let unit = EXPONENTS[1] - EXPONENTS[0];
        let start = near.unwrap_or(1.0).clamp(EXPONENTS[0], EXPONENTS[1]) / unit;
        let kind = UnknownKind::Parameter { name, unit: Some(unit) };
        return TraceUnknown { kind, range: EXPONENTS.map(|end| end / unit), prior: None, start };
    }
    let usual = match find_parameter(key).map_or("", |row| row.unit) {
        "m/s" => speed_m_per_s,
        "s/m" => 1.0 / speed_m_per_s,
        _ => 0.5 * law.limit_at_zero(1.0).max(MIN_LIMIT),
    };
    let start = math::ln(near.unwrap_or(usual));
    let far = math::ln(RANGE_FACTOR);
    let kind = UnknownKind::Parameter { name, unit: None };
    TraceUnknown { kind, range: [start - far, start + far], prior: None, start }
}

/// Largest travel of a head, divided by the time of its film, m/s.
fn travel_speed_m_per_s(model: &TraceModel) -> f64 {
    /// Lower limit, m/s: a slow rig.
    const SLOWEST: f64 = 1e-4;
    let speed = |shoot: &TraceRecording| {
        let [first, last] = shoot.observation.settings.frames;
        shoot.observation.head_travel_m * shoot.observation.rate_hz / (last - first).max(1) as f64
    };
    model.recordings.iter().map(speed).fold(SLOWEST, f64::max)
}

// Verdict.

impl Problem {
    /// Judges laws that were fitted; the first is that of the scene.
    fn judge_laws(&self, trials: &[LawTrial]) -> LawComparison {
        let settings = TraceSearchSettings::without_twins(self.segment_s().to_vec());
        let seed = self.job().search.seed;
        let ends: Vec<Option<SearchEnd<'_>>> =
            trials.iter().map(|trial| SearchEnd::new(&trial.model, &settings, seed, &trial.at)).collect();
        // the unit of the cost is that of the law that fits best
        let explaining = || trials.iter().zip(&ends).filter(|(trial, _)| trial.explains);
        let least = explaining().min_by(|a, b| a.0.at.cost.total_cmp(&b.0.at.cost));
        let unit = least.and_then(|(_, end)| end.as_ref()).map_or(1.0, SearchEnd::cost_unit);
        let criterion = |trial: &LawTrial| {
            let parameters = trial.model.unknowns.parameters().count() as f64;
            let dof = chi2_per_dof(&trial.model, &trial.at).1;
            trial.at.cost / unit + parameters * math::ln(dof as f64)
        };
        let chosen = explaining().map(|(trial, _)| trial);
        let chosen = chosen.min_by(|a, b| criterion(a).total_cmp(&criterion(b)));
        let is_possible = |trial: &LawTrial, chosen: &LawTrial| {
            let rise = criterion(trial) - criterion(chosen);
            match () {
                () if trial.contains(chosen) => rise < LOST_FROM_IF_LARGER,
                () if chosen.contains(trial) => rise < LOST_FROM,
                // fewer parameters are no evidence between laws of which neither contains the other
                () => rise.min((trial.at.cost - chosen.at.cost) / unit) < LOST_FROM,
            }
        };
        let candidate = |(trial, end): (&LawTrial, &Option<SearchEnd<'_>>)| LawCandidate {
            law: trial.law.clone(),
            explains: trial.explains,
            chi2_per_dof: chi2_per_dof(&trial.model, &trial.at).0,
            criterion: chosen.filter(|_| trial.explains).map(|chosen| criterion(trial) - criterion(chosen)),
            possible: trial.explains && chosen.is_some_and(|chosen| is_possible(trial, chosen)),
            parameters: self.list_estimates(trial, end.as_ref()),
        };
        LawComparison::judge(trials.iter().zip(&ends).map(candidate).collect())
    }

    /// Estimates of the free parameters of a law, and the nearest values of the parameters of the job that it
    /// lacks.
    fn list_estimates(&self, trial: &LawTrial, end: Option<&SearchEnd<'_>>) -> BTreeMap<String, LawEstimate> {
        let model = &trial.model;
        let mut found = BTreeMap::new();
        for i in model.unknowns.parameters().filter(|&i| !model.unknowns.is_constant(i)) {
            let (unknown, z) = (&model.unknowns.0[i], trial.at.point[i]);
            let UnknownKind::Parameter { name, .. } = &unknown.kind else { continue };
            let [lower, upper] = unknown.range;
            let far = end.map(|end| Z_95 * end.sd[i]).filter(|far| far.is_finite());
            let inside = |end: &f64| (lower + NEAR..=upper - NEAR).contains(end);
            let at = |side: f64| Some(z + side * far?).filter(inside).map(|end| unknown.value(end));
            let estimate = LawEstimate {
                estimate: unknown.value(z),
                sd: far.map(|far| unknown.slope(z) * far / Z_95),
                lower_95: at(-1.0),
                upper_95: at(1.0),
            };
            found.insert(name.clone(), estimate);
        }
        // another formula has no value of `A`, `B` and `C`
        let has_values = |shoot: &&TraceRecording| {
            let shape = shoot.scene.linkage.friction.shape;
            matches!(shape, FrictionShape::Exponential | FrictionShape::Stribeck)
        };
        for free in &self.job().parameters {
            let of_recording = |film: usize| {
                let shoot = model.recordings.get(film).filter(has_values)?;
                let key = name_if_in_recording(&free.name, shoot.condition)?;
                model.unknowns.scene_at(shoot, film, &trial.at.point)?.linkage.friction.nearest_value(key)
            };
            let Some(estimate) = (0..model.recordings.len()).find_map(of_recording) else { continue };
            let nearest = LawEstimate { estimate, sd: None, lower_95: None, upper_95: None };
            found.entry(free.name.clone()).or_insert(nearest);
        }
        found
    }
}

impl LawComparison {
    /// Takes back the verdicts that do not hold with every possible law, and widens the intervals so that
    /// they contain the estimates with these laws.
    pub(super) fn limit_verdicts(&self, job: &Job, parameters: &mut BTreeMap<String, ParameterResult>) {
        let Some((own, others)) = self.candidates.split_first() else { return };
        if self.verdict == LawVerdict::NoneExplains {
            return;
        }
        for free in &job.parameters {
            let Some(found) = parameters.get_mut(&free.name) else { continue };
            if !own.possible {
                let possible: Vec<String> =
                    others.iter().filter(|other| other.possible).map(LawCandidate::describe).collect();
                found.reasons.push(format!("the recording supports {} instead", possible.join(" or ")));
            }
            for other in others.iter().filter(|other| own.possible && other.possible) {
                let Some(with_law) = other.parameters.get(&free.name) else {
                    found
                        .reasons
                        .push(format!("{} is possible too, and has no such parameter", other.describe()));
                    continue;
                };
                let sd = own.parameters.get(&free.name).and_then(|own| own.sd).unwrap_or(0.0);
                if !with_law.departs_from(found.estimate, sd) {
                    continue;
                }
                // an end that the other law leaves open is open
                let end =
                    |end: Option<f64>| if with_law.sd.is_some() { end } else { Some(with_law.estimate) };
                let (low, high) = (end(with_law.lower_95), end(with_law.upper_95));
                let (lower, upper) = (free.bounds.lower(), free.bounds.upper());
                found.lower_95 = found.lower_95.zip(low).map(|(a, b)| a.min(b)).filter(|end| *end > lower);
                found.upper_95 = found.upper_95.zip(high).map(|(a, b)| a.max(b)).filter(|end| *end < upper);
                let value = format_trimmed(with_law.estimate, 3);
                found.reasons.push(format!("{} is possible too and gives {value}", other.describe()));
            }
            found.verdict = trace_verdict(free, found);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::law::tests::judge;
    use crate::fit::uncertainty::ParameterVerdict;

    /// A parameter stays identified if no possible law moves it by more than a standard deviation. Otherwise
    /// its interval contains the estimates with all possible laws.
    #[test]
    fn a_possible_law_takes_back_only_what_it_moves() {
        let job = Job::parse(
            "job.toml",
            "format = 1\ntitle = \"t\"\nscene = \"s.toml\"\nseed = 1\n[[recording]]\npath = \"r\"\n\
             [[parameter]]\nname = \"friction.a\"\nlower = 0.05\nupper = 2.0\nscale = \"log\"\n\
             [[parameter]]\nname = \"friction.c\"\nlower = 0.05\nupper = 2.0\nscale = \"log\"\n[[trace]]\n",
        );
        let job = job.unwrap();
        let verdicts = |own, other| {
            let result = |estimate: f64| ParameterResult {
                estimate,
                lower_95: Some(estimate - 0.1),
                upper_95: Some(estimate + 0.1),
                verdict: ParameterVerdict::Identified,
                ..ParameterResult::default()
            };
            let mut found: BTreeMap<String, ParameterResult> = [("friction.a", 0.5), ("friction.c", 0.3)]
                .map(|(name, z)| (name.to_owned(), result(z)))
                .into();
            judge(own, other).limit_verdicts(&job, &mut found);
            found
        };
        use ParameterVerdict::{Identified, NotIdentified};
        let all =
            |found: &BTreeMap<String, ParameterResult>| found.values().map(|p| p.verdict).collect::<Vec<_>>();
        assert_eq!(all(&verdicts(Some(0.0), Some(9.0))), [Identified; 2]);
        assert_eq!(all(&verdicts(Some(9.0), Some(0.0))), [NotIdentified; 2]);
        let both = verdicts(Some(0.0), Some(3.0));
        assert_eq!(all(&both), [NotIdentified, Identified]);
        let a = &both["friction.a"];
        assert_eq!(a.lower_95, Some(0.4));
        assert!((a.upper_95.unwrap() - (0.8 + 0.1 * Z_95)).abs() < 1e-12);
        assert!(a.reasons[0].ends_with("is possible too and gives 0.8"), "{:?}", a.reasons);
    }
}
