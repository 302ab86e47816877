//! Normal equations of one segment with its starting state eliminated (variable projection).

use super::segment_simulation::{LinearizedSegment, LinkState};
use nalgebra::{DMatrix, DVector};

/// Singular values of the scaled Jacobian columns of the starting state are ignored if they are below this
/// fraction of the largest singular value.
const MIN_SINGULAR: f64 = 1e-4;

/// Normal equations of one segment for the unknowns, and the step of the starting state as a linear function
/// of the step of the unknowns.
#[derive(Debug, Clone)]
pub(super) struct ProjectedSegment {
    /// `J^T J`, where `J` is the Jacobian with respect to the unknowns after the starting state is projected
    /// out.
    pub matrix: DMatrix<f64>,
    /// `J^T r`, where `J` is the Jacobian as in `matrix` and `r` are the residuals after the starting state
    /// is projected out.
    pub slope: DVector<f64>,
    /// Minus the step of the starting state while the unknowns are held fixed.
    pub move_held: LinkState,
    /// Minus the derivative of the step of the starting state with respect to the step of the unknowns.
    pub move_by_unknown: DMatrix<f64>,
}

/// Projects the Jacobian columns of the starting state out of the residuals and of the other columns; `None`
/// if the decomposition fails.
pub(super) fn project_out_state(linear: &LinearizedSegment) -> Option<ProjectedSegment> {
    let LinearizedSegment { residuals, by_state, by_unknown } = linear;
    let scales: [f64; 4] = std::array::from_fn(|i| by_state.column(i).norm().max(1e-12));
    let mut scaled = by_state.clone();
    (0..4).for_each(|i| scaled.column_mut(i).scale_mut(1.0 / scales[i]));
    let svd = scaled.svd(true, true);
    let basis = svd.u.as_ref()?;
    let largest = svd.singular_values.max();
    let (mut rest, mut columns) = (residuals.clone(), by_unknown.clone());
    for i in (0..4).filter(|&i| svd.singular_values[i] > MIN_SINGULAR * largest) {
        let axis = basis.column(i);
        rest.axpy(-axis.dot(residuals), &axis, 1.0);
        for (k, mut column) in columns.column_iter_mut().enumerate() {
            column.axpy(-axis.dot(&by_unknown.column(k)), &axis, 1.0);
        }
    }
    let solve = |b: &DVector<f64>| -> Option<LinkState> {
        let found = svd.solve(b, MIN_SINGULAR * largest).ok()?;
        Some(LinkState::from_fn(|i, _| found[i] / scales[i]))
    };
    let mut move_by_unknown = DMatrix::zeros(4, by_unknown.ncols());
    for k in 0..by_unknown.ncols() {
        move_by_unknown.set_column(k, &solve(&by_unknown.column(k).into_owned())?);
    }
    Some(ProjectedSegment {
        matrix: columns.transpose() * &columns,
        slope: columns.transpose() * rest,
        move_held: solve(residuals)?,
        move_by_unknown,
    })
}
