//! Tests whether the model explains the traces of the recordings. This verdict comes before all other results
//! of a fit.
//!
//! The parameters of a wrong model have narrow intervals too. Evidence against a model is a residual above
//! the noise, a residual that grows with the length of the segments, or a segment that fits worse than noise
//! allows. In addition, in every fit, a camera error or a constant that is far from the mean of its prior is
//! evidence.

use super::result::NuisanceResult;
use crate::checkpoint::or_infinite;
use crate::text::{format_digits, format_length, format_trimmed};
use portable_math as math;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Relative standard deviation of the noise that is measured on a recording. Chi2 per degree of freedom,
/// which is divided by the square of the noise, has twice this relative standard deviation. The value comes
/// from clean recordings of another camera model.
const NOISE_SD_RELATIVE: f64 = 0.04;
/// Allowed relative growth of chi2 per degree of freedom from the shortest to the longest segments, in
/// addition to the scatter of chi2. With a wrong damping the growth is 0.05 to 0.13, with a right model less
/// than 0.02.
const MAX_GROWTH: f64 = 0.03;
/// Half width of a two-sided 95 % interval, in standard deviations of a normal variable.
const Z_95: f64 = 1.96;
/// Largest allowed distance of a nuisance parameter from the mean of its prior, in standard deviations of the
/// prior. With twenty nuisance parameters, one in a hundred fits of a right model exceeds this limit.
const MAX_PRIOR_DISTANCE_SD: f64 = 3.5;
/// If the model does not explain a recording, the first sentence states the ratio of residual to noise if
/// this ratio is above this value. Otherwise it states the reasons, since a ratio near 1 would look like
/// agreement.
const MIN_STATED_RATIO: f64 = 1.1;
/// Number of significant digits of a ratio in a sentence.
const DIGITS: usize = 4;

/// How well the model explains the traces.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct TraceMisfit {
    /// Whether the model explains the traces.
    pub explained: bool,
    /// Evidence against the model, one sentence each.
    pub reasons: Vec<String>,
    /// Residuals and noise, one entry per recording and channel.
    pub channels: Vec<ChannelMisfit>,
    /// Misfit of each stage, in the order of the stages: the shortest segments first.
    pub stages: Vec<StageMisfit>,
}

/// Residuals of one channel of a recording, with the segments of the last stage.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ChannelMisfit {
    /// Name of the recording in the job.
    pub recording: String,
    /// Name of the channel in the job.
    pub channel: String,
    /// Number of frames that were compared.
    pub frames: usize,
    /// Number of tracked frames that were not compared, such as those before the tip slides for
    /// the first time.
    pub frames_left_out: usize,
    /// Root mean square of the residuals (measurement minus model), m.
    pub residual_rms_m: f64,
    /// Standard deviation of the noise of the channel, m.
    pub noise_m: f64,
    /// Chi2 per degree of freedom. Chi2 is the sum of the squared residuals, each in standard deviations of
    /// the noise.
    pub chi2_per_dof: f64,
    /// Autocorrelation of the residuals at a lag of one frame; `None` without neighbouring frames.
    pub autocorrelation_1: Option<f64>,
    /// Segments with the largest misfit, in descending order of misfit.
    pub worst: Vec<WorstSegment>,
}

/// A segment with a large misfit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WorstSegment {
    /// Time of the first compared frame of the segment, s.
    pub start_s: f64,
    /// Time of the frame after the last compared frame of the segment, s.
    pub end_s: f64,
    /// Chi2 per degree of freedom. Chi2 is the sum of the squared residuals, each in standard deviations of
    /// the noise.
    pub chi2_per_dof: f64,
}

/// One stage of a trace fit: the misfit of segments of one length, and the estimates.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct StageMisfit {
    /// Length of the segments, s.
    pub segment_s: f64,
    /// Number of segments in all recordings.
    pub segments: usize,
    /// Number of segments with a misfit that noise does not explain.
    pub bad_segments: usize,
    /// Number of degrees of freedom: number of measured values minus number of unknowns.
    pub dof: usize,
    /// Chi2 per degree of freedom. Chi2 is the sum of the squared residuals, each in standard deviations of
    /// the noise; it is infinite (`null` in a file) if a run of the model fails.
    #[serde(deserialize_with = "or_infinite")]
    pub chi2_per_dof: f64,
    /// Part of `chi2_per_dof` that the errors of the recorded head of a slider add on average.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub chi2_by_head: f64,
    /// Parameters at the end of the stage, in SI units.
    pub estimates: BTreeMap<String, f64>,
}

#[allow(clippy::trivially_copy_pass_by_ref)] // serde passes a reference
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

impl StageMisfit {
    /// Standard deviation of chi2 per degree of freedom for white noise of known size.
    fn chi2_sd(&self) -> f64 {
        (2.0 / self.dof.max(1) as f64).sqrt()
    }
}

impl TraceMisfit {
    /// Judges the model by the residuals of all channels and stages, and by the nuisance parameters.
    pub(crate) fn judge(
        channels: Vec<ChannelMisfit>,
        stages: Vec<StageMisfit>,
        nuisances: &[NuisanceResult],
    ) -> Self {
        let tests = [
            no_segment_compared(&stages),
            unseen_channel(&channels, &stages),
            mostly_left_out(&channels),
            bad_segments(&stages),
            misfit_above_noise(&stages),
            misfit_growth(&stages),
        ];
        let mut reasons: Vec<String> = tests.into_iter().flatten().collect();
        reasons.extend(far_from_priors(nuisances));
        Self { explained: reasons.is_empty(), reasons, channels, stages }
    }

    /// Whether any segment could be started; otherwise the parameters have no estimates.
    pub(crate) fn has_segments(&self) -> bool {
        any_segment(&self.stages)
    }

    /// The verdict in words: the first sentence, without a full stop, and the reasons that it leaves out.
    /// `ended` says whether the search came to its end.
    pub(crate) fn describe_verdict(&self, ended: bool) -> (String, Vec<String>) {
        if !ended {
            let words = "The search has not ended, so nothing is said about the model; go on with --resume";
            return (words.to_owned(), Vec::new());
        }
        let ratio = |c: &&ChannelMisfit| c.residual_rms_m / c.noise_m;
        let mut compared = self.channels.iter().filter(|c| c.frames > 0);
        let words = |c: &ChannelMisfit| {
            (c.describe_point().to_owned(), format_length(c.residual_rms_m), format_length(c.noise_m))
        };
        if self.explained {
            let left = compared.next().map(words).map_or_else(String::new, |(point, residual, noise)| {
                format!(": {residual} rms is left of the {point}, and its noise is {noise}")
            });
            return (format!("The model explains the recording to within its noise{left}"), Vec::new());
        }
        match compared.max_by(|a, b| ratio(a).total_cmp(&ratio(b))).filter(|c| ratio(c) > MIN_STATED_RATIO) {
            Some(worst) => {
                let ((point, residual, noise), times) = (words(worst), format_digits(ratio(&worst), 2));
                let missed =
                    format!("it misses the {point} by {residual} rms, {times} times the noise of {noise}");
                (unexplained_headline(&[missed]), self.reasons.clone())
            }
            None => (unexplained_headline(&self.reasons), Vec::new()),
        }
    }
}

impl ChannelMisfit {
    /// The point of the blade that the channel shows.
    fn describe_point(&self) -> &str {
        match self.channel.as_str() {
            "tip-x" => "tip",
            "head-x" => "head",
            "head-drop" => "head\u{2019}s drop",
            other => other,
        }
    }
}

/// The first sentence of a report on a fit with evidence against the model.
pub(crate) fn unexplained_headline(reasons: &[String]) -> String {
    format!("The model does not explain the recording: {}", reasons.join("; "))
}

/// A sentence for each camera error or constant that is far from the mean of its prior.
pub(crate) fn far_from_priors(nuisances: &[NuisanceResult]) -> Vec<String> {
    nuisances.iter().filter_map(far_from_prior).collect()
}

/// Evidence against the model: no segment was compared.
fn no_segment_compared(stages: &[StageMisfit]) -> Option<String> {
    (!any_segment(stages)).then(|| "no segment of it could be started".to_owned())
}

fn any_segment(stages: &[StageMisfit]) -> bool {
    stages.last().is_some_and(|stage| stage.segments > 0)
}

/// Evidence against the model: a channel has no compared frames, although some segments fit.
fn unseen_channel(channels: &[ChannelMisfit], stages: &[StageMisfit]) -> Option<String> {
    stages.last().filter(|stage| stage.bad_segments < stage.segments)?;
    let unseen = channels.iter().find(|channel| channel.frames == 0)?;
    let (recording, channel) = (&unseen.recording, &unseen.channel);
    Some(format!("no segment of {channel} in `{recording}` could be started"))
}

/// A reason not to call the recording explained: most of its frames were not compared.
fn mostly_left_out(channels: &[ChannelMisfit]) -> Option<String> {
    let is_left_out = |c: &&ChannelMisfit| c.frames > 0 && c.frames_left_out > c.frames;
    let ChannelMisfit { recording, channel, frames, frames_left_out, .. } =
        channels.iter().find(is_left_out)?;
    Some(format!(
        "only {frames} of {} tracked frames of {channel} in `{recording}` are compared, because segments start \
         only where the tip slides",
        frames + frames_left_out
    ))
}

/// Evidence against the model: segments with a wrong starting state, or with a motion that the model cannot
/// produce.
fn bad_segments(stages: &[StageMisfit]) -> Option<String> {
    let last = stages.last().filter(|stage| stage.bad_segments > 0)?;
    let (bad, all) = (last.bad_segments, last.segments);
    Some(format!("{bad} of {all} segments fit worse than noise ever does"))
}

/// Evidence against the model: the residuals are larger than the noise and the uncertainty of the noise
/// allow.
fn misfit_above_noise(stages: &[StageMisfit]) -> Option<String> {
    let last = stages.last()?;
    let scatter = 1.0 + Z_95 * math::hypot(2.0 * NOISE_SD_RELATIVE, last.chi2_sd());
    let most = (1.0 + last.chi2_by_head) * scatter;
    let [found, most_words] = [last.chi2_per_dof, most].map(ratio_text);
    if !last.chi2_per_dof.is_finite() {
        return (last.segments > 0).then(|| "the model cannot run through some segments".to_owned());
    }
    (last.chi2_per_dof > most).then(|| {
        format!("the residual is {found} times the noise, and noise alone leaves at most {most_words} times")
    })
}

/// Evidence against the model: chi2 per degree of freedom grows with the segment length, because the error of
/// a wrong model accumulates during a run.
fn misfit_growth(stages: &[StageMisfit]) -> Option<String> {
    let [first, .., last] = stages else { return None };
    let by_head = (last.chi2_by_head - first.chi2_by_head).max(0.0);
    let scatter = 1.0 + MAX_GROWTH + Z_95 * math::hypot(first.chi2_sd(), last.chi2_sd());
    let most = (first.chi2_per_dof + by_head) * scatter;
    let grows = last.chi2_per_dof.is_finite() && last.chi2_per_dof > most;
    grows.then(|| {
        format!(
            "the residual grows from {} to {} times the noise while the segments grow from {} to {} ms",
            ratio_text(first.chi2_per_dof),
            ratio_text(last.chi2_per_dof),
            format_trimmed(1e3 * first.segment_s, 3),
            format_trimmed(1e3 * last.segment_s, 3),
        )
    })
}

/// Ratio of residual to noise as text: the square root of chi2 per degree of freedom.
fn ratio_text(chi2_per_dof: f64) -> String {
    format_trimmed(chi2_per_dof.sqrt(), DIGITS)
}

/// Evidence against the model: a constant or a camera error is far from the mean of its prior, because a
/// wrong model distorts all estimated numbers.
fn far_from_prior(found: &NuisanceResult) -> Option<String> {
    let apart = (found.estimate - found.prior?) / found.prior_sd?;
    (apart.abs() > MAX_PRIOR_DISTANCE_SD).then(|| {
        let (what, sds) = (found.describe(), format_trimmed(apart.abs(), 2));
        format!("the {what} lies {sds} standard deviations from what was known beforehand")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stages(chi2: [f64; 3], bad_segments: usize, dof: usize) -> Vec<StageMisfit> {
        let stage = |(segment_s, chi2_per_dof): (f64, f64)| StageMisfit {
            segment_s,
            segments: 40,
            bad_segments,
            dof,
            chi2_per_dof,
            ..StageMisfit::default()
        };
        [0.004, 0.008, 0.016].into_iter().zip(chi2).map(stage).collect()
    }

    fn reasons(chi2: [f64; 3], bad_segments: usize, dof: usize) -> usize {
        TraceMisfit::judge(Vec::new(), stages(chi2, bad_segments, dof), &[]).reasons.len()
    }

    #[test]
    fn a_right_model_is_explained_and_a_wrong_one_is_not() {
        assert_eq!(reasons([1.0, 1.01, 1.02], 0, 5000), 0);
        assert_eq!(reasons([1.1, 1.1, 1.1], 0, 5000), 0, "the noise is good to 4 %");
        assert_eq!(reasons([0.9, 0.88, 0.9], 0, 5000), 0);
        assert_eq!(reasons([1.3, 1.3, 1.3], 0, 5000), 1, "above the noise");
        assert_eq!(reasons([1.3, 1.3, 1.3], 0, 60), 0, "few frames scatter more");
        assert_eq!(reasons([0.95, 1.0, 1.1], 0, 5000), 1, "grows");
        assert_eq!(reasons([1.0, 1.0, 1.0], 2, 5000), 1, "bad segments");
        assert_eq!(reasons([1.0, 1.3, 3.8], 29, 5000), 3);
        assert_eq!(reasons([1.0, 1.0, f64::NAN], 0, 5000), 1);
        assert_eq!(
            TraceMisfit::judge(Vec::new(), Vec::new(), &[]).reasons,
            ["no segment of it could be started"]
        );
    }

    #[test]
    fn a_recording_that_was_not_compared_and_a_run_that_fails_are_said() {
        let (recording, channel) = ("b".to_owned(), "tip-x".to_owned());
        let channels = vec![ChannelMisfit { recording, channel, ..ChannelMisfit::default() }];
        let found = TraceMisfit::judge(channels, stages([1.0, 1.0, f64::INFINITY], 1, 5000), &[]);
        assert_eq!(
            found.reasons,
            [
                "no segment of tip-x in `b` could be started",
                "1 of 40 segments fit worse than noise ever does",
                "the model cannot run through some segments",
            ]
        );
        let text = serde_json::to_string(&found).unwrap();
        assert_eq!(serde_json::from_str::<TraceMisfit>(&text).unwrap(), found);
    }

    #[test]
    fn a_recording_of_which_most_was_left_out_is_not_explained() {
        let reasons = |frames_left_out| {
            let (recording, channel) = ("a".to_owned(), "tip-x".to_owned());
            let channel =
                ChannelMisfit { recording, channel, frames: 100, frames_left_out, ..Default::default() };
            TraceMisfit::judge(vec![channel], stages([1.0; 3], 0, 5000), &[]).reasons
        };
        assert!(reasons(99).is_empty());
        assert!(reasons(101)[0].starts_with("only 100 of 201 tracked frames of tip-x in `a` are compared"));
    }

    #[test]
    fn a_nuisance_far_from_its_prior_speaks_against_the_model() {
        let nuisance = |estimate| NuisanceResult {
            recording: Some("a".to_owned()),
            name: "scale_relative".to_owned(),
            prior: Some(0.0),
            prior_sd: Some(0.005),
            estimate,
            lower_95: None,
            upper_95: None,
        };
        let found = |estimate| {
            TraceMisfit::judge(Vec::new(), stages([1.0; 3], 0, 5000), &[nuisance(0.001), nuisance(estimate)])
                .reasons
        };
        assert!(found(-0.012).is_empty());
        assert_eq!(
            found(-0.0182),
            ["the scale of the camera of `a` lies 3.6 standard deviations from what was known beforehand"]
        );
    }

    #[test]
    fn the_first_sentence_says_it() {
        let said =
            |chi2, bad| TraceMisfit::judge(Vec::new(), stages(chi2, bad, 5000), &[]).describe_verdict(true).0;
        assert_eq!(said([1.0, 1.0, 0.98], 0), "The model explains the recording to within its noise");
        assert_eq!(
            said([1.0, 1.0, 1.0], 1),
            "The model does not explain the recording: 1 of 40 segments fit worse than noise ever does"
        );
        assert_eq!(
            said([1.0, 1.0, 1.3], 0),
            "The model does not explain the recording: the residual is 1.14 times the noise, and noise alone \
             leaves at most 1.078 times; the residual grows from 1 to 1.14 times the noise while the segments grow \
             from 4 to 16 ms"
        );
    }

    #[test]
    fn a_ratio_near_one_is_no_misfit_that_is_stated() {
        let verdict = |residual_rms_m| {
            let channel = ChannelMisfit {
                channel: "tip-x".to_owned(),
                frames: 400,
                residual_rms_m,
                noise_m: 2e-6,
                ..ChannelMisfit::default()
            };
            TraceMisfit::judge(vec![channel], stages([1.0, 1.0, 1.0], 1, 5000), &[]).describe_verdict(true)
        };
        let reason = "1 of 40 segments fit worse than noise ever does";
        let missed = "it misses the tip by 8.0 \u{b5}m rms, 4.0 times the noise of 2.0 \u{b5}m";
        let whole = |why| format!("The model does not explain the recording: {why}");
        assert_eq!(verdict(2.05e-6), (whole(reason), Vec::new()));
        assert_eq!(verdict(8e-6), (whole(missed), vec![reason.to_owned()]));
    }
}
