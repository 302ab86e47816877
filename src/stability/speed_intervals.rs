//! Intervals of speed in which steady sliding is stable, unstable or impossible.

use super::steady_sliding::{NoSliding, SlideFinder, SlidingMode, SteadySlide};
use serde::{Deserialize, Serialize};

/// What happens to steady sliding at the speeds of an interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "state", content = "reason", rename_all = "kebab-case")]
pub enum SlidingState {
    /// Every small vibration decays.
    Stable,
    /// A small vibration grows.
    Unstable,
    /// The blade cannot slide steadily.
    Impossible(NoSliding),
}

/// An interval of speed with one state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SpeedInterval {
    /// Lowest and highest speed, m/s.
    pub speeds_m_per_s: [f64; 2],
    /// State of steady sliding.
    #[serde(flatten)]
    pub state: SlidingState,
    /// The mode that grows fastest, just inside the lowest and the highest speed; `None` unless the state is
    /// unstable.
    #[serde(rename = "modes_at_ends")]
    pub modes: Option<[SlidingMode; 2]>,
}

/// A mode counts as growing if its growth, divided by the highest natural angular frequency of the links, is
/// above this value. The value is far above the rounding errors of an undamped mode.
const NEUTRAL: f64 = 1e-9;

/// Equally spaced values of a range; both ends are exact.
pub(super) fn spread_values([from, to]: [f64; 2], points: usize) -> impl Iterator<Item = f64> {
    let last = points.max(2) - 1;
    (0..=last).map(move |i| if i == last { to } else { from + (to - from) * i as f64 / last as f64 })
}

impl SlideFinder {
    /// Growth of the leading mode of a slide minus the least growth that counts as growing, 1/s.
    fn excess_of(&self, slide: &SteadySlide) -> f64 {
        slide.leading_mode().growth_per_s - NEUTRAL * self.fastest_rad_per_s
    }

    fn excess_per_s(&mut self, speed_m_per_s: f64) -> Result<f64, NoSliding> {
        self.find_slide(speed_m_per_s).map(|slide| self.excess_of(&slide))
    }

    /// State of steady sliding at a speed, m/s.
    pub fn sliding_state(&mut self, speed_m_per_s: f64) -> SlidingState {
        state_from_excess(self.excess_per_s(speed_m_per_s))
    }

    /// Finds where a state ends between two speeds, m/s: `inside` has this state and `outside` has another.
    /// Returns a speed next to the boundary that has the state, one that has another, and this other state.
    pub(super) fn bisect_state(
        &mut self,
        state: SlidingState,
        [mut inside, mut outside]: [f64; 2],
    ) -> ([f64; 2], SlidingState) {
        /// Relative width at which bisection ends; it is above the rounding errors of the growth.
        const WIDTH: f64 = 1e-11;
        let mut after = self.sliding_state(outside);
        while (outside - inside).abs() > WIDTH * outside.abs().max(inside.abs()) {
            let middle = 0.5 * (inside + outside);
            let found = self.sliding_state(middle);
            if found == state {
                inside = middle;
            } else {
                (outside, after) = (middle, found);
            }
        }
        ([inside, outside], after)
    }

    /// Divides a range of speed, m/s, into intervals of one state. The state is computed at `points` equally
    /// spaced speeds and at extrema of the growth between them; a boundary between two of these speeds is
    /// found by bisection. An interval narrower than the spacing can be missed.
    #[must_use]
    pub fn find_intervals(&mut self, range: [f64; 2], points: usize) -> Vec<SpeedInterval> {
        let slides: Vec<_> =
            spread_values(range, points).map(|speed| (speed, self.find_slide(speed))).collect();
        self.divide_range(slides.iter().map(|(speed, slide)| (*speed, slide.as_ref())))
    }

    /// As [`Self::find_intervals`], with the slides at equally spaced speeds.
    pub(super) fn divide_range<'a>(
        &mut self,
        slides: impl Iterator<Item = (f64, Result<&'a SteadySlide, &'a NoSliding>)>,
    ) -> Vec<SpeedInterval> {
        let excess = |slide: Result<&SteadySlide, &NoSliding>| match slide {
            Ok(slide) => Ok(self.excess_of(slide)),
            Err(reason) => Err(*reason),
        };
        let mut samples: Vec<(f64, Result<f64, NoSliding>)> =
            slides.map(|(speed, slide)| (speed, excess(slide))).collect();
        let hidden: Vec<_> = samples.windows(3).filter_map(|three| self.find_hidden_state(three)).collect();
        samples.extend(hidden);
        portable_math::sort_by_number(&mut samples, |a| a.0);
        let mut found = Vec::new();
        let mut start = samples[0].0;
        for pair in samples.windows(2) {
            let [(a, before), (b, after)] = [pair[0], pair[1]];
            let (mut state, mut at) = (state_from_excess(before), a);
            let last = state_from_excess(after);
            // several states can end between two neighbouring speeds
            while state != last && at < b {
                let ([end, next], beyond) = self.bisect_state(state, [at, b]);
                found.push(self.describe_interval([start, end], state));
                (start, at) = (next, next);
                state = if next < b { beyond } else { last };
            }
        }
        let (to, excess) = samples[samples.len() - 1];
        found.push(self.describe_interval([start, to], state_from_excess(excess)));
        found
    }

    fn describe_interval(&mut self, speeds_m_per_s: [f64; 2], state: SlidingState) -> SpeedInterval {
        let mut mode = |speed| self.find_slide(speed).ok().map(|slide| slide.leading_mode());
        let modes = match state {
            SlidingState::Unstable => mode(speeds_m_per_s[0]).zip(mode(speeds_m_per_s[1])),
            _ => None,
        };
        SpeedInterval { speeds_m_per_s, state, modes: modes.map(|(low, high)| [low, high]) }
    }

    /// A speed of another state, with its excess, near an extremum of the growth between three equally spaced
    /// speeds of one state; `None` if the growth has no extremum there or does not change sign.
    fn find_hidden_state(
        &mut self,
        three: &[(f64, Result<f64, NoSliding>)],
    ) -> Option<(f64, Result<f64, NoSliding>)> {
        /// Steps of the golden-section search; they reduce the interval to 1e-5 of its length.
        const STEPS: usize = 24;
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        let [left, middle, right] = [three[0].1.ok()?, three[1].1.ok()?, three[2].1.ok()?];
        let sign = if middle <= 0.0 { 1.0 } else { -1.0 };
        let is_one_state = [left, middle, right].iter().all(|excess| (*excess > 0.0) == (middle > 0.0));
        if !is_one_state || sign * middle < sign * left || sign * middle < sign * right {
            return None;
        }
        let [mut low, mut high] = [three[0].0, three[2].0];
        for _ in 0..STEPS {
            let inner = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)];
            let [a, b] = [self.excess_per_s(inner[0]).ok()?, self.excess_per_s(inner[1]).ok()?];
            let (best, excess) = if sign * a > sign * b { (inner[0], a) } else { (inner[1], b) };
            if (excess > 0.0) != (middle > 0.0) {
                return Some((best, Ok(excess)));
            }
            if sign * a > sign * b {
                high = inner[1];
            } else {
                low = inner[0];
            }
        }
        None
    }
}

fn state_from_excess(excess: Result<f64, NoSliding>) -> SlidingState {
    match excess {
        Ok(excess) if excess > 0.0 => SlidingState::Unstable,
        Ok(_) => SlidingState::Stable,
        Err(reason) => SlidingState::Impossible(reason),
    }
}

/// The lowest and the highest speed, m/s, at which steady sliding is unstable; `None` if it is stable
/// wherever it is possible.
#[must_use]
pub fn unstable_range(intervals: &[SpeedInterval]) -> Option<[f64; 2]> {
    let mut unstable = intervals.iter().filter(|interval| interval.state == SlidingState::Unstable);
    let first = unstable.next()?;
    let last = unstable.next_back().unwrap_or(first);
    Some([first.speeds_m_per_s[0], last.speeds_m_per_s[1]])
}
