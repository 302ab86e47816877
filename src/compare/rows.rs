//! Rows of the report: targets compared with the model, and fitted parameters.

use crate::fit::uncertainty::ParameterVerdict;
use serde::Serialize;

/// A target, measured or published, compared with the model.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct TargetComparison {
    /// Name of the target.
    pub name: String,
    /// Name of the condition, if the job has several.
    pub condition: Option<String>,
    /// Unit; empty for a plain number.
    pub unit: String,
    /// Target value.
    pub target: f64,
    /// Standard deviation of the target, if known.
    pub target_sd: Option<f64>,
    /// Whether the job states the value of the target, which is then published or assumed; otherwise it is
    /// measured.
    pub given: bool,
    /// Whether the target was measured on a synthetic recording.
    pub synthetic: bool,
    /// Value of the model, including the estimated errors of the camera; `None` if the model has no value.
    pub model: Option<f64>,
    /// Value of the model without the estimated offset and scale of the camera.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub without_camera: Option<f64>,
    /// `model / target - 1`.
    pub relative_error: Option<f64>,
    /// Largest allowed relative error; `None` if the 95 % interval of the target decides whether the target
    /// is met.
    pub tolerance_relative: Option<f64>,
    /// Whether the target is met.
    pub pass: bool,
    /// Standard deviation of the value of the model over its twins (synthetic data sets), if there are twins.
    pub twin_sd: Option<f64>,
    /// Scatter of the value of the model between neighbouring parameter values; `None` if there is no
    /// scatter.
    pub model_scatter: Option<f64>,
    /// How far the peak of the model is below the strongest peak in its band, dB.
    pub below_db: Option<f64>,
    /// The peak of the model that is the second-best candidate for the target.
    pub next_peak: Option<NextPeak>,
    /// Reason why the model has no value.
    pub missing: Option<String>,
}

/// A peak of the model that is not assigned to a target.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NextPeak {
    /// Frequency of the peak, Hz.
    pub frequency_hz: f64,
    /// How far the peak is below the strongest peak in the band, dB.
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
    /// Lower end of the 95 % interval of the parameter. If several methods give an interval, it is the
    /// lowest of their ends. `None` if the interval is open at this end.
    pub lower_95: Option<f64>,
    /// Upper end of the 95 % interval of the parameter. If several methods give an interval, it is the
    /// highest of their ends. `None` if the interval is open at this end.
    pub upper_95: Option<f64>,
    /// Whether the data determine the parameter.
    pub verdict: ParameterVerdict,
    /// Reason why the parameter is not identified, as a sentence; `None` if it is identified.
    pub why: Option<String>,
    /// Bounds of the search.
    pub bounds: [f64; 2],
    /// Whether the job gives a prior for the parameter.
    pub prior: bool,
    /// 95 % interval of the linear model, if that determines the parameter.
    pub linear_95: Option<[f64; 2]>,
    /// Ends of the 95 % interval of the profile likelihood; `None` if the profile does not cross the
    /// threshold within the bounds.
    pub profile_95: [Option<f64>; 2],
    /// 95 % interval from refits to twins (synthetic data sets of the best model), if there are twins.
    pub bootstrap_95: Option<[f64; 2]>,
    /// The true value, if the data are synthetic.
    pub truth: Option<TrueValue>,
}

/// The true value of a parameter, from which synthetic data were made.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TrueValue {
    /// The value, in the parameter's unit.
    pub value: f64,
    /// Whether the 95 % interval contains the value; an interval with an open end has no limit on that side.
    pub inside_95: bool,
}

impl ParameterLine {
    /// Whether the 95 % interval contains a value; an interval with an open end has no limit on that side.
    pub(crate) fn holds(&self, value: f64) -> bool {
        self.lower_95.is_none_or(|lower| lower <= value) && self.upper_95.is_none_or(|upper| value <= upper)
    }

    /// Whether at least one end of the interval is closed; otherwise it contains every value.
    pub(crate) fn is_bounded(&self) -> bool {
        self.lower_95.is_some() || self.upper_95.is_some()
    }

    /// Whether the data determine the parameter.
    pub(crate) fn is_identified(&self) -> bool {
        self.verdict == ParameterVerdict::Identified
    }
}
