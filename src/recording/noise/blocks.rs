//! A channel in short blocks. In each block, a polynomial in time describes the motion; the residuals are
//! noise.

use crate::recording::channel::median_in_place;
use portable_math as math;

/// Minimum number of present frames of a block, as a fraction of its length.
const LEAST_SHARE: f64 = 0.5;
/// Minimum number of degrees of freedom of a block.
const LEAST_LEFT: usize = 4;
/// Largest allowed distance of the end of a block from its middle, in units of half its nominal length. This
/// distance is about 1 if the frames lie on a grid, and larger where the frame rate is below the mean rate.
const LONGEST_SPAN: f64 = 2.0;
/// Largest scatter of the residuals in a block that is used, in units of the median scatter of all blocks. A
/// block with a larger scatter has an outlier, or the tip is off the glass.
const OUTLYING_SCATTER: f64 = 3.0;

/// Length of the blocks of a channel, and the terms that are fitted in them.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlockCut<'a> {
    /// Number of frames of a block.
    pub length: usize,
    /// Degree of the polynomial in time.
    pub degree: usize,
    /// A channel that enters the fit as a further linear term.
    pub covariate: Option<&'a [Option<f64>]>,
    /// Time of every frame, in units of the mean frame interval; the index of the frame if the frames lie on
    /// a grid.
    pub places: &'a [f64],
}

/// A block of frames in which the motion is a linear combination of a few columns.
#[derive(Debug, Clone)]
pub(super) struct NoiseBlock {
    /// Indices of the frames that are present.
    pub frames: Vec<usize>,
    /// Times of these frames, in units of the mean frame interval.
    pub places: Vec<f64>,
    pub values: Vec<f64>,
    pub columns: Vec<Vec<f64>>,
}

impl NoiseBlock {
    /// Number of values minus number of columns.
    pub(crate) fn degrees_of_freedom(&self) -> usize {
        self.values.len() - self.columns.len()
    }

    /// Residuals of the values from their least-squares fit by the columns.
    pub(crate) fn residuals(&self) -> Vec<f64> {
        let mut values = self.values.clone();
        project_out(&mut self.columns.clone(), &mut values);
        values
    }
}

/// Subtracts from the values their projection on the columns, and makes the columns orthogonal. Returns the
/// logarithm of the determinant of the Gram matrix of the given columns.
pub(super) fn project_out(columns: &mut [Vec<f64>], values: &mut [f64]) -> f64 {
    let mut log = 0.0;
    for j in 0..columns.len() {
        let (done, rest) = columns.split_at_mut(j + 1);
        let column = &mut done[j];
        let squared = dot_product(column, column);
        log += math::ln(squared);
        for other in rest.iter_mut().map(Vec::as_mut_slice).chain([&mut *values]) {
            let share = dot_product(column, other) / squared;
            other.iter_mut().zip(column.iter()).for_each(|(x, c)| *x -= share * c);
        }
    }
    log
}

pub(super) fn dot_product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The blocks of a channel in which enough frames are present.
pub(super) fn cut_blocks(channel: &[Option<f64>], cut: &BlockCut<'_>) -> Vec<NoiseBlock> {
    let starts = (0..channel.len()).step_by(cut.length);
    starts.filter_map(|first| cut_block(channel, cut, first)).collect()
}

fn cut_block(channel: &[Option<f64>], cut: &BlockCut<'_>, first: usize) -> Option<NoiseBlock> {
    let last = (first + cut.length).min(channel.len());
    let beside = |i: usize| cut.covariate.map_or(Some(0.0), |beside| beside[i]);
    let frames: Vec<usize> = (first..last).filter(|&i| channel[i].is_some() && beside(i).is_some()).collect();
    let freedoms = cut.degree + 1 + usize::from(cut.covariate.is_some());
    let half = 0.5 * cut.length as f64;
    let place = |i: usize| (cut.places[i] - cut.places[first] + 0.5) / half - 1.0;
    // (a block with a long gap between its times is not used)
    if place(last - 1) > LONGEST_SPAN {
        return None;
    }
    if (frames.len() as f64) < LEAST_SHARE * cut.length as f64 || frames.len() < freedoms + LEAST_LEFT {
        return None;
    }
    let centred = |of: &dyn Fn(usize) -> Option<f64>| -> Option<Vec<f64>> {
        let values: Vec<f64> = frames.iter().map(|&i| of(i)).collect::<Option<_>>()?;
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        Some(values.into_iter().map(|x| x - mean).collect())
    };
    let powers = (0..=cut.degree).map(|k| frames.iter().map(|i| math::powi(place(*i), k as i32)).collect());
    let mut columns: Vec<Vec<f64>> = powers.collect();
    if cut.covariate.is_some() {
        let moved = centred(&beside)?;
        // (a constant channel is not independent of the polynomial)
        if dot_product(&moved, &moved) > 0.0 {
            columns.push(moved);
        }
    }
    let places = frames.iter().map(|i| cut.places[*i]).collect();
    Some(NoiseBlock { values: centred(&|i| channel[i])?, columns, frames, places })
}

/// Leaves out the blocks whose scatter is far above the median, because they contain more than noise.
pub(super) fn keep_quiet_blocks(blocks: Vec<NoiseBlock>) -> Vec<NoiseBlock> {
    let scatter = |block: &NoiseBlock| {
        let squares: f64 = block.residuals().iter().map(|x| x * x).sum();
        (squares / block.degrees_of_freedom() as f64).sqrt()
    };
    let mut sizes: Vec<f64> = blocks.iter().map(scatter).collect();
    let Some(median) = median_in_place(&mut sizes) else { return blocks };
    blocks.into_iter().filter(|block| scatter(block) <= OUTLYING_SCATTER * median).collect()
}
