//! Traces turned about a point, as if the camera had been level.

use super::Traces;
use crate::math;

/// Why traces cannot be turned.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "the {point} has only one of x and y in {frames} frames, the first is frame {first}; expected both or \
     neither, because a rotation mixes them"
)]
pub struct RotationError {
    /// `tip` or `head`.
    pub point: &'static str,
    /// Frames with one coordinate alone.
    pub frames: usize,
    /// The first of them.
    pub first: usize,
}

/// Both points turned clockwise by `angle_rad` about `centre_m` (x and y, m), so that a line that rises by
/// this angle along x becomes level.
///
/// # Errors
/// [`RotationError`] where a point has one coordinate alone.
pub fn rotate_traces(traces: &Traces, angle_rad: f64, centre_m: [f64; 2]) -> Result<Traces, RotationError> {
    let turn = |point, x: &[Option<f64>], y: &[Option<f64>]| {
        check_coordinate_pairs(point, x, y)?;
        let places = x.iter().zip(y).map(|(x, y)| Some(rotate_point([(*x)?, (*y)?], angle_rad, centre_m)));
        Ok::<(Vec<_>, Vec<_>), RotationError>(places.map(|p| (p.map(|p| p[0]), p.map(|p| p[1]))).unzip())
    };
    let (tip_x_m, tip_y_m) = turn("tip", &traces.tip_x_m, &traces.tip_y_m)?;
    let (head_x_m, head_y_m) = turn("head", &traces.head_x_m, &traces.head_y_m)?;
    Ok(Traces { tip_x_m, tip_y_m, head_x_m, head_y_m, ..traces.clone() })
}

fn rotate_point([x, y]: [f64; 2], angle_rad: f64, centre_m: [f64; 2]) -> [f64; 2] {
    let ((sin, cos), [from_x, from_y]) = (math::sin_cos(angle_rad), [x - centre_m[0], y - centre_m[1]]);
    [centre_m[0] + cos * from_x + sin * from_y, centre_m[1] - sin * from_x + cos * from_y]
}

fn check_coordinate_pairs(
    point: &'static str,
    x: &[Option<f64>],
    y: &[Option<f64>],
) -> Result<(), RotationError> {
    let mut alone = x.iter().zip(y).enumerate().filter(|(_, (x, y))| x.is_some() != y.is_some());
    match alone.next() {
        Some((first, _)) => Err(RotationError { point, frames: 1 + alone.count(), first }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_that_rises_becomes_level_and_lengths_stay() {
        let (angle_rad, centre_m) = (0.3_f64.to_radians(), [0.04, -0.005]);
        let x: Vec<Option<f64>> = (0..90).map(|i| (i != 7).then_some(1e-3 * f64::from(i))).collect();
        let y = |above: f64| {
            let rise = move |x: f64| centre_m[1] + (x - centre_m[0]) * angle_rad.tan() + above;
            x.iter().map(|x| x.map(rise)).collect::<Vec<_>>()
        };
        let traces = Traces {
            tip_x_m: x.clone(),
            tip_y_m: y(0.0),
            head_x_m: x.clone(),
            head_y_m: y(5e-3),
            ..Traces::default()
        };
        let level = rotate_traces(&traces, angle_rad, centre_m).unwrap();
        assert!(level.tip_y_m.iter().flatten().all(|y| (y - centre_m[1]).abs() < 1e-16));
        assert_eq!((level.tip_x_m[7], level.tip_y_m[7]), (None, None));
        let apart = level.head_x_m[0].unwrap() - level.tip_x_m[0].unwrap();
        assert!((apart - 5e-3 * angle_rad.sin()).abs() < 1e-16, "{apart}");
        let back = rotate_traces(&level, -angle_rad, centre_m).unwrap();
        let same = |a: &[Option<f64>], b: &[Option<f64>]| {
            a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-16)
        };
        assert!(same(&back.head_x_m, &traces.head_x_m) && same(&back.head_y_m, &traces.head_y_m));
    }

    #[test]
    fn a_coordinate_alone_is_refused() {
        let traces = Traces {
            tip_x_m: vec![Some(1.0); 3],
            tip_y_m: vec![Some(1.0); 3],
            head_x_m: vec![Some(1.0); 3],
            head_y_m: vec![Some(1.0), None, None],
            ..Traces::default()
        };
        let refused = rotate_traces(&traces, 0.1, [0.0; 2]).unwrap_err();
        assert_eq!(refused, RotationError { point: "head", frames: 2, first: 1 });
    }
}
