//! Steady sliding of a blade or slider and the eigenvalues of its small vibrations.
//!
//! At a constant speed of the head the blade can slide in an equilibrium. The first variation of the motion
//! about it ([`crate::model::tangent`]) has constant coefficients, `M y'' + D y' + K y = 0`. Its eigenvalues
//! give growth and frequency of each mode. `D` includes the slope of the friction law, and `M` and `K` are
//! not symmetric, because friction follows the normal force.

use crate::model::modes::time_scales_rad_per_s;
use crate::model::series::{ContactMode, MotionSeries};
use crate::model::shoulder::ShoulderContact;
use crate::model::tangent::{LaneVector, ReferenceMotion};
use crate::model::{HeadMotion, LinkDirections, Linkage, Pose};
use crate::simulate::equilibrium::{StaticPose, is_upright, shoulder_contact};
use nalgebra::{Complex, DMatrix, Schur};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Why a blade or slider cannot slide steadily.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoSliding {
    /// There is no equilibrium, for a blade none with both links above level.
    NoEquilibrium,
    /// The glass would have to pull the tip.
    ContactLost,
    /// The Painlevé condition fails, so the tip jams, or the eigenvalues are not finite.
    Jammed,
}

impl NoSliding {
    /// Meaning as part of a sentence.
    #[must_use]
    pub fn meaning(self) -> &'static str {
        match self {
            Self::NoEquilibrium => "there is no equilibrium, or none with both links above level",
            Self::ContactLost => "contact is lost: the glass would have to pull the tip",
            Self::Jammed => "the Painlevé condition fails: no normal force is admissible and the tip jams",
        }
    }
}

/// Growth and frequency of a mode of small vibrations about steady sliding.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SlidingMode {
    /// Rate of growth, 1/s; negative for a mode that decays.
    pub growth_per_s: f64,
    /// Frequency, Hz; 0 for a mode that does not oscillate.
    pub frequency_hz: f64,
    /// Kind of the instability if the mode grows.
    pub instability: Instability,
    /// Frequency band of the noise; `None` for a mode that does not oscillate.
    pub band: Option<NoiseBand>,
}

impl SlidingMode {
    fn from_eigenvalue(value: Complex<f64>) -> Self {
        let frequency_hz = value.im / TAU;
        let instability = if frequency_hz > 0.0 { Instability::Flutter } else { Instability::Divergence };
        let band = (frequency_hz > 0.0).then(|| NoiseBand::from_frequency(frequency_hz));
        Self { growth_per_s: value.re, frequency_hz, instability, band }
    }
}

/// Kind of an instability.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Instability {
    /// A growing oscillation.
    Flutter,
    /// A growing deflection that does not oscillate.
    Divergence,
}

/// Frequency band of wiper noise (Goto, Takahashi and Oya 2001, Analysis of Wiper Vibration).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseBand {
    /// Chatter, below 100 Hz.
    Chatter,
    /// Reversal noise, near 500 Hz.
    ReversalNoise,
    /// Squeal, near 1 kHz.
    Squeal,
}

impl NoiseBand {
    /// The band of a frequency, Hz.
    #[must_use]
    pub fn from_frequency(frequency_hz: f64) -> Self {
        /// Upper limit of chatter, Hz.
        const CHATTER_HZ: f64 = 100.0;
        /// Limit between reversal noise and squeal: the geometric mean of 500 Hz and 1 kHz.
        const SQUEAL_HZ: f64 = 707.0;
        match frequency_hz {
            f if f < CHATTER_HZ => Self::Chatter,
            f if f < SQUEAL_HZ => Self::ReversalNoise,
            _ => Self::Squeal,
        }
    }

    /// Name in words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Chatter => "chatter",
            Self::ReversalNoise => "reversal noise",
            Self::Squeal => "squeal",
        }
    }
}

/// An equilibrium of steady sliding.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SteadySlide {
    /// The pose, at rest relative to the head.
    pub pose: Pose,
    /// Side of the shoulder on which the neck leans.
    pub shoulder: ShoulderContact,
    /// Normal force on the tip, N.
    pub normal_n: f64,
    /// The modes in rising order of frequency; a pair of conjugate eigenvalues is one mode.
    pub modes: Vec<SlidingMode>,
}

impl SteadySlide {
    /// The mode that grows fastest.
    #[must_use]
    pub fn leading_mode(&self) -> SlidingMode {
        let faster = |best: SlidingMode, mode: &SlidingMode| {
            if mode.growth_per_s > best.growth_per_s { *mode } else { best }
        };
        self.modes.iter().fold(self.modes[0], faster)
    }
}

/// Finds the equilibria of steady sliding of a blade or slider in one direction. A search starts from the
/// equilibrium of the previous one.
#[derive(Debug, Clone)]
pub struct SlideFinder {
    linkage: Linkage,
    direction: f64,
    last: StaticPose,
    /// Least magnitude of the friction coefficient at which the search from the upright blade has failed.
    lost_from: f64,
    /// Highest natural angular frequency of the links, rad/s.
    pub(super) fastest_rad_per_s: f64,
}

impl SlideFinder {
    /// A finder for a blade that slides in a direction, +1 or -1.
    #[must_use]
    pub fn new(linkage: &Linkage, direction: f64) -> Self {
        let (_, fastest_rad_per_s) = time_scales_rad_per_s(linkage);
        Self {
            linkage: *linkage,
            direction,
            last: StaticPose::UPRIGHT,
            lost_from: f64::INFINITY,
            fastest_rad_per_s,
        }
    }

    /// The equilibrium at a speed, m/s, that the blade reaches when friction grows slowly. If the blade snaps
    /// over while friction grows, it is an equilibrium beyond the snap. The speed has no sign; 0 stands for
    /// the limit of slow sliding.
    ///
    /// # Errors
    /// [`NoSliding`] if the blade cannot slide steadily at this speed.
    pub fn find_slide(&mut self, speed_m_per_s: f64) -> Result<SteadySlide, NoSliding> {
        let found = self.find_static_pose(speed_m_per_s).ok_or(NoSliding::NoEquilibrium)?;
        self.last = found;
        self.linearise(&found, speed_m_per_s)
    }

    /// The equilibria at a speed, m/s, at which the neck is on another side of the shoulder than in
    /// [`Self::find_slide`].
    #[must_use]
    pub fn find_other_slides(&mut self, speed_m_per_s: f64) -> Vec<SteadySlide> {
        if self.linkage.shoulder.is_none() {
            return Vec::new();
        }
        let Some(found) = self.find_static_pose(speed_m_per_s) else { return Vec::new() };
        let own = shoulder_contact(&self.linkage, found.pose().theta);
        let sides = [ShoulderContact::Off, ShoulderContact::Forward, ShoulderContact::Backward];
        let others = sides.into_iter().filter(|side| *side != own);
        let others = others.filter_map(|side| found.lean_on_side(&self.linkage, side));
        others.filter_map(|pose| self.linearise(&pose, speed_m_per_s).ok()).collect()
    }

    fn find_static_pose(&mut self, speed_m_per_s: f64) -> Option<StaticPose> {
        let law = &self.linkage.friction;
        let mu = self.direction * law.dynamic_coefficient(speed_m_per_s, self.direction);
        if let Some(near) = self.last.change_friction(&self.linkage, mu) {
            return Some(near);
        }
        if mu.abs() < self.lost_from {
            if let Some(reached) = StaticPose::UPRIGHT.change_friction(&self.linkage, mu) {
                return Some(reached);
            }
            self.lost_from = mu.abs();
        }
        StaticPose::search_grid(&self.linkage, mu)
    }

    fn linearise(&self, at: &StaticPose, speed_m_per_s: f64) -> Result<SteadySlide, NoSliding> {
        let (linkage, direction, pose) = (&self.linkage, self.direction, at.pose());
        if !is_upright(&pose) {
            return Err(NoSliding::NoEquilibrium);
        }
        let (directions, shoulder) =
            (LinkDirections::from_pose(&pose), shoulder_contact(linkage, pose.theta));
        let velocity_m_per_s = direction * speed_m_per_s;
        let head = HeadMotion { position_m: 0.0, velocity_m_per_s, acceleration_m_per_s2: 0.0 };
        let response = linkage.friction_response(&pose, &directions, &head, shoulder);
        let mu = direction * linkage.friction.dynamic_coefficient(speed_m_per_s, direction);
        let normal_n =
            linkage.head.stiffness * (linkage.preload_displacement_m - linkage.head_drop_m(&directions));
        if normal_n <= 0.0 {
            return Err(NoSliding::ContactLost);
        }
        if 1.0 + mu * response.nu <= 0.0 {
            return Err(NoSliding::Jammed);
        }
        let mut motion = MotionSeries::<3>::default();
        motion.head_velocity[0] = velocity_m_per_s;
        motion.law_piece = linkage.friction.piece_at(speed_m_per_s);
        let touch = ContactMode::Slip(direction);
        motion.expand(linkage, touch, shoulder, &pose, 1);
        let reference = ReferenceMotion { linkage, touch, lean: shoulder, motion: &motion };
        let matrices = reference.tangent_matrices(&reference.sample_motion(LaneVector::ZERO));
        // the neck of a slider does not turn
        let first = usize::from(linkage.is_slider());
        let square = |rows: &[[LaneVector; 3]; 3]| {
            DMatrix::from_fn(2 - first, 2 - first, |i, j| rows[first + i][first + j][0])
        };
        let [mass, damping, stiffness] = [&matrices.mass, &matrices.damping, &matrices.stiffness].map(square);
        let modes = solve_modes(mass, &damping, &stiffness, self.fastest_rad_per_s);
        Ok(SteadySlide { pose, shoulder, normal_n, modes: modes.ok_or(NoSliding::Jammed)? })
    }
}

/// Modes of `M y'' + D y' + K y = 0` in rising order of frequency; `None` if they are not finite.
/// `scale` is an angular frequency of the blade, 1/s. Time in units of `1 / scale` makes the entries of the
/// state matrix similar in size.
fn solve_modes(
    mass: DMatrix<f64>,
    damping: &DMatrix<f64>,
    stiffness: &DMatrix<f64>,
    scale: f64,
) -> Option<Vec<SlidingMode>> {
    /// Largest number of steps of the QR iteration; four eigenvalues take about ten.
    const MOST_STEPS: usize = 400;
    let size = mass.nrows();
    let inverse = mass.try_inverse()?;
    let mut state = DMatrix::zeros(2 * size, 2 * size);
    state.view_mut((0, size), (size, size)).fill_with_identity();
    state.view_mut((size, 0), (size, size)).copy_from(&(-&inverse * stiffness / (scale * scale)));
    state.view_mut((size, size), (size, size)).copy_from(&(-&inverse * damping / scale));
    if !state.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let found = Schur::try_new(state, f64::EPSILON, MOST_STEPS)?.complex_eigenvalues();
    let upper = found.iter().filter(|value| value.im >= 0.0).map(|value| value * scale);
    let mut modes: Vec<SlidingMode> = upper.map(SlidingMode::from_eigenvalue).collect();
    modes.sort_by(|a, b| {
        a.frequency_hz.total_cmp(&b.frequency_hz).then(a.growth_per_s.total_cmp(&b.growth_per_s))
    });
    Some(modes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::friction::FrictionLaw;
    use crate::simulate::scene::Scene;

    fn light_blade() -> Linkage {
        Scene::parse("s", include_str!("../../data/scenes/light-blade.toml")).unwrap().linkage
    }

    /// The friction coefficient is almost zero but its slope is not, so the blade stays upright. A heavy neck
    /// on a stiff spring stays at rest, so the lip alone vibrates, as a mass on a belt:
    /// `m_phi phi'' + (c2 + mu' N l2^2) phi' + (k2 - N l2) phi = 0`.
    #[test]
    fn the_lip_alone_grows_as_a_mass_on_a_belt() {
        let mut blade = light_blade();
        blade.m_c = 0.0;
        (blade.neck.stiffness, blade.m_theta) = (1e9 * blade.neck.stiffness, 1e9 * blade.m_theta);
        let (steepness, speed) = (1e7, 2e-8);
        for slope in [0.0, 0.001, 0.01, 0.1] {
            blade.friction = FrictionLaw::exponential(slope / steepness, steepness, 0.0);
            let slide = SlideFinder::new(&blade, 1.0).find_slide(speed).unwrap();
            let normal_n = blade.head.stiffness * blade.preload_displacement_m;
            let law_slope = -slope * (-steepness * speed).exp();
            let per_rate = blade.l2_m * blade.l2_m * law_slope * normal_n;
            let growth = -(per_rate + blade.lip.damping) / (2.0 * blade.m_phi);
            let squared = (blade.lip.stiffness - normal_n * blade.l2_m) / blade.m_phi - growth * growth;
            let scale = squared.sqrt();
            let distance = |mode: &SlidingMode| (mode.frequency_hz * TAU - scale).abs();
            let mode = slide.modes.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap();
            assert!((mode.growth_per_s - growth).abs() < 1e-7 * scale, "{slope}: {mode:?}, {growth}");
            assert!((mode.frequency_hz * TAU - scale).abs() < 1e-7 * scale, "{slope}: {mode:?}, {scale}");
        }
    }

    /// The growth and frequency at a speed are the same after other searches as in a new search, and the same
    /// in both directions.
    #[test]
    fn a_search_does_not_depend_on_earlier_ones_or_on_the_direction() {
        let text = include_str!("../../data/scenes/actual-blade.toml");
        let blade = Scene::parse("s", text).unwrap().linkage;
        let mut moved = SlideFinder::new(&blade, 1.0);
        for speed in [0.4, 0.0, 0.3, 0.01, 0.2] {
            let near = moved.find_slide(speed).unwrap().leading_mode();
            for direction in [1.0, -1.0] {
                let fresh = SlideFinder::new(&blade, direction).find_slide(speed).unwrap().leading_mode();
                let scale = moved.fastest_rad_per_s;
                assert!((near.growth_per_s - fresh.growth_per_s).abs() < 1e-10 * scale);
                assert!((near.frequency_hz - fresh.frequency_hz).abs() < 1e-10 * scale);
            }
        }
    }
}
