//! Why a blade or slider chatters: the part whose natural frequency is nearest to that of the cycle, and how
//! much the growth by falling friction exceeds the decay by damping.

use super::cycle_branch::CycleBranch;
use super::steady_sliding::SlideFinder;
use crate::model::friction::FrictionLaw;
use crate::model::modes::named_frequencies;
use crate::simulate::scene::Scene;
use portable_math as math;

/// Cause of the chatter at a speed.
#[derive(Debug, Clone)]
pub struct ChatterCause {
    /// Speed of the head, m/s: about half of that at which the instability ends or, without an
    /// instability, of that at which the cycle ends.
    pub speed_m_per_s: f64,
    /// Frequency of the cycle at this speed, Hz.
    pub cycle_hz: f64,
    /// The part whose natural frequency is nearest: head, neck or lip, the neck on the shoulder, or a slider.
    pub part: String,
    /// The natural frequency of this part, Hz.
    pub natural_hz: f64,
    /// Change of the friction coefficient per change of the speed, s/m.
    pub friction_slope_s_per_m: f64,
    /// The mode of steady sliding that grows fastest or decays most slowly, if steady sliding is possible.
    pub growth: Option<ModeGrowth>,
}

/// Growth of a mode of steady sliding, with its parts.
#[derive(Debug, Clone, Copy)]
pub struct ModeGrowth {
    /// Growth, 1/s.
    pub total_per_s: f64,
    /// Growth of the same mode if friction had the same value but did not change with speed, 1/s. It is
    /// negative if damping outweighs everything else.
    pub constant_friction_per_s: f64,
}

impl ModeGrowth {
    /// Growth by falling friction, divided by the decay without it; `None` if there is no such decay.
    #[must_use]
    pub fn feeding_over_damping(&self) -> Option<f64> {
        let damping = -self.constant_friction_per_s;
        (damping > 0.0).then(|| (self.total_per_s + damping) / damping)
    }
}

impl ChatterCause {
    /// The cause of the cycle of a scene. `unstable` are the speeds, m/s, between which steady sliding is
    /// unstable; the cause is examined at half of the higher one, or of the speed at which the cycle ends.
    pub(super) fn from_branch(
        scene: &Scene,
        branch: &CycleBranch,
        unstable: Option<[f64; 2]>,
    ) -> Option<Self> {
        let (linkage, direction) = (&scene.linkage, branch.direction);
        let wanted = 0.5 * unstable.map_or(branch.end_m_per_s, |[_, end]| end);
        let away = |speed: f64| (speed - wanted).abs();
        let cycle =
            branch.cycles().iter().min_by(|a, b| away(a.speed_m_per_s).total_cmp(&away(b.speed_m_per_s)))?;
        let speed = cycle.speed_m_per_s;
        // a cycle with several sticks has a vibration for each of them
        let cycle_hz = cycle.sticks_s.len().max(1) as f64 * cycle.frequency_hz();
        let mut parts = named_frequencies(linkage);
        if let (Some(shoulder), Some((_, free_hz))) =
            (&linkage.shoulder, parts.iter().find(|(name, _)| name == "neck"))
        {
            let stiffer = 1.0 + shoulder.stiffness_n_m_per_rad / linkage.neck.stiffness;
            let leaning = ("neck on the shoulder".to_owned(), free_hz * stiffer.sqrt());
            parts.push(leaning);
        }
        let distance = |hz: f64| math::ln(hz / cycle_hz).abs();
        let (part, natural_hz) = parts.into_iter().min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)))?;
        let mu = |speed: f64| linkage.friction.dynamic_coefficient(speed, direction);
        let step = 1e-4 * speed;
        let friction_slope_s_per_m = (mu(speed + step) - mu(speed - step)) / (2.0 * step);
        let growth = || {
            let slide = SlideFinder::new(linkage, direction).find_slide(speed).ok()?;
            let mode = slide.leading_mode();
            let mut level = *linkage;
            level.friction = FrictionLaw::exponential(0.0, 0.0, mu(speed));
            let still = SlideFinder::new(&level, direction).find_slide(speed).ok()?;
            let far = |hz: f64| (hz - mode.frequency_hz).abs();
            let same = still.modes().min_by(|a, b| far(a.frequency_hz).total_cmp(&far(b.frequency_hz)))?;
            Some(ModeGrowth { total_per_s: mode.growth_per_s, constant_friction_per_s: same.growth_per_s })
        };
        Some(Self {
            speed_m_per_s: speed,
            cycle_hz,
            part,
            natural_hz,
            friction_slope_s_per_m,
            growth: growth(),
        })
    }
}
