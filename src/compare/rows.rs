//! Rows of the report: numbers of the experiment against the model's, and the parameters.

use crate::fit::uncertainty::ParameterVerdict;
use serde::Serialize;

/// A number of the experiment against the model's.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct TargetComparison {
    /// Name.
    pub name: String,
    /// Name of the condition, where the job has several.
    pub condition: Option<String>,
    /// Unit; empty for a plain number.
    pub unit: String,
    /// Target value.
    pub target: f64,
    /// Standard deviation of the target, where known.
    pub target_sd: Option<f64>,
    /// Whether the job gives the target, as a published or an assumed number; otherwise it is measured.
    pub given: bool,
    /// Whether the target was measured on a synthetic recording.
    pub synthetic: bool,
    /// Value of the model, including the estimated errors of the camera; `None` where the model has none.
    pub model: Option<f64>,
    /// Value of the model without offset and scale of an estimated camera.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub without_camera: Option<f64>,
    /// `model / target - 1`.
    pub relative_error: Option<f64>,
    /// Largest relative error that passes; `None` where the 95 % interval of the target decides.
    pub tolerance_relative: Option<f64>,
    /// Whether the target is met.
    pub pass: bool,
    /// Standard deviation over twins of the best model, where there are any.
    pub twin_sd: Option<f64>,
    /// Scatter of the model's value between neighbouring parameter values, where there is any.
    pub model_scatter: Option<f64>,
    /// Level of the model's peak below the strongest peak of its band, dB.
    pub below_db: Option<f64>,
    /// The model's next candidate for the target.
    pub next_peak: Option<NextPeak>,
    /// Why the model has no value.
    pub missing: Option<String>,
}

/// A peak of the model that no target is assigned to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NextPeak {
    /// Its frequency, Hz.
    pub frequency_hz: f64,
    /// Its level below the strongest peak of the band, dB.
    pub below_db: f64,
}

/// A fitted parameter.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ParameterLine {
    /// Name as in a scene, such as `friction.a`.
    pub name: String,
    /// Symbol in the equations.
    pub symbol: String,
    /// Unit; empty for a plain number.
    pub unit: String,
    /// Estimate.
    pub estimate: f64,
    /// Lower end of the widest 95 % interval; `None` where it is open.
    pub lower_95: Option<f64>,
    /// Upper end of the widest 95 % interval; `None` where it is open.
    pub upper_95: Option<f64>,
    /// Whether the data determine the parameter.
    pub verdict: ParameterVerdict,
    /// Why it is not identified, as a sentence; `None` where it is.
    pub why: Option<String>,
    /// Bounds of the search.
    pub bounds: [f64; 2],
    /// Whether the job gives a prior.
    pub prior: bool,
    /// Interval of the linear model, where it determines the parameter.
    pub linear_95: Option<[f64; 2]>,
    /// Ends of the profile likelihood; `None` where it does not cross the threshold within the bounds.
    pub profile_95: [Option<f64>; 2],
    /// Interval of refitted twins of the best model, where there are any.
    pub bootstrap_95: Option<[f64; 2]>,
    /// The true value, where the data are synthetic.
    pub truth: Option<TrueValue>,
}

/// The true value of synthetic data.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TrueValue {
    /// The value, in the parameter's unit.
    pub value: f64,
    /// Whether the 95 % interval holds it; an open end holds everything beyond.
    pub inside_95: bool,
}

impl ParameterLine {
    /// Whether the 95 % interval holds a value; an open end holds everything beyond.
    pub(crate) fn holds(&self, value: f64) -> bool {
        self.lower_95.is_none_or(|lower| lower <= value) && self.upper_95.is_none_or(|upper| value <= upper)
    }

    /// Whether the interval has an end; without one it holds every value.
    pub(crate) fn is_bounded(&self) -> bool {
        self.lower_95.is_some() || self.upper_95.is_some()
    }

    /// Whether the data determine it.
    pub(crate) fn is_identified(&self) -> bool {
        self.verdict == ParameterVerdict::Identified
    }
}
