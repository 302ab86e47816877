//! Detection of a solver that no longer makes progress.

/// Counts the successive steps without progress.
pub(super) struct StagnationCounter {
    allowed: usize,
    gain: f64,
    mark: f64,
    waited: usize,
}

impl StagnationCounter {
    /// A counter that reports stagnation after more than `allowed` successive steps that together lower the
    /// cost by less than the fraction `gain`.
    pub(super) fn new(allowed: usize, gain: f64) -> Self {
        Self { allowed, gain, mark: f64::MAX, waited: 0 }
    }

    pub(super) fn is_stagnant(&mut self, cost: f64) -> bool {
        if cost < self.mark * (1.0 - self.gain) {
            (self.mark, self.waited) = (cost, 0);
        } else {
            self.waited += 1;
        }
        self.waited > self.allowed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patience_counts_steps_without_gain() {
        let mut patience = StagnationCounter::new(2, 0.01);
        let over: Vec<bool> =
            [10.0, 9.95, 9.0, 9.0, 8.95, 8.92].into_iter().map(|cost| patience.is_stagnant(cost)).collect();
        assert_eq!(over, [false, false, false, false, false, true]);
    }
}
