//! Fit of traces, from the journal to the result.

use super::FitError;
use super::checkpoint::FitHeader;
use super::context::FitContext;
use super::diagnosis::diagnose_misfit;
use super::findings::{FindingSource, FitFinding};
use super::identifiability::Identifiability;
use super::job::{FreeParameter, TraceChannel};
use super::journal::{Journal, OnProgress, StopReason};
use super::law::LawComparison;
use super::linear_model::CHI_SQUARED_95;
use super::misfit::{ChannelMisfit, StageMisfit, TraceMisfit, WorstSegment};
use super::problem::Problem;
use super::result::{
    EvaluationCounts, FitResult, FitStatus, FittedSegment, LocalOptimum, NuisanceResult, ParameterResult,
    SegmentStart,
};
use super::targets::measure_targets;
use super::trace::{
    CameraUnknown, Iterate, SegmentResiduals, SegmentState, TraceAssessment, TraceDescent, TraceModel,
    TraceSearchOutcome, TraceSearchSettings, TraceUnknown, UnknownKind, chi2_by_head_errors, chi2_per_dof,
    describe_start_limits, search_trace, segment_residuals, undersampled_mode,
};
use super::uncertainty::ParameterVerdict;
use crate::checkpoint::CheckpointSink;
use crate::model::Pose;
use crate::recording::Recording;
use crate::text::format_trimmed;
use std::collections::{BTreeMap, BTreeSet};

impl Problem {
    /// Fits the traces of the job; every new iterate is written to `sink` as a line and reported to
    /// `on_progress`.
    ///
    /// The result depends neither on the number of threads nor on interruptions.
    ///
    /// # Errors
    /// [`FitError`]. A search that stops early or does not converge is no error; the status of the
    /// result says so.
    pub(super) fn fit_traces(
        &self,
        context: &FitContext,
        sink: &mut dyn CheckpointSink,
        on_progress: &mut OnProgress,
    ) -> Result<FitResult, FitError> {
        let model = self.trace_model().ok_or_else(|| cannot_be_fitted("it has no [[trace]]"))?;
        let model = model.map_err(|error| cannot_be_fitted(&error.to_string()))?;
        let targets = measure_targets(self.job(), self.recordings())?;
        let seed = self.job().search.seed;
        let segment_s = self.segment_s().to_vec();
        let recordings = self.trace_recording_names();
        let unknowns = model.unknowns.0.iter().map(|unknown| unknown.name(&recordings)).collect();
        let header = FitHeader { seed, unknowns, data: recordings, segment_s: segment_s.clone() };
        let mut journal = Journal::new(context, header, sink, on_progress)?;
        if journal.evaluation_limit() == 0 {
            return Err(FitError::NoEvaluation { allowed: 0 });
        }
        let settings =
            TraceSearchSettings { segment_s, twins: self.job().intervals.bootstrap, max_segments: None };
        let searched = search_trace(&model, &settings, seed, &mut journal);
        journal.check_sound()?;
        let found = TraceFindings {
            problem: self,
            model: &model,
            searched: &searched,
            stop: journal.stop_reason(),
            evaluations: journal.count_evaluations(),
        };
        let mut result = found.into_result().ok_or_else(|| cannot_be_fitted(NO_SEGMENT_STARTED))?;
        let best = &searched.descents[searched.best];
        if let (Some(end), true) = (best.last_iterate(), result.status.has_ended()) {
            match self.compare_laws(&model, end, result.explains_recordings(), &mut journal) {
                Ok(law) => result.law = law,
                Err(_) => {
                    result.status = FitStatus::Interrupted;
                    for free in &self.job().parameters {
                        let Some(found) = result.parameters.get_mut(&free.name) else { continue };
                        found.reasons.push("laws of friction were not compared".to_owned());
                        found.verdict = trace_verdict(free, found);
                    }
                }
            }
            if let Some(law) = &result.law {
                law.limit_verdicts(self.job(), &mut result.parameters);
            }
        }
        if let Some(misfit) = result.misfit.as_ref().filter(|misfit| !misfit.explained)
            && result.status.has_ended()
        {
            match diagnose_misfit(self, &model, best, misfit, &mut journal) {
                Some(findings) => {
                    result.findings = findings;
                    let by_law = result.law.as_ref().and_then(LawComparison::find_explanation);
                    let is_hypothesis = |finding: &FitFinding| finding.source == FindingSource::Hypothesis;
                    let place =
                        result.findings.iter().position(is_hypothesis).unwrap_or(result.findings.len());
                    result.findings.splice(place..place, by_law);
                }
                None => result.status = FitStatus::Interrupted,
            }
        }
        if result.status != FitStatus::Interrupted {
            let (shown, held_out) = self.compare_with_targets(&result, targets)?;
            (result.components, result.features, result.held_out) =
                (shown.components, shown.features, held_out);
        }
        Ok(result)
    }

    /// Names of the recordings whose traces are fitted.
    pub(super) fn trace_recording_names(&self) -> Vec<String> {
        let name = |condition: usize| self.job().conditions[condition].name.clone();
        self.traces().iter().map(|trace| name(trace.condition)).collect()
    }
}

fn cannot_be_fitted(why: &str) -> FitError {
    FitError::CannotBeFitted { why: why.to_owned() }
}

/// Reason that is reported if a fit has no iterate.
const NO_SEGMENT_STARTED: &str = "no segment of the traces could be started: the model runs nowhere within the bounds, or \
                          the tip slides in too few frames; look at the recording with `wiperlab inspect`";

// Result of a trace search.

/// Number of segments with the largest misfit that are listed per channel.
const WORST_SEGMENTS: usize = 5;

/// Reason to doubt a fit with segments of a single length: only longer segments would reveal a bias.
const ONE_LENGTH_NOTE: &str = "segments of one length alone were fitted, and whether longer ones agree is not known: give \
                          `segment_s` two lengths at least";

/// Judges the end of a descent whose uncertainty is not known; `None` if it has no iterate.
pub(super) fn judge_descent(
    problem: &Problem,
    model: &TraceModel,
    descent: &TraceDescent,
) -> Option<TraceMisfit> {
    let end = descent.last_iterate()?;
    let searched = TraceSearchOutcome { descents: vec![descent.clone()], ..TraceSearchOutcome::default() };
    let found = TraceFindings { problem, model, searched: &searched, stop: None, evaluations: 0 };
    Some(found.trace_misfit(descent, end, &found.nuisance_results(end)))
}

/// The outcome of a trace search, with the problem and the model.
struct TraceFindings<'a> {
    problem: &'a Problem,
    model: &'a TraceModel,
    searched: &'a TraceSearchOutcome,
    stop: Option<&'a StopReason>,
    /// Number of evaluations, including those from the journal.
    evaluations: usize,
}

impl TraceFindings<'_> {
    /// The result without the comparison of runs over whole recordings; `None` if no start has an iterate.
    fn into_result(self) -> Option<FitResult> {
        let job = self.problem.job();
        let best = self.searched.descents.get(self.searched.best)?;
        let end = best.last_iterate()?;
        let nuisances = self.nuisance_results(end);
        let misfit = self.trace_misfit(best, end, &nuisances);
        let names = job.parameter_names();
        let parameters = job.parameters.iter().enumerate();
        let parameters =
            parameters.map(|(at, free)| (free.name.clone(), self.parameter_result(at, free, end, &misfit)));
        let assessment = self.searched.assessment.as_ref();
        Some(FitResult {
            title: job.title.clone(),
            status: self.fit_status(best),
            parameters: parameters.collect(),
            nuisances,
            segments: self.fitted_segments(end),
            misfit: Some(misfit),
            findings: Vec::new(),
            law: None,
            chatter: None,
            components: Vec::new(),
            features: Vec::new(),
            held_out: Vec::new(),
            rank: assessment.map_or(0, |found| found.rank.min(names.len())),
            condition: None,
            combinations: Vec::new(),
            correlations: assessment.map(|found| correlation_table(&names, found)).unwrap_or_default(),
            cost: end.cost,
            threshold: CHI_SQUARED_95,
            twins: assessment.map_or(0, |found| found.twins),
            gate: Identifiability::default(),
            waterfall: self.sorted_optima(),
            sensitivities: BTreeMap::new(),
            evaluations: EvaluationCounts { total: self.evaluations, ..EvaluationCounts::default() },
            synthetic: self.problem.recordings().iter().flatten().any(Recording::is_synthetic),
            notes: self.collect_notes(end),
            seed: job.search.seed,
            fingerprint: self.problem.fingerprint().to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
        })
    }

    fn fit_status(&self, best: &TraceDescent) -> FitStatus {
        let is_at_end = best.stages.len() >= self.problem.segment_s().len()
            || best.last_iterate().is_some_and(|end| end.is_junk(self.model));
        let is_complete = self.searched.assessment.is_some() && is_at_end;
        match self.stop {
            _ if !self.searched.stopped && is_complete => FitStatus::Converged,
            _ if !self.searched.stopped => FitStatus::Failed,
            None | Some(StopReason::Budget) => FitStatus::BudgetExhausted,
            _ => FitStatus::Interrupted,
        }
    }

    /// Name of a recording by its index among the traces.
    fn recording_name(&self, film: usize) -> String {
        let trace = self.problem.traces().get(film);
        let condition = trace.and_then(|trace| self.problem.job().conditions.get(trace.condition));
        condition.map(|condition| condition.name.clone()).unwrap_or_default()
    }

    /// Values of the free parameters at an iterate, by name.
    fn parameter_values(&self, at: &Iterate) -> BTreeMap<String, f64> {
        let unknowns = &self.model.unknowns;
        let value = |name: String| {
            let i = unknowns.position(&name)?;
            Some((name, unknowns.0[i].value(at.point[i])))
        };
        self.problem.job().parameter_names().into_iter().filter_map(value).collect()
    }

    fn parameter_result(
        &self,
        at: usize,
        free: &FreeParameter,
        end: &Iterate,
        misfit: &TraceMisfit,
    ) -> ParameterResult {
        // the transform from coordinate to value may overshoot a bound by a rounding error
        let estimate = self.model.unknowns.0[at].value(end.point[at]);
        let mut found = ParameterResult {
            estimate: estimate.clamp(free.bounds.lower(), free.bounds.upper()),
            lower_95: None,
            upper_95: None,
            verdict: ParameterVerdict::NotIdentified,
            linear_95: None,
            profile_95: [None; 2],
            bootstrap_95: None,
            profile: Vec::new(),
            reasons: misfit.reasons.clone(),
        };
        let Some(known) = &self.searched.assessment else {
            if self.searched.stopped {
                found.reasons = vec!["the search had not come to its end".to_owned()];
            }
            found.verdict = trace_verdict(free, &found);
            return found;
        };
        let own = &known.estimates[at];
        // a file contains no infinite numbers
        let finite = |ends: &[f64; 2]| ends.iter().all(|end| end.is_finite());
        found.linear_95 = Some(own.ends_95).filter(finite);
        found.bootstrap_95 = own.twins_95.filter(finite);
        let [lower, upper] = own.widest_95();
        found.lower_95 = Some(lower).filter(|end| *end > free.bounds.lower());
        found.upper_95 = Some(upper).filter(|end| *end < free.bounds.upper());
        let wide = found.lower_95.is_none() && found.upper_95.is_none();
        found.reasons.extend(wide.then(|| "the interval is wider than the bounds".to_owned()));
        let alone = self.problem.segment_s().len() < 2;
        found.reasons.extend(alone.then(|| ONE_LENGTH_NOTE.to_owned()));
        found.reasons.extend(known.doubts.iter().chain(&own.doubts).cloned());
        let mut seen = BTreeSet::new();
        found.reasons.retain(|reason| seen.insert(reason.clone()));
        found.verdict = trace_verdict(free, &found);
        found
    }

    fn nuisance_results(&self, end: &Iterate) -> Vec<NuisanceResult> {
        let free = &self.problem.job().parameters;
        let is_free = |unknown: &TraceUnknown| match &unknown.kind {
            UnknownKind::Parameter { name, .. } => free.iter().any(|own| own.name == *name),
            UnknownKind::Camera { .. } => false,
        };
        let all = self.model.unknowns.0.iter().zip(&end.point).enumerate();
        let all = all.filter(|(_, (unknown, _))| !is_free(unknown));
        let nuisance = |(at, (unknown, z)): (usize, (&TraceUnknown, &f64))| {
            let ends = self.searched.assessment.as_ref().map(|known| known.estimates[at].widest_95());
            let (recording, name) = match &unknown.kind {
                UnknownKind::Parameter { name, .. } => (None, name.clone()),
                UnknownKind::Camera { film, what } => {
                    (Some(self.recording_name(*film)), what.key().to_owned())
                }
            };
            NuisanceResult {
                recording,
                name,
                prior: unknown.prior.map(|[mean, _]| unknown.value(mean)),
                prior_sd: unknown.prior.map(|[mean, sd]| sd * unknown.slope(mean)),
                estimate: unknown.value(*z),
                lower_95: ends.map(|ends| ends[0]).filter(|end| end.is_finite()),
                upper_95: ends.map(|ends| ends[1]).filter(|end| end.is_finite()),
            }
        };
        all.map(nuisance).collect()
    }

    fn fitted_segments(&self, end: &Iterate) -> Vec<FittedSegment> {
        let fitted = |segment: &SegmentState| {
            let film = segment.recording;
            let seen = &self.model.recordings[film].observation;
            let clock_s = self.model.unknowns.camera_at(film, &end.point).clock_s;
            let [theta, phi, theta_rate, phi_rate] = segment.start;
            let pose = Pose { theta, phi, theta_rate, phi_rate };
            FittedSegment {
                recording: self.recording_name(film),
                first_frame: segment.first,
                end_frame: segment.last,
                fits: segment.chi2.is_finite() && !segment.is_bad(),
                time_s: seen.times_s[segment.first] - seen.lead_s() - clock_s,
                start: SegmentStart::new(&pose, &self.model.recordings[film].scene.linkage),
            }
        };
        end.segments.iter().map(fitted).collect()
    }

    fn trace_misfit(&self, best: &TraceDescent, end: &Iterate, nuisances: &[NuisanceResult]) -> TraceMisfit {
        let found = segment_residuals(self.model, end);
        let mut channels: BTreeMap<(usize, bool), Vec<&SegmentResiduals>> = BTreeMap::new();
        // a recording without residuals also gets an entry for each of its channels
        for (film, trace) in self.problem.traces().iter().enumerate() {
            for channel in &trace.channels {
                channels.insert((film, *channel == TraceChannel::HeadDrop), Vec::new());
            }
        }
        found.iter().for_each(|r| channels.entry((r.recording, r.is_drop)).or_default().push(r));
        let ((chi2, dof), data) = (chi2_per_dof(self.model, end), end.count_data());
        // degrees of freedom per measured value, assumed to be equal for all channels; chi2 is NaN if a run
        // fails
        let share = if chi2.is_nan() || data == 0 { 1.0 } else { dof as f64 / data as f64 };
        let rows = channels.iter();
        let rows = rows.map(|(channel, parts)| self.channel_misfit(*channel, parts, share)).collect();
        // the uncertainty run with shorter segments replaces the stage of the search with segments of the
        // same length
        let known = self.searched.assessment.as_ref().and_then(|known| known.shorter.as_ref());
        let shorter = |stage: usize| known.filter(|iterate| iterate.stage == stage);
        let stages =
            best.stages.iter().map(|way| self.stage_misfit(shorter(way.stage).unwrap_or(way))).collect();
        TraceMisfit::judge(rows, stages, nuisances)
    }

    fn channel_misfit(
        &self,
        (film, is_drop): (usize, bool),
        parts: &[&SegmentResiduals],
        share: f64,
    ) -> ChannelMisfit {
        let shoot = &self.model.recordings[film].observation;
        let has = |channel| self.problem.traces()[film].channels.contains(&channel);
        let channel = match is_drop {
            true => TraceChannel::HeadDrop,
            false if has(TraceChannel::Deflection) => TraceChannel::Deflection,
            false => TraceChannel::TipX,
        };
        let frames: usize = parts.iter().map(|part| part.frames.len()).sum();
        let [first, last] = shoot.settings.frames;
        let tracked = &(if is_drop { &shoot.drop_m } else { &shoot.tip_x_m })[first..last];
        let squares =
            |values: &dyn Fn(&SegmentResiduals) -> f64| parts.iter().map(|p| values(p)).sum::<f64>();
        let chi2 = |part: &SegmentResiduals| part.whitened.iter().map(|r| r * r).sum::<f64>();
        let segment = |part: &&SegmentResiduals| {
            let (first, last) = (*part.frames.first()?, *part.frames.last()?);
            let end_s = shoot.times_s[last] + 1.0 / shoot.rate_hz;
            let chi2_per_dof = chi2(part) / (share * part.frames.len() as f64);
            Some(WorstSegment { start_s: shoot.times_s[first], end_s, chi2_per_dof })
        };
        let mut worst: Vec<WorstSegment> = parts.iter().filter_map(segment).collect();
        portable_math::sort_by_number(&mut worst, |a| -a.chi2_per_dof);
        worst.truncate(WORST_SEGMENTS);
        let metres = squares(&|part| part.residual_m.iter().map(|r| r * r).sum());
        ChannelMisfit {
            recording: self.recording_name(film),
            channel: channel.name().to_owned(),
            frames,
            frames_left_out: tracked.iter().flatten().count().saturating_sub(frames),
            residual_rms_m: (metres / frames.max(1) as f64).sqrt(),
            noise_m: shoot.settings.noise[usize::from(is_drop)].sd(),
            chi2_per_dof: squares(&chi2) / (share * frames.max(1) as f64),
            autocorrelation_1: residual_autocorrelation(parts),
            worst,
        }
    }

    fn stage_misfit(&self, iterate: &Iterate) -> StageMisfit {
        let (chi2_per_dof, dof) = chi2_per_dof(self.model, iterate);
        StageMisfit {
            segment_s: self.problem.segment_s().get(iterate.stage).copied().unwrap_or_default(),
            segments: iterate.segments.len(),
            bad_segments: iterate.count_bad_segments(),
            dof,
            chi2_per_dof,
            chi2_by_head: chi2_by_head_errors(self.model, iterate, self.problem.job().search.seed),
            estimates: self.parameter_values(iterate),
        }
    }

    /// The last iterate of each start, in ascending order of cost.
    fn sorted_optima(&self) -> Vec<LocalOptimum> {
        let stages = self.problem.segment_s().len();
        let optimum = |descent: &TraceDescent| {
            let (first, end) = (descent.stages.first()?, descent.last_iterate()?);
            let failure = (descent.stages.len() < stages)
                .then(|| format!("ended at stage {} of {stages}", descent.stages.len()));
            Some(LocalOptimum {
                start_cost: first.cost,
                cost: end.cost,
                evaluations: descent.iterates,
                values: self.parameter_values(end),
                failure,
            })
        };
        let mut found: Vec<LocalOptimum> = self.searched.descents.iter().filter_map(optimum).collect();
        found.sort_by(|a, b| a.failure.is_some().cmp(&b.failure.is_some()).then(a.cost.total_cmp(&b.cost)));
        found
    }

    /// Sentence on the constant part of the deflection of a slider, which can come from an offset of a sensor
    /// or from a constant force. `None` for a blade, and if the 95 % interval contains zero.
    fn describe_constant_force(&self, film: usize, end: &Iterate) -> Option<String> {
        let unknowns = &self.model.unknowns;
        let stiffness =
            unknowns.scene_at(&self.model.recordings[film], film, &end.point)?.linkage.slider()?;
        let stiffness = stiffness.spring.stiffness;
        let offset = UnknownKind::Camera { film, what: CameraUnknown::OffsetX };
        let is_offset = |unknown: &TraceUnknown| unknown.kind == offset;
        let at = unknowns.0.iter().position(is_offset)?;
        let offset_m = unknowns.0[at].value(end.point[at]);
        let [low_m, high_m] = self.searched.assessment.as_ref()?.estimates[at].widest_95();
        (low_m > 0.0 || high_m < 0.0).then(|| {
            format!(
                "{}: the zeros of the sensors of slider and head differ by {} mm, or a constant force of {} N acts on \
                 the slider; the recording alone cannot say which",
                self.recording_name(film),
                format_trimmed(1e3 * offset_m, 3),
                format_trimmed(stiffness * offset_m, 3),
            )
        })
    }

    fn collect_notes(&self, end: &Iterate) -> Vec<String> {
        let mut notes = Vec::new();
        if let Some([rate_hz, fastest_hz]) = undersampled_mode(self.model, end) {
            notes.push(format!(
                "{rate_hz} frames/s are fewer than two a period of the blade's fastest mode ({fastest_hz:.0} Hz): other values \
                 may give nearly the same frames, so that more starts were compared; film faster if you can"
            ));
        }
        for (film, shoot) in self.model.recordings.iter().enumerate() {
            notes.extend(self.describe_constant_force(film, end));
            if !end.segments.iter().any(|segment| segment.recording == film) {
                notes.push(format!(
                    "{}: {}",
                    self.recording_name(film),
                    describe_start_limits(shoot, &self.model.unknowns.camera_at(film, &end.point))
                ));
            }
        }
        if self.problem.constants().is_empty() {
            notes.push(
                "masses, inertias, dampings, preload and every other constant of the scene are taken as exact: the \
                 intervals do not include their errors; without `nuisance` in the job they are free within the \
                 default priors"
                    .to_owned(),
            );
        }
        notes.extend(self.problem.describe_left_out());
        let recordings = || self.problem.recordings().iter().flatten();
        notes.extend(recordings().filter_map(Recording::describe_resampling));
        if recordings().any(Recording::is_synthetic) {
            notes.push("the recording is synthetic: no camera took it".to_owned());
        }
        notes
    }
}

/// Verdict on a parameter. If there is any reason to doubt the parameter, it is not identified.
pub(super) fn trace_verdict(free: &FreeParameter, found: &ParameterResult) -> ParameterVerdict {
    /// Distance from a bound, as a fraction of the parameter's range, within which a value counts as at the
    /// bound.
    const NEAR: f64 = 1e-6;
    let place = free.bounds.unit_coordinate(found.estimate);
    match (found.lower_95, found.upper_95) {
        _ if !(NEAR..=1.0 - NEAR).contains(&place) => ParameterVerdict::AtBound,
        (None, None) => ParameterVerdict::NotIdentified,
        _ if !found.reasons.is_empty() => ParameterVerdict::NotIdentified,
        (None, Some(_)) => ParameterVerdict::OpenBelow,
        (Some(_), None) => ParameterVerdict::OpenAbove,
        (Some(_), Some(_)) => ParameterVerdict::Identified,
    }
}

fn correlation_table(names: &[String], known: &TraceAssessment) -> BTreeMap<String, BTreeMap<String, f64>> {
    let row = |i: usize| {
        let cells = names.iter().enumerate().map(|(j, name)| (name.clone(), known.correlation[(i, j)]));
        cells.filter(|(_, r)| r.is_finite()).collect()
    };
    names.iter().enumerate().map(|(i, name)| (name.clone(), row(i))).collect()
}

/// Autocorrelation of the whitened residuals at a lag of one frame.
fn residual_autocorrelation(parts: &[&SegmentResiduals]) -> Option<f64> {
    let (mut product, mut pairs, mut square, mut count) = (0.0, 0usize, 0.0, 0usize);
    for part in parts {
        square += part.whitened.iter().map(|r| r * r).sum::<f64>();
        count += part.whitened.len();
        for (frames, values) in part.frames.windows(2).zip(part.whitened.windows(2)) {
            if frames[1] == frames[0] + 1 {
                product += values[0] * values[1];
                pairs += 1;
            }
        }
    }
    let variance = square / count.max(1) as f64;
    Some(product / pairs as f64 / variance).filter(|r| r.is_finite())
}
