//! The path of greatest sum through the columns (Viterbi): what stands out, less what jumps.

use crate::math;

/// Standard deviation of the change of frequency over a quarter of a segment, resolutions. A drift of half a
/// resolution in a quarter of a segment moves the frequency by two within the segment, about as much as a
/// segment of the chosen length sees.
const JUMP_SD: f64 = 0.5;
/// Farthest jump, in standard deviations: six resolutions within a segment.
const LONGEST_JUMP: f64 = 3.0;

/// Levels of the bins of the columns, and how far apart both are.
pub(super) struct PathLevels<'a> {
    /// Amplitudes over noise for each column in the band; `None` where there is no spectrum.
    pub levels: &'a [Option<Vec<f64>>],
    /// Bins in the band.
    pub bins: usize,
    /// Bins in one resolution.
    pub bins_per_resolution: f64,
    /// Distance of the columns, quarters of a segment.
    pub quarters: f64,
}

impl PathLevels<'_> {
    /// The bin of each column on the best path. A level counts by the logarithm of its power, so that the
    /// path holds on to a component that fades; a jump costs half the square of its size in standard
    /// deviations.
    pub(super) fn best_path(&self) -> Vec<usize> {
        let sd = (JUMP_SD * self.quarters * self.bins_per_resolution).max(1.0);
        let reach = ((LONGEST_JUMP * sd) as usize).clamp(1, self.bins);
        let costs: Vec<f64> = (0..=reach).map(|jump| 0.5 * math::powi(jump as f64 / sd, 2)).collect();
        let mut sums = vec![0.0; self.bins];
        let mut from: Vec<Vec<u32>> = Vec::with_capacity(self.levels.len());
        for (column, levels) in self.levels.iter().enumerate() {
            let came =
                if column == 0 { (0..self.bins as u32).collect() } else { advance_column(&mut sums, &costs) };
            from.push(came);
            if let Some(levels) = levels {
                sums.iter_mut().zip(levels).for_each(|(sum, level)| *sum += math::ln(1.0 + level * level));
            }
        }
        self.trace_back(&sums, &from)
    }

    fn trace_back(&self, sums: &[f64], from: &[Vec<u32>]) -> Vec<usize> {
        let greatest = |best: usize, bin: usize| if sums[bin] > sums[best] { bin } else { best };
        let mut bin = (0..self.bins).fold(0, greatest);
        let mut path: Vec<usize> = Vec::with_capacity(from.len());
        for came in from.iter().rev() {
            path.push(bin);
            bin = came[bin] as usize;
        }
        path.reverse();
        path
    }
}

/// Moves the sums on by one column; returns the bin each came from.
fn advance_column(sums: &mut Vec<f64>, costs: &[f64]) -> Vec<u32> {
    let bins = sums.len();
    let reach = costs.len() - 1;
    let came = |bin: usize| {
        let (low, high) = (bin.saturating_sub(reach), (bin + reach).min(bins - 1));
        let mut best = (sums[bin], bin);
        for (from, sum) in (low..=high).zip(&sums[low..=high]) {
            let moved = sum - costs[bin.abs_diff(from)];
            if moved > best.0 {
                best = (moved, from);
            }
        }
        best
    };
    let moved: Vec<(f64, usize)> = (0..bins).map(came).collect();
    *sums = moved.iter().map(|m| m.0).collect();
    moved.iter().map(|m| m.1 as u32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn best(levels: &[Option<Vec<f64>>], bins: usize) -> Vec<usize> {
        PathLevels { levels, bins, bins_per_resolution: 4.0, quarters: 1.0 }.best_path()
    }

    fn peak(at: usize, height: f64) -> Option<Vec<f64>> {
        Some((0..60).map(|k: usize| height * (-(k.abs_diff(at) as f64 / 4.0).powi(2)).exp()).collect())
    }

    #[test]
    fn the_path_follows_a_drift_over_a_column_without_spectrum() {
        let levels: Vec<_> = (0..12).map(|c| if c == 5 { None } else { peak(10 + 3 * c, 20.0) }).collect();
        let path = best(&levels, 60);
        // half a resolution
        let on_it = path.iter().enumerate().filter(|(c, bin)| bin.abs_diff(10 + 3 * c) <= 2).count();
        assert_eq!((path.len(), on_it), (12, 12), "{path:?}");
    }

    #[test]
    fn one_column_with_a_larger_maximum_elsewhere_does_not_lead_it_away() {
        let levels: Vec<_> =
            (0..12).map(|c| peak(if c == 6 { 50 } else { 10 }, if c == 6 { 60.0 } else { 20.0 })).collect();
        let path = best(&levels, 60);
        assert!(path.iter().enumerate().all(|(c, bin)| c == 6 || *bin == 10), "{path:?}");
    }
}
