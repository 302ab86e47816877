//! Budgets and rules of a search.

/// Generations without a gain after which a cloud is left, unless the job says otherwise.
pub const STAGNANT_GENERATIONS: usize = 20;

/// Budgets and rules.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SearchSettings {
    /// Seed of the clouds.
    pub seed: u64,
    /// Evaluations of the global stage.
    pub global_evaluations: usize,
    /// Evaluations of the local stage.
    pub local_evaluations: usize,
    /// Points of a cloud.
    pub particles: usize,
    /// Generations without progress after which a cloud is left.
    pub stagnation_generations: usize,
    /// Points from which a local search starts.
    pub starts: usize,
}
