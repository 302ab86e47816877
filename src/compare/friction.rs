//! Friction measured from the deflection of the blade in a recording.
//!
//! A blade whose links turn slowly is in equilibrium, so that the deflection `tip_x - head_x` determines both
//! angles, the normal force and the coefficient of friction.

use super::condition::{ConditionComparison, TimedRecording};
use crate::fit::job::Job;
use crate::fit::result::FitResult;
use crate::model::friction::FrictionLaw;
use crate::recording::channel::Channel;
use crate::simulate::equilibrium::static_deflections;
use portable_math as math;

/// Coefficient of friction at a speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FrictionPoint {
    /// Mean speed of the tip, m/s.
    pub speed_m_per_s: f64,
    /// Ratio of friction force to normal force.
    pub coefficient: f64,
}

/// Length of a block of steady sliding, s.
const STEADY_BLOCK_S: f64 = 5e-3;
/// Minimum number of frames in a block.
const MIN_BLOCK_FRAMES: usize = 8;
/// The tip counts as sliding steadily if the scatter of its positions about a parabola, divided by the
/// standard deviation of the noise, is at most this value.
const MAX_SCATTER_OVER_NOISE: f64 = 1.2;
/// Largest allowed change of the speed of the tip within a block, as a fraction of the mean speed in the
/// block.
const MAX_SPEED_CHANGE: f64 = 0.4;
/// The tip counts as moving if its speed exceeds this number of standard deviations of the speed that would
/// be measured for a tip at rest.
const MIN_SPEED_SD: f64 = 5.0;
/// Maximum number of measured points.
const MAX_POINTS: usize = 60;

/// Coefficients of friction during steady sliding of the recorded tip; none if tip or head was not tracked,
/// and none of a slider, whose inertia is not small beside friction.
pub(crate) fn measure_steady_friction(case: &ConditionComparison) -> Vec<FrictionPoint> {
    let Some(side) = case.measured_side().filter(|_| !case.model.scene.linkage.is_slider()) else {
        return Vec::new();
    };
    let mut deflections = static_deflections(&case.model.scene.linkage);
    deflections.iter_mut().for_each(|(_, deflection_m)| *deflection_m += case.alignment.tip_m);
    let blocks = steady_blocks(&side, case.noise_m(Channel::TipX).unwrap_or(0.0));
    let found: Vec<FrictionPoint> = blocks.iter().filter_map(|b| b.friction_point(&deflections)).collect();
    let every = found.len().div_ceil(MAX_POINTS).max(1);
    found.into_iter().step_by(every).collect()
}

/// A block of frames in which the tip slides steadily in one direction.
#[derive(Debug, Clone, Copy)]
struct FrictionBlock {
    /// Mean velocity of the tip, m/s.
    velocity_m_per_s: f64,
    deflection_m: f64,
}

impl FrictionBlock {
    /// The coefficient of friction for which the mean deflection of the block is in static equilibrium. It is
    /// interpolated in `deflections`, which lists pairs (coefficient of friction, static deflection in m) in
    /// ascending order.
    fn friction_point(&self, deflections: &[(f64, f64)]) -> Option<FrictionPoint> {
        let after = deflections.partition_point(|(_, deflection_m)| *deflection_m < self.deflection_m);
        let (a, b) = (deflections.get(after.checked_sub(1)?)?, deflections.get(after)?);
        let share = (self.deflection_m - a.1) / (b.1 - a.1);
        let coefficient = (a.0 + share * (b.0 - a.0)) * self.velocity_m_per_s.signum();
        Some(FrictionPoint { speed_m_per_s: self.velocity_m_per_s.abs(), coefficient })
    }
}

/// Divides a recording into blocks, and returns those in which the tip slides steadily in one direction.
fn steady_blocks(side: &TimedRecording, noise_m: f64) -> Vec<FrictionBlock> {
    let grid = side.recording.grid();
    let frames = ((STEADY_BLOCK_S * grid.frame_rate_hz).round() as usize).max(MIN_BLOCK_FRAMES);
    let (tip, deflection) = (side.samples(Channel::TipX), side.samples(Channel::Deflection));
    let block = |(tip, deflection): (&[Option<f64>], &[Option<f64>])| {
        let path = TipParabola::fit(tip, 1.0 / grid.frame_rate_hz)?;
        let present: Vec<f64> = deflection.iter().flatten().copied().collect();
        if present.len() < MIN_BLOCK_FRAMES {
            return None;
        }
        let least = MIN_SPEED_SD * noise_m / STEADY_BLOCK_S;
        let changes = path.curvature_m_per_s2.abs() * STEADY_BLOCK_S;
        let is_steady = path.velocity_m_per_s.abs() > least
            && changes < MAX_SPEED_CHANGE * path.velocity_m_per_s.abs()
            && path.scatter_m <= MAX_SCATTER_OVER_NOISE * noise_m;
        is_steady.then(|| FrictionBlock {
            velocity_m_per_s: path.velocity_m_per_s,
            deflection_m: present.iter().sum::<f64>() / present.len() as f64,
        })
    };
    tip.chunks(frames).zip(deflection.chunks(frames)).filter_map(block).collect()
}

/// Parabola fitted to the positions of the tip in a block.
struct TipParabola {
    velocity_m_per_s: f64,
    curvature_m_per_s2: f64,
    scatter_m: f64,
}

impl TipParabola {
    /// Least-squares fit; `None` with fewer than [`MIN_BLOCK_FRAMES`] tracked frames.
    fn fit(samples: &[Option<f64>], frame_s: f64) -> Option<Self> {
        let middle = 0.5 * (samples.len() as f64 - 1.0);
        let samples = samples.iter().enumerate();
        let points: Vec<(f64, f64)> =
            samples.filter_map(|(i, x)| Some(((i as f64 - middle) / middle, (*x)?))).collect();
        if points.len() < MIN_BLOCK_FRAMES {
            return None;
        }
        let mut normal = nalgebra::Matrix3::<f64>::zeros();
        let mut right = nalgebra::Vector3::<f64>::zeros();
        let origin = points.first()?.1;
        for (t, x) in &points {
            let row = nalgebra::Vector3::new(1.0, *t, t * t);
            normal += row * row.transpose();
            right += row * (x - origin);
        }
        let found = normal.cholesky()?.solve(&right);
        let left = points.iter().map(|(t, x)| x - origin - found[0] - found[1] * t - found[2] * t * t);
        let scatter = left.map(|x| x * x).sum::<f64>() / (points.len() - 3) as f64;
        let unit_s = middle * frame_s;
        Some(Self {
            velocity_m_per_s: found[1] / unit_s,
            curvature_m_per_s2: 2.0 * found[2] / (unit_s * unit_s),
            scatter_m: scatter.sqrt(),
        })
    }
}

// Confidence band of the fitted friction law.

/// A coefficient of the friction law.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LawCoefficient {
    /// Name in a scene.
    pub name: &'static str,
    /// Symbol in the law.
    pub symbol: &'static str,
    /// Returns the derivative of the friction law with respect to this coefficient, at a speed of the tip in
    /// m/s.
    slope: fn(&FrictionLaw, f64) -> f64,
}

/// The coefficients of `A exp(-B |v|) + C + V |v|`.
pub(crate) const COEFFICIENTS: [LawCoefficient; 4] = [
    LawCoefficient { name: "friction.a", symbol: "A", slope: |law, v| math::exp(-law.b_s_per_m * v) },
    LawCoefficient {
        name: "friction.b_s_per_m",
        symbol: "B",
        slope: |law, v| -law.a * v * math::exp(-law.b_s_per_m * v),
    },
    LawCoefficient { name: "friction.c", symbol: "C", slope: |_, _| 1.0 },
    LawCoefficient { name: "friction.viscous_s_per_m", symbol: "V", slope: |_, v| v },
];

/// Returns the half width of an interval of the coefficient of friction at a speed of the tip in m/s.
pub(crate) type HalfInterval = Box<dyn Fn(f64) -> f64>;

/// Half width of the 95 % interval of the coefficient of friction, propagated linearly from the intervals and
/// correlations of the fitted coefficients. `None` if no coefficient is fitted, if the fit does not identify
/// one of them, or if a correlation is unknown.
pub(crate) fn friction_half_95(job: &Job, result: &FitResult, law: &FrictionLaw) -> Option<HalfInterval> {
    /// A speed, m/s, at which every coefficient has an effect.
    const ANY_SPEED: f64 = 0.1;
    let (spread, law) = (result.parameter_spread(), *law);
    let slope = |(name, half): (&String, &Option<f64>)| {
        let fitted = COEFFICIENTS.iter().find(|c| c.name == name && is_fitted(job, c));
        fitted.map_or(Some(None), |fitted| Some(Some((fitted.slope, (*half)?))))
    };
    let slopes: Vec<_> = spread.names.iter().zip(&spread.halves_95).map(slope).collect::<Option<_>>()?;
    let is_any_fitted = slopes.iter().any(Option::is_some);
    let half = move |v: f64| {
        let moved = slopes.iter().map(|fitted| fitted.map_or(0.0, |(slope, half)| slope(&law, v) * half));
        spread.propagate_95(&moved.collect::<Vec<f64>>())
    };
    half(ANY_SPEED).filter(|_| is_any_fitted)?;
    Some(Box::new(move |v| half(v).unwrap_or(f64::NAN)))
}

/// Whether a job fits a coefficient.
pub(crate) fn is_fitted(job: &Job, coefficient: &LawCoefficient) -> bool {
    job.parameters.iter().any(|p| p.name == coefficient.name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Linkage;
    use crate::simulate::equilibrium::steady_slip_pose;
    use crate::simulate::scene::Scene;

    fn linkage() -> Linkage {
        let text = include_str!("../../data/scenes/actual-blade.toml");
        Scene::parse("s", text).unwrap().linkage
    }

    #[test]
    fn the_deflection_of_a_blade_that_slides_gives_its_friction_back() {
        let linkage = linkage();
        let deflections = static_deflections(&linkage);
        for velocity_m_per_s in [-0.3, -0.05, 0.02, 0.2] {
            let pose = steady_slip_pose(&linkage, velocity_m_per_s).unwrap();
            let d = crate::model::LinkDirections::from_pose(&pose);
            let block = FrictionBlock {
                velocity_m_per_s,
                deflection_m: linkage.l1_m * d.sin_theta + linkage.l2_m * d.sin_phi,
            };
            let found = block.friction_point(&deflections).unwrap();
            let (speed, direction) = (velocity_m_per_s.abs(), velocity_m_per_s.signum());
            let law = linkage.friction.dynamic_coefficient(speed, direction);
            assert!((found.coefficient - law).abs() < 1e-4, "{velocity_m_per_s}: {found:?} {law}");
        }
    }

    #[test]
    fn a_parabola_is_found_with_its_scatter() {
        let place = |i: u32| 0.03 + 0.2 * f64::from(i) * 1e-3 + 0.5 * 4.0 * (f64::from(i) * 1e-3).powi(2);
        let noise = |i: u32| if i.is_multiple_of(2) { 1e-6 } else { -1e-6 };
        let samples: Vec<Option<f64>> = (0..40).map(|i| (i != 11).then(|| place(i) + noise(i))).collect();
        let found = TipParabola::fit(&samples, 1e-3).unwrap();
        assert!((found.velocity_m_per_s - (0.2 + 4.0 * 19.5e-3)).abs() < 1e-4, "{}", found.velocity_m_per_s);
        assert!((found.curvature_m_per_s2 - 4.0).abs() < 0.05 && (found.scatter_m - 1e-6).abs() < 2e-7);
        assert!(TipParabola::fit(&samples[..5], 1e-3).is_none());
    }
}
