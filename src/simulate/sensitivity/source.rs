//! Sources of the directions: elementary changes of the linkage's constants and of the head's motion.

use super::stretch::SeriesReference;
use crate::model::tangent::{
    ForcingTerms, HeadMotionChange, LaneVector, LinkAttitudes, LinkageConstant, MotionSamples,
};
use crate::simulate::drive::Drive;

/// An elementary change; a direction is a sum of elementary changes, each with a factor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TangentSource {
    Constant(LinkageConstant),
    /// Changes the head's motion `x(t)` by `x`.
    HeadScale,
    /// Changes the head's motion `x(t)` by `-x'`.
    HeadDelay,
    /// Changes the head's motion `x(t)` by `t * x'`.
    HeadStretch,
}

/// Maximum number of sources: the constants of the linkage and the changes of the head's motion.
pub(super) const MOST_SOURCES: usize = 28;

/// Taylor polynomial of the head's motion about the start of a piece.
#[derive(Debug, Clone)]
pub(super) struct HeadPolynomial<'a> {
    start_s: f64,
    position_m: f64,
    /// Coefficients of the velocity; that of the power `k` of time is in m/s^(k+1). Zeros at the end are left
    /// out, because the polynomial of a recorded head is short.
    velocity: &'a [f64],
}

impl<'a> HeadPolynomial<'a> {
    /// The polynomial for these sources; `None` if none of the sources moves the head.
    pub(crate) fn from_drive(
        sources: &[TangentSource],
        drive: &Drive,
        start_s: f64,
        velocity: &'a [f64],
    ) -> Option<Self> {
        sources.iter().find(|source| !matches!(source, TangentSource::Constant(_)))?;
        let used = velocity.iter().rposition(|&v| v != 0.0).map_or(0, |last| last + 1);
        let is_scaled = sources.contains(&TangentSource::HeadScale);
        let position_m = if is_scaled { drive.motion_at(start_s).position_m } else { 0.0 };
        Some(Self { start_s, position_m, velocity: &velocity[..used] })
    }

    /// Position of the head at the times `x` after the start of the piece, m.
    fn position(&self, x: LaneVector) -> LaneVector {
        let mut sum = LaneVector::ZERO;
        for (k, v) in self.velocity.iter().enumerate().rev() {
            sum = sum * x + LaneVector::splat(v / (k + 1) as f64);
        }
        LaneVector::splat(self.position_m) + sum * x
    }

    /// Velocity, acceleration and jerk of the head at the times `x` after the start of the piece.
    fn motion_rates(&self, x: LaneVector) -> [LaneVector; 3] {
        let mut sums = [LaneVector::ZERO; 3];
        for (k, &v) in self.velocity.iter().enumerate().rev() {
            let power = k as f64;
            let [velocity, acceleration, jerk] = &mut sums;
            *velocity = *velocity * x + LaneVector::splat(v);
            if k > 0 {
                *acceleration = *acceleration * x + LaneVector::splat(power * v);
            }
            if k > 1 {
                *jerk = *jerk * x + LaneVector::splat(power * (power - 1.0) * v);
            }
        }
        sums
    }

    /// Change of the head's position by a source, m.
    pub(crate) fn position_change(&self, source: TangentSource, x: LaneVector) -> LaneVector {
        let coefficients = self.velocity.iter().rev();
        let velocity = || coefficients.fold(LaneVector::ZERO, |sum, &c| sum * x + LaneVector::splat(c));
        match source {
            TangentSource::Constant(_) => LaneVector::ZERO,
            TangentSource::HeadScale => self.position(x),
            TangentSource::HeadDelay => -velocity(),
            TangentSource::HeadStretch => (LaneVector::splat(self.start_s) + x) * velocity(),
        }
    }

    /// Changes of the head's position, velocity and acceleration by a source; `None` for a constant of the
    /// linkage.
    fn motion_change(&self, source: TangentSource, x: LaneVector) -> Option<HeadMotionChange> {
        if let TangentSource::Constant(_) = source {
            return None;
        }
        let ([v, a, jerk], t) = (self.motion_rates(x), LaneVector::splat(self.start_s) + x);
        Some(match source {
            TangentSource::HeadDelay => [-v, -a, -jerk],
            TangentSource::HeadStretch => [t * v, v + t * a, 2.0 * a + t * jerk],
            _ => [self.position(x), v, a],
        })
    }
}

impl TangentSource {
    /// Whether the source affects this motion.
    pub(crate) fn affects_motion(self, course: &SeriesReference<'_>) -> bool {
        match self {
            Self::Constant(constant) => course.depends_on(constant),
            _ => true,
        }
    }

    /// Whether the source displaces head or tip at fixed angles.
    pub(crate) fn displaces_points(self, course: &SeriesReference<'_>) -> bool {
        match self {
            Self::Constant(constant) => course.displaces_points(constant),
            _ => true,
        }
    }

    /// Forcing terms of a unit change by the source in the equations of the variation.
    #[inline(always)]
    pub(crate) fn forcing_terms(
        self,
        course: &SeriesReference<'_>,
        head: Option<&HeadPolynomial<'_>>,
        at: &MotionSamples,
    ) -> ForcingTerms {
        match self {
            Self::Constant(constant) => course.constant_forcing(at, constant),
            _ => head
                .and_then(|head| head.motion_change(self, at.x))
                .map_or_else(ForcingTerms::default, |shift| course.head_motion_forcing(at, &shift)),
        }
    }

    /// Displacements of head and tip by a unit change by the source.
    pub(crate) fn displacement_terms(
        self,
        course: &SeriesReference<'_>,
        head: Option<&HeadPolynomial<'_>>,
        at: &LinkAttitudes,
    ) -> ForcingTerms {
        match self {
            Self::Constant(constant) => course.displacement_terms(at, constant),
            _ => head.and_then(|head| head.motion_change(self, at.x)).map_or_else(
                ForcingTerms::default,
                |shift| ForcingTerms { head: shift[0], tip: shift, ..ForcingTerms::default() },
            ),
        }
    }
}
