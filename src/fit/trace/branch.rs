//! What begins at the best end of a search: where shorter segments lead from there, how far the cost itself
//! lets each parameter go, and twins.

use super::iterate::{Iterate, TraceSearchSettings, chi2_per_dof};
use super::model::TraceModel;
use super::outer::{TraceCovariance, trace_covariance};

/// Standard deviations of a two-sided 95 % interval.
pub(super) const Z_95: f64 = 1.959_963_984_540_054;

/// Starts that are tried, at most, until two of them end at the same place.
pub const MAX_STARTS: usize = 6;

/// Most twins of a search.
pub const MAX_TWINS: usize = 1000;
/// What a chain is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UncertaintyRun {
    /// A twin of the data, fitted again.
    Twin(usize),
    /// The segments of the stage before, from the end.
    Shorter,
    /// An unknown away from its estimate, with everything else fitted again.
    Side {
        /// Number of the unknown.
        unknown: usize,
        /// Whether it is above the estimate.
        above: bool,
    },
}

impl UncertaintyRun {
    /// Number of its chain, behind those of the starts.
    #[must_use]
    pub fn chain_number(self) -> usize {
        MAX_STARTS
            + match self {
                Self::Twin(twin) => twin,
                Self::Shorter => MAX_TWINS,
                Self::Side { unknown, above } => MAX_TWINS + 1 + 2 * unknown + usize::from(above),
            }
    }

    /// What the chain with a number is for; `None` for a start.
    #[must_use]
    pub fn from_chain_number(chain: usize) -> Option<Self> {
        let number = chain.checked_sub(MAX_STARTS)?;
        Some(match number.checked_sub(MAX_TWINS) {
            None => Self::Twin(number),
            Some(0) => Self::Shorter,
            Some(side) => Self::Side { unknown: (side - 1) / 2, above: side % 2 == 0 },
        })
    }

    pub(super) fn is_twin(self) -> bool {
        matches!(self, Self::Twin(_))
    }

    /// Steps of its chain, at most: it begins near its end, where the linear model nearly holds.
    fn max_steps(self) -> usize {
        match self {
            Self::Twin(_) => 4,
            Self::Shorter => 6,
            Self::Side { .. } => 1,
        }
    }

    /// Whether its chain ends with an iterate.
    pub(super) fn is_complete(self, last: &Iterate) -> bool {
        last.settled || last.number >= self.max_steps()
    }
}

/// The end of a search, and what its branches need to know of it.
pub struct SearchEnd<'a> {
    /// What was fitted.
    pub model: &'a TraceModel,
    /// How it was searched.
    pub settings: &'a TraceSearchSettings,
    /// Seed of the job.
    pub seed: u64,
    /// The best iterate.
    pub at: &'a Iterate,
    /// Covariance there.
    pub covariance: TraceCovariance,
    /// Factor on variances: noise that is larger than measured widens everything.
    pub widening: f64,
    /// Standard deviation of each coordinate by curvature and segments.
    pub sd: Vec<f64>,
}

impl<'a> SearchEnd<'a> {
    /// `None` where the recordings do not determine the unknowns there.
    #[must_use]
    pub fn new(
        model: &'a TraceModel,
        settings: &'a TraceSearchSettings,
        seed: u64,
        at: &'a Iterate,
    ) -> Option<Self> {
        let covariance = trace_covariance(model, at)?;
        let widening = chi2_per_dof(at).0.max(1.0);
        let variance = |i: usize| (widening * covariance.curvature[(i, i)]).max(covariance.sandwich[(i, i)]);
        let sd = (0..at.point.len()).map(|i| variance(i).sqrt()).collect();
        Some(Self { model, settings, seed, at, covariance, widening, sd })
    }

    /// The branches that it has: none where some segments do not fit.
    pub(super) fn uncertainty_runs(&self) -> Vec<UncertaintyRun> {
        if !self.at.plain {
            return Vec::new();
        }
        let shorter = (self.at.stage > 0).then_some(UncertaintyRun::Shorter);
        let parameters = (0..self.at.point.len()).filter(|&i| self.model.unknowns.is_parameter(i));
        let sides =
            parameters.flat_map(|unknown| [false, true].map(|above| UncertaintyRun::Side { unknown, above }));
        shorter.into_iter().chain(sides).chain((0..self.settings.twins).map(UncertaintyRun::Twin)).collect()
    }

    /// How far an unknown is moved to look at the cost there.
    pub(super) fn profile_offset(&self, unknown: usize, above: bool) -> f64 {
        let far = Z_95 * self.sd.get(unknown).copied().unwrap_or_default();
        if above { far } else { -far }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_chain_has_a_number_of_its_own() {
        let sides =
            (0..20).flat_map(|unknown| [false, true].map(|above| UncertaintyRun::Side { unknown, above }));
        let branches: Vec<UncertaintyRun> =
            (0..MAX_TWINS).map(UncertaintyRun::Twin).chain([UncertaintyRun::Shorter]).chain(sides).collect();
        for (place, branch) in branches.iter().enumerate() {
            assert_eq!(
                (branch.chain_number(), UncertaintyRun::from_chain_number(branch.chain_number())),
                (MAX_STARTS + place, Some(*branch))
            );
        }
        assert_eq!(UncertaintyRun::from_chain_number(MAX_STARTS - 1), None);
    }
}
