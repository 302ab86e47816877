//! Numbers of the experiment against those of the model, and what is known of the parameters.

use crate::fit::uncertainty::ParameterVerdict;
use serde::Serialize;

/// A number of the experiment and that of the model.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Comparison {
    /// Name.
    pub name: String,
    /// Name of the condition that it is read from, where there are several.
    pub condition: Option<String>,
    /// Unit; empty for a plain number.
    pub unit: String,
    /// Value to be met.
    pub target: f64,
    /// Its standard deviation, where known.
    pub target_sd: Option<f64>,
    /// Whether the target is given in the job, as a published or an assumed number, and not measured on a
    /// recording.
    pub given: bool,
    /// Whether the target was measured on a recording that no camera took.
    pub synthetic: bool,
    /// Value of the model, as its camera shows it where that is estimated; `None` where it shows none.
    pub model: Option<f64>,
    /// The same without the offset and the scale of a camera that is estimated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub without_camera: Option<f64>,
    /// `model / target - 1`.
    pub relative_error: Option<f64>,
    /// Largest relative error that passes; `None` where the 95 % interval of the target decides.
    pub tolerance_relative: Option<f64>,
    /// Whether it counts as met.
    pub pass: bool,
    /// Standard deviation over twins of the best model, where there were any.
    pub twin_sd: Option<f64>,
    /// Scatter of the model's value between neighbouring parameters, where there is any.
    pub model_scatter: Option<f64>,
    /// By how much the model's peak is weaker than the strongest of its band, dB.
    pub below_db: Option<f64>,
    /// The model's peak that would have been assigned next.
    pub next_peak: Option<NextPeak>,
    /// Why the model shows none.
    pub missing: Option<String>,
}

/// A peak of the model that a component was not assigned to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NextPeak {
    /// Its frequency, Hz.
    pub frequency_hz: f64,
    /// By how much it is weaker than the strongest of the band, dB.
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
    /// Lower end of the 95 % interval, the widest of those below; `None` where it is open.
    pub lower_95: Option<f64>,
    /// Upper end of the 95 % interval, the widest of those below; `None` where it is open.
    pub upper_95: Option<f64>,
    /// What is known of it.
    pub verdict: ParameterVerdict,
    /// Why it is not identified, in words; `None` where it is.
    pub why: Option<String>,
    /// Bounds of the search.
    pub bounds: [f64; 2],
    /// Whether a prior counted in addition to the features.
    pub prior: bool,
    /// Interval of the linear model, where it determines the parameter.
    pub linear_95: Option<[f64; 2]>,
    /// Ends of the profile likelihood; `None` where it does not cross the threshold within the bounds.
    pub profile_95: [Option<f64>; 2],
    /// Interval of twins of the best model that were fitted again, where there were any.
    pub bootstrap_95: Option<[f64; 2]>,
    /// The true value, where the data are synthetic.
    pub truth: Option<Truth>,
}

/// The value behind synthetic data.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Truth {
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

    /// Whether the interval ends anywhere: one that is open on both sides holds every value, and says
    /// nothing.
    pub(crate) fn is_bounded(&self) -> bool {
        self.lower_95.is_some() || self.upper_95.is_some()
    }

    /// Whether the data determine it.
    pub(crate) fn is_identified(&self) -> bool {
        self.verdict == ParameterVerdict::Identified
    }
}
