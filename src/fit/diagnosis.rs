//! Diagnosis of recordings that a trace fit does not explain.
//!
//! Usual errors of a recording or a scene are tried as hypotheses: each is removed, and the changed problem
//! is fitted on a few short segments. The best hypotheses are fitted to the whole recordings and judged like
//! a fit.

mod hypothesis;
mod lost_frames;

use super::findings::{FindingSource, FitFinding};
use super::journal::Journal;
use super::misfit::{StageMisfit, TraceMisfit};
use super::problem::Problem;
use super::trace::{
    Iterate, SegmentState, TraceDescent, TraceModel, TraceSearchSettings, UnknownKind, chi2_per_dof,
    follow_stages, outer_step, start_point, start_stage, trace_covariance,
};
use super::trace_run::judge_descent;
use crate::recording::Recording;
use crate::recording::channel::ReversalInstants;
use crate::recording::quality::{Optics, Severity, collect_findings, measure_quality};
use crate::text::format_trimmed;
use hypothesis::{Hypothesis, scene_value};
use portable_math as math;
use rayon::prelude::*;
use std::sync::Arc;

/// Number of segments on which all hypotheses are tried.
const TRIED_SEGMENTS: usize = 12;
/// Number of steps of all hypotheses, and of further steps of the better ones.
const STEPS: [usize; 2] = [4, 12];
/// Number of hypotheses that are followed with more steps, with long segments, with a search for their
/// number, and with all segments.
const FOLLOWED: [usize; 4] = [16, 7, 5, 3];
/// Number of hypotheses that are followed further although they differ only in their number.
const SAME_KIND: usize = 3;
/// Number of steps at each number of a hypothesis whose number is searched for.
const SEARCH_STEPS: usize = 6;
/// A hypothesis is followed if its cost per degree of freedom is below this fraction of the cost without a
/// change.
const BETTER: f64 = 0.9;
/// If the lowest cost per degree of freedom is below this value, hypotheses are followed only if their cost
/// is below [`WORSE`] times the lowest.
const NEAR_NOISE: f64 = 2.0;
const WORSE: f64 = 3.0;
/// A hypothesis that explains nothing is reported if it divides chi2 per degree of freedom by this factor.
const MARKEDLY: f64 = 2.0;

/// A problem with the end of a stage of its search, which does not explain the recordings.
struct FailedFit<'a> {
    problem: &'a Problem,
    model: &'a TraceModel,
    end: &'a Iterate,
    /// Stage whose segments the hypotheses are tried on.
    stage: usize,
}

/// Findings on recordings that the fit does not explain: those of the recordings alone, the evidence against
/// the model, and hypotheses that explain or nearly explain them. `descent` is the best descent of the
/// search, and `misfit` its misfit. `None` if the fit was interrupted.
pub(super) fn diagnose_misfit(
    problem: &Problem,
    model: &TraceModel,
    descent: &TraceDescent,
    misfit: &TraceMisfit,
    journal: &mut Journal<'_>,
) -> Option<Vec<FitFinding>> {
    let mut findings: Vec<FitFinding> =
        problem.recordings().iter().flatten().flat_map(recording_findings).collect();
    let reasons = misfit.reasons.iter().cloned();
    findings.extend(reasons.map(|reason| FitFinding::new(FindingSource::Misfit, reason)));
    let stage = first_failed_stage(&misfit.stages);
    if let Some(end) = descent.stages.get(stage) {
        let mut problem = problem.clone();
        for (traced, shoot) in problem.traces.iter_mut().zip(&model.recordings) {
            traced.noise = Some(Arc::clone(&shoot.noise));
        }
        let failed = FailedFit { problem: &problem, model, end, stage };
        findings.extend(failed.try_hypotheses(misfit, journal)?);
    }
    Some(findings)
}

/// Findings of a caution or worse that follow from the recording alone.
fn recording_findings(recording: &Recording) -> Vec<FitFinding> {
    let (quality, instants) = (measure_quality(recording, None), ReversalInstants::find_instants(recording));
    let all = collect_findings(recording, &quality, &Optics::default(), &instants, &[]);
    let grave = all.into_iter().filter(|finding| finding.severity >= Severity::Caution);
    let words = grave.map(|finding| format!("`{}`: {}", recording.name(), finding.to_line()));
    words.map(|words| FitFinding::new(FindingSource::Recording, words)).collect()
}

/// Index of the first stage with a large misfit, whose parameters may be far off; if there is none, of the
/// last stage, in which a small misfit is largest.
fn first_failed_stage(stages: &[StageMisfit]) -> usize {
    /// Chi2 per degree of freedom of a large misfit.
    const LARGE: f64 = 1.5;
    let fails = |stage: &StageMisfit| {
        let is_large = stage.chi2_per_dof.is_nan() || stage.chi2_per_dof >= LARGE;
        is_large || 4 * stage.bad_segments > stage.segments
    };
    stages.iter().position(fails).unwrap_or(stages.len().saturating_sub(1))
}

/// A changed problem with an iterate of its search.
struct TriedProblem {
    problem: Problem,
    model: TraceModel,
    at: Iterate,
    /// Length of the segments, s.
    length_s: f64,
}

impl TriedProblem {
    fn make_steps(&mut self, steps: usize) {
        for _ in 0..steps {
            if self.at.settled {
                break;
            }
            self.at = outer_step(&self.model, &self.at, false);
        }
    }
}

/// Settings for the segments on which hypotheses are tried.
fn tried_settings(length_s: f64) -> TraceSearchSettings {
    TraceSearchSettings {
        max_segments: Some(TRIED_SEGMENTS),
        ..TraceSearchSettings::without_twins(vec![length_s])
    }
}

/// A hypothesis with its changed problems.
struct TriedHypothesis {
    hypothesis: Hypothesis,
    parts: Vec<TriedProblem>,
    /// Number that the search for it has found: its coordinate and the standard deviation of this coordinate.
    found: Option<[f64; 2]>,
}

/// A hypothesis that was fitted to all segments.
struct FittedHypothesis {
    trial: TriedHypothesis,
    misfits: Vec<TraceMisfit>,
    ends: Vec<Iterate>,
}

impl TriedHypothesis {
    /// The first iterate of a hypothesis, on segments of the stage at which the fit failed: the better of the
    /// starts in the middle of the bounds (only in the first stage) and at the end of the fit, if this is not
    /// junk.
    fn begin_search(hypothesis: Hypothesis, failed: &FailedFit<'_>) -> Option<Self> {
        let same_frames = hypothesis != Hypothesis::LostFrames;
        let changed = hypothesis.change_problem(failed.problem);
        let part = |problem: Problem| {
            let model = problem.trace_model()?.ok()?;
            let length_s = problem.segment_s()[failed.stage.min(problem.segment_s().len() - 1)];
            let settings = tried_settings(length_s);
            let middle = start_point(&model, problem.job().search.seed, 0);
            let mut starts: Vec<(Vec<f64>, &[SegmentState])> = Vec::new();
            if !failed.end.is_junk(failed.model) {
                let before = if same_frames && failed.stage > 0 { &failed.end.segments[..] } else { &[] };
                starts.push((
                    model.unknowns.carry_point(&middle, &failed.model.unknowns, &failed.end.point),
                    before,
                ));
            }
            if failed.stage == 0 || failed.end.is_junk(failed.model) {
                starts.push((middle, &[]));
            }
            let iterates = starts
                .iter()
                .filter_map(|(point, before)| start_stage(&model, &settings, (0, false), point, before));
            let at = iterates.min_by(|a, b| a.cost.total_cmp(&b.cost))?;
            (!at.segments.is_empty()).then_some(TriedProblem { problem, model, at, length_s })
        };
        let parts: Vec<TriedProblem> = changed.into_iter().map(part).collect::<Option<_>>()?;
        (!parts.is_empty()).then_some(Self { hypothesis, parts, found: None })
    }

    /// The same hypothesis with another number, from the end of this trial, on segments with as many frames.
    fn change_number(&self, coordinate: f64, failed: &FailedFit<'_>) -> Option<Self> {
        let hypothesis = self.hypothesis.with_coordinate(coordinate, failed.problem);
        let changed = hypothesis.change_problem(failed.problem);
        let part = |(problem, from): (Problem, &TriedProblem)| {
            let model = problem.trace_model()?.ok()?;
            let [own_hz, from_hz] =
                [&model, &from.model].map(|model| model.recordings[0].observation.rate_hz);
            let length_s = from.length_s * from_hz / own_hz;
            let middle = start_point(&model, problem.job().search.seed, 0);
            let point = model.unknowns.carry_point(&middle, &from.model.unknowns, &from.at.point);
            let at = start_stage(&model, &tried_settings(length_s), (0, false), &point, &from.at.segments)?;
            (!at.segments.is_empty()).then_some(TriedProblem { problem, model, at, length_s })
        };
        let parts: Vec<TriedProblem> =
            changed.into_iter().zip(&self.parts).map(part).collect::<Option<_>>()?;
        let mut trial = (!parts.is_empty()).then_some(Self { hypothesis, parts, found: None })?;
        trial.make_steps(SEARCH_STEPS);
        Some(trial)
    }

    /// Moves on to segments of the last stage, which show errors that short segments do not show.
    fn lengthen_segments(mut self) -> Option<Self> {
        for part in &mut self.parts {
            let segment_s = part.problem.segment_s();
            let [first_s, last_s] = [segment_s[0], segment_s[segment_s.len() - 1]];
            if part.length_s >= last_s {
                continue;
            }
            for (length_s, steps) in [(first_s, STEPS[0]), (last_s, SEARCH_STEPS)] {
                let max_segments = (length_s == last_s).then_some(TRIED_SEGMENTS);
                let settings = TraceSearchSettings { max_segments, ..tried_settings(length_s) };
                part.at = start_stage(&part.model, &settings, (0, false), &part.at.point, &part.at.segments)?;
                part.length_s = length_s;
                part.make_steps(steps);
            }
        }
        Some(self)
    }

    fn make_steps(&mut self, steps: usize) {
        self.parts.iter_mut().for_each(|part| part.make_steps(steps));
    }

    /// Robust cost of all parts.
    fn robust_cost(&self) -> f64 {
        self.parts.iter().map(|part| part.at.cost).sum()
    }

    fn cost_per_dof(&self) -> f64 {
        self.robust_cost()
            / self.parts.iter().map(|part| chi2_per_dof(&part.model, &part.at).1).sum::<usize>().max(1) as f64
    }

    /// Fraction of the frames that the segments of the trial contain.
    fn tried_share(&self) -> f64 {
        let part = &self.parts[0];
        let tried: usize = part.at.segments.iter().map(|segment| segment.last - segment.first).sum();
        let all: usize = part.problem.traces().iter().map(|traced| traced.frames.len()).sum();
        (tried as f64 / all.max(1) as f64).min(1.0)
    }

    /// The same hypothesis with the number that fits best, found by a search along its coordinate. On long
    /// segments the search is finer: a parabola through the costs gives the standard deviation of the
    /// coordinate, and usual numbers are tried.
    fn search_number(self, failed: &FailedFit<'_>, is_long: bool) -> Self {
        /// Maximum number of steps towards a bracket of the minimum.
        const MAX_MOVES: usize = 4;
        /// Step of the next parabola, as a fraction of the step before.
        const FINER: f64 = 0.25;
        /// Rise of the cost of all segments up to which a usual number is preferred: that of three standard
        /// deviations.
        const ROUND_COST: f64 = 9.0;
        let Some([start, first_step]) = self.hypothesis.search_coordinate(failed.problem) else {
            return self;
        };
        let mut best = self;
        let try_at = |from: &Self, coordinate: f64| from.change_number(coordinate, failed);
        let (mut middle, mut step) = (start, if is_long { FINER * first_step } else { first_step });
        let mut sd = f64::INFINITY;
        for _ in 0..=usize::from(is_long) {
            let mut sides = [-step, step].map(|by| try_at(&best, middle + by));
            for _ in 0..MAX_MOVES {
                let cost = |side: &Option<Self>| side.as_ref().map_or(f64::INFINITY, Self::robust_cost);
                let lower = usize::from(cost(&sides[1]) < cost(&sides[0]));
                if cost(&sides[lower]) >= best.robust_cost() {
                    break;
                }
                let by = if lower == 1 { step } else { -step };
                middle += by;
                let next = try_at(&best, middle + by);
                let Some(moved) = std::mem::replace(&mut sides[lower], next) else { break };
                sides[1 - lower] = Some(std::mem::replace(&mut best, moved));
            }
            let [Some(below), Some(above)] = &sides else { break };
            let [low, mid, high] = [below.robust_cost(), best.robust_cost(), above.robust_cost()];
            let curvature = (low - 2.0 * mid + high) / (step * step);
            let to_minimum = 0.5 * (low - high) / (step * curvature);
            if curvature <= 0.0 || to_minimum.abs() > step {
                break;
            }
            sd = (2.0 * best.cost_per_dof().max(1.0) * best.tried_share() / curvature).sqrt();
            if let Some(trial) = try_at(&best, middle + to_minimum)
                && trial.robust_cost() <= best.robust_cost()
            {
                best = trial;
                middle += to_minimum;
            }
            step *= FINER;
        }
        if !sd.is_finite() || !is_long {
            return best;
        }
        // a usual number is preferred if the cost does not clearly exclude it
        let mut tolerance = ROUND_COST * best.cost_per_dof().max(1.0) * best.tried_share();
        if let Hypothesis::HeadLate(_) = best.hypothesis {
            tolerance = f64::INFINITY; // between frames, interpolation lowers the noise and thus the cost
        }
        let usual = best.hypothesis.usual_numbers(failed.problem).into_iter().filter_map(|usual| {
            let mut trial = try_at(&best, usual.search_coordinate(failed.problem)?[0])?;
            trial.make_steps(STEPS[1]);
            Some(trial)
        });
        let usual = usual.min_by(|a, b| a.robust_cost().total_cmp(&b.robust_cost()));
        if let Some(usual) = usual.filter(|usual| usual.robust_cost() < best.robust_cost() + tolerance) {
            if usual.robust_cost() < best.robust_cost() {
                middle = usual
                    .hypothesis
                    .search_coordinate(failed.problem)
                    .map_or(middle, |[coordinate, _]| coordinate);
            }
            best = usual;
        }
        best.found = Some([middle, sd]);
        best
    }

    /// Fits all segments of the changed problems, through all stages.
    fn fit_all_segments(self) -> Option<FittedHypothesis> {
        let (mut misfits, mut ends) = (Vec::new(), Vec::new());
        for part in &self.parts {
            let segment_s = part.problem.segment_s().to_vec();
            let settings = TraceSearchSettings::without_twins(segment_s);
            let first = start_stage(&part.model, &settings, (0, false), &part.at.point, &part.at.segments)?;
            let descent = follow_stages(&part.model, &settings, first, &mut || Ok::<_, ()>(())).ok()?;
            misfits.push(judge_descent(&part.problem, &part.model, &descent)?);
            ends.push(descent.last_iterate()?.clone());
        }
        Some(FittedHypothesis { trial: self, misfits, ends })
    }
}

impl FittedHypothesis {
    fn is_explained(&self) -> bool {
        self.misfits.iter().all(|misfit| misfit.explained)
    }

    /// Chi2 per degree of freedom of all parts together, and number of degrees of freedom.
    fn chi2_per_dof(&self) -> (f64, usize) {
        let parts = || self.trial.parts.iter().zip(&self.ends);
        let each = || parts().map(|(part, end)| chi2_per_dof(&part.model, end));
        let dof = each().map(|(_, dof)| dof).sum::<usize>().max(1);
        (each().map(|(chi2, dof)| chi2 * dof as f64).sum::<f64>() / dof as f64, dof)
    }

    /// Chi2 and cost of the priors per degree of freedom, with a penalty for every unknown (Schwarz 1978), to
    /// compare hypotheses.
    fn penalized_chi2(&self) -> f64 {
        let (chi2, dof) = self.chi2_per_dof();
        let priors = self.trial.parts.iter().zip(&self.ends);
        let priors: f64 = priors.map(|(part, end)| part.model.unknowns.prior_cost(&end.point)).sum();
        let unknowns: usize = self.ends.iter().map(|end| end.point.len()).sum();
        chi2 + (priors + unknowns as f64 * math::ln(dof as f64)) / dof as f64
    }

    /// Factor on a number of the problem with its standard deviation; `None` without such a factor.
    fn preferred_factor(&self, failed: &FailedFit<'_>) -> Option<[f64; 2]> {
        let Hypothesis::Constant(name, _) = self.trial.hypothesis else {
            let [coordinate, sd] = self.trial.found?;
            let is_factor = matches!(self.trial.hypothesis, Hypothesis::FrameRate(_) | Hypothesis::Scale(_));
            let factor = math::exp(coordinate);
            return is_factor.then_some([factor, factor * sd]);
        };
        let (part, end) = (self.trial.parts.first()?, self.ends.first()?);
        let unknowns = &part.model.unknowns.0;
        let at = unknowns.iter().position(
            |unknown| matches!(&unknown.kind, UnknownKind::Parameter { name: own, .. } if own == name),
        )?;
        let factor = unknowns[at].value(end.point[at]) / scene_value(failed.problem, name);
        let widening = chi2_per_dof(&part.model, end).0.max(1.0);
        let covariance = trace_covariance(&part.model, end)?;
        Some([factor, factor * (widening * covariance.curvature[(at, at)]).sqrt()])
    }

    /// The finding; `chi2` is chi2 per degree of freedom without a change.
    fn describe_finding(&self, failed: &FailedFit<'_>, chi2: f64) -> FitFinding {
        let values = |(part, end): (&TriedProblem, &Iterate)| {
            let value =
                |(free, (unknown, z)): (&super::job::FreeParameter, (&super::trace::TraceUnknown, &f64))| {
                    (free.name.clone(), unknown.value(*z))
                };
            let all = part.model.unknowns.0.iter().zip(&end.point);
            part.problem.job().parameters.iter().zip(all).map(value).collect()
        };
        let values: Vec<Vec<(String, f64)>> = self.trial.parts.iter().zip(&self.ends).map(values).collect();
        let factor = self.preferred_factor(failed);
        let found = factor.or_else(|| {
            let late = matches!(self.trial.hypothesis, Hypothesis::HeadLate(_));
            let shortest_s = failed.problem.segment_s()[0];
            self.trial.found.filter(|_| late).map(|found| found.map(|number| number * shortest_s))
        });
        let words = self.trial.hypothesis.describe_condition(failed.problem, found, &values);
        let own = self.chi2_per_dof().0;
        let sentence = if self.is_explained() {
            format!("Explained if {words}")
        } else {
            let [own, chi2] = [own, chi2].map(|chi2| format_trimmed(chi2, 3));
            format!(
                "Less wrong if {words}, but not explained: chi2 per degree of freedom is then {own} instead of {chi2}"
            )
        };
        FitFinding {
            hypothesis: Some(self.trial.hypothesis.kind_name().to_owned()),
            explains: Some(self.is_explained()),
            factor: factor.map(|[factor, _]| factor),
            factor_sd: factor.map(|[_, sd]| sd),
            chi2_per_dof: Some(own),
            ..FitFinding::new(FindingSource::Hypothesis, sentence)
        }
    }
}

impl FailedFit<'_> {
    /// Hypotheses that explain the recordings, the best first; without one, the best that lowers chi2
    /// markedly. `None` if the fit was interrupted.
    fn try_hypotheses(&self, misfit: &TraceMisfit, journal: &mut Journal<'_>) -> Option<Vec<FitFinding>> {
        let mut all = vec![Hypothesis::Unchanged];
        all.extend(Hypothesis::list_all(self.problem));
        let count = all.len() - 1;
        let mut announce =
            |done: usize| journal.announce(format!("trying {count} explanations, {done} tried")).ok();
        let mut trials: Vec<TriedHypothesis> = Vec::new();
        for (chunk, hypotheses) in all.chunks(4).enumerate() {
            announce(4 * chunk)?;
            let start = |hypothesis: &Hypothesis| {
                let mut trial = TriedHypothesis::begin_search(hypothesis.clone(), self)?;
                trial.make_steps(STEPS[0]);
                Some(trial)
            };
            let made: Vec<Option<TriedHypothesis>> = hypotheses.par_iter().map(start).collect();
            trials.extend(made.into_iter().flatten());
        }
        let mut followed = self.select_best(trials, FOLLOWED[0], SAME_KIND);
        followed.par_iter_mut().for_each(|trial| trial.make_steps(STEPS[1]));
        announce(count)?;
        let followed = self.select_best(followed, FOLLOWED[1], 1);
        let followed: Vec<TriedHypothesis> =
            followed.into_par_iter().map(|trial| trial.search_number(self, false)).collect();
        let lengthened = followed.into_par_iter().filter_map(TriedHypothesis::lengthen_segments).collect();
        let mut lengthened = self.select_best(lengthened, FOLLOWED[2], 1);
        self.drop_useless(&mut lengthened);
        announce(count)?;
        let searched: Vec<TriedHypothesis> =
            lengthened.into_par_iter().map(|trial| trial.search_number(self, true)).collect();
        announce(count)?;
        let best = self.select_best(searched, FOLLOWED[3], 1);
        let fitted: Vec<Option<FittedHypothesis>> =
            best.into_par_iter().map(|trial| trial.fit_all_segments()).collect();
        announce(count)?;
        let chi2 = misfit.stages.last().map_or(f64::INFINITY, |stage| stage.chi2_per_dof);
        let mut fitted: Vec<FittedHypothesis> = fitted.into_iter().flatten().collect();
        fitted.sort_by(|a, b| {
            b.is_explained().cmp(&a.is_explained()).then(a.penalized_chi2().total_cmp(&b.penalized_chi2()))
        });
        let explaining = fitted.iter().filter(|trial| trial.is_explained()).count();
        let is_better =
            |trial: &&FittedHypothesis| trial.is_explained() || trial.chi2_per_dof().0 * MARKEDLY < chi2;
        let said = fitted.iter().filter(is_better).take(explaining.max(1));
        Some(said.map(|trial| trial.describe_finding(self, chi2)).collect())
    }

    /// The best hypotheses, at most `most`, and of those that differ only in their number at most
    /// `same_kind`. The unchanged problem is always kept.
    fn select_best(
        &self,
        mut trials: Vec<TriedHypothesis>,
        most: usize,
        same_kind: usize,
    ) -> Vec<TriedHypothesis> {
        math::sort_by_number(&mut trials, |a| a.cost_per_dof());
        let least = trials.first().map_or(f64::INFINITY, TriedHypothesis::cost_per_dof);
        let limit = if least < NEAR_NOISE { WORSE * least } else { f64::INFINITY };
        let mut kept: Vec<TriedHypothesis> = Vec::new();
        for trial in trials {
            let is_same = |better: &&TriedHypothesis| better.hypothesis.is_same_kind(&trial.hypothesis);
            let is_good = trial.cost_per_dof() < limit
                && kept.len() < most
                && kept.iter().filter(is_same).count() < same_kind;
            if is_good || trial.hypothesis == Hypothesis::Unchanged {
                kept.push(trial);
            }
        }
        kept
    }

    /// Keeps the hypotheses that fit better than the unchanged problem.
    fn drop_useless(&self, trials: &mut Vec<TriedHypothesis>) {
        let unchanged = trials.iter().find(|trial| trial.hypothesis == Hypothesis::Unchanged);
        let limit = unchanged.map_or(f64::INFINITY, |trial| BETTER * trial.cost_per_dof());
        trials.retain(|trial| trial.cost_per_dof() < limit);
    }
}
