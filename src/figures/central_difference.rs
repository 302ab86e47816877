//! Velocity of a tracked point by central differences of its positions, over a time that suits the noise.

/// Largest allowed ratio of the standard deviation of the velocity noise to the velocity range of a part.
/// With less noise than this, neighbouring cycles remain distinct.
pub(crate) const MAX_VELOCITY_NOISE: f64 = 0.1;
/// Longest time allowed between the two frames of a central difference, in periods of the fastest component.
/// A fifth of a period reduces the velocity amplitude by 6 %, in recording and model alike; at 900 Hz with 2
/// um of position noise, the velocity noise is 13 mm/s. With a twentieth of a period, the reduction would be
/// only 0.4 %, but the velocity noise 51 mm/s, a quarter of a typical velocity range.
const MAX_DIFFERENCE_PERIODS: f64 = 0.2;

/// Central difference: the velocity in a frame, from the positions in one frame before it and one equally far
/// after it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CentralDifference {
    /// Number of frames from the middle frame to either of the two frames.
    pub half_frames: usize,
    /// Frame rate, 1/s.
    pub frame_rate_hz: f64,
}

impl CentralDifference {
    /// The central difference between the frames directly before and after.
    pub(crate) fn of_neighbouring_frames(frame_rate_hz: f64) -> Self {
        Self { half_frames: 1, frame_rate_hz }
    }

    /// The central difference over the shortest time for which the velocity noise is below
    /// [`MAX_VELOCITY_NOISE`] times the velocity range `range_m_per_s`; `noise_m` is the standard deviation
    /// of the white position noise. The time between the two frames is at most a fifth of a period of
    /// `fastest_hz`, even if the noise is then larger. For an unknown `fastest_hz`, returns the difference
    /// between neighbouring frames.
    pub(crate) fn for_noise(rate_hz: f64, noise_m: f64, range_m_per_s: f64, fastest_hz: Option<f64>) -> Self {
        let shortest = Self::of_neighbouring_frames(rate_hz);
        let least = (shortest.noise_m_per_s(noise_m) / (MAX_VELOCITY_NOISE * range_m_per_s)).ceil();
        let quiet = if noise_m > 0.0 { least } else { 1.0 };
        let longest = fastest_hz.map_or(1.0, |hz| (MAX_DIFFERENCE_PERIODS * rate_hz / hz / 2.0).floor());
        Self { half_frames: quiet.min(longest).max(1.0) as usize, ..shortest }
    }

    /// Time between the two frames, s.
    pub(crate) fn frame_gap_s(&self) -> f64 {
        2.0 * self.half_frames as f64 / self.frame_rate_hz
    }

    /// Standard deviation, m/s, of the noise of the velocity: `sqrt(2)` times the standard deviation of the
    /// white position noise, m, divided by the time between the two frames, s.
    pub(crate) fn noise_m_per_s(&self, noise_m: f64) -> f64 {
        noise_m * std::f64::consts::SQRT_2 / self.frame_gap_s()
    }

    /// Time from the middle frame to either of the two frames, s.
    pub(crate) fn half_width_s(&self) -> f64 {
        self.half_frames as f64 / self.frame_rate_hz
    }

    /// Velocity, m/s, in each frame that has a frame `half_frames` before and after it; `None` if one of the
    /// three positions, m, is missing. The first value belongs to frame `half_frames`.
    pub(crate) fn velocities(&self, positions_m: &[Option<f64>]) -> Vec<Option<f64>> {
        let (half, apart_s) = (self.half_frames, self.frame_gap_s());
        let middle = |span: &[Option<f64>]| {
            let (before, after) = (span.first().copied().flatten()?, span.last().copied().flatten()?);
            span[half].map(|_| (after - before) / apart_s)
        };
        positions_m.windows(2 * half + 1).map(middle).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_velocity_is_the_central_difference_and_gaps_stay_gaps() {
        let tip: Vec<Option<f64>> = (0..8).map(|i| (i != 4).then(|| f64::from(i * i))).collect();
        let velocities =
            |half_frames, tip: &[_]| CentralDifference { half_frames, frame_rate_hz: 10.0 }.velocities(tip);
        // frame 4 is missing: its neighbours would give it a velocity, but neither it nor they have one
        assert_eq!(velocities(1, &tip), [Some(20.0), Some(40.0), None, None, None, Some(120.0)]);
        assert_eq!(velocities(2, &tip), [None, Some(60.0), None, Some(100.0)]);
        assert_eq!(velocities(1, &[Some(0.0); 2]), []);
    }

    const FASTEST_HZ: f64 = 900.0;

    /// Ratio of the velocity amplitude that a central difference gives to the true amplitude of an
    /// oscillation: `sin(x)/x`, where `x` is pi times the frequency times the time between the two frames.
    fn velocity_gain(difference: CentralDifference, frequency_hz: f64) -> f64 {
        let x = std::f64::consts::PI * frequency_hz * difference.frame_gap_s();
        x.sin() / x
    }

    /// Positions, m, of a tip that oscillates with the given amplitude, m, with added white noise of the
    /// given standard deviation, m; and the exact velocities, m/s.
    fn swinging(rate_hz: f64, amplitude_m: f64, noise_m: f64, frames: u32) -> (Vec<Option<f64>>, Vec<f64>) {
        let mut state = 7_u64;
        let mut draw = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * 12.0_f64.sqrt()
        };
        let angular = std::f64::consts::TAU * FASTEST_HZ;
        let phase = |i| angular * f64::from(i) / rate_hz;
        let tip = (0..frames).map(|i| Some(amplitude_m * phase(i).sin() + noise_m * draw())).collect();
        (tip, (0..frames).map(|i| amplitude_m * angular * phase(i).cos()).collect())
    }

    /// Root mean square, m/s, of the differenced velocities minus `share` times the exact velocities.
    fn off(difference: CentralDifference, tip: &[Option<f64>], exact: &[f64], share: f64) -> f64 {
        let found = difference.velocities(tip);
        let squares: Vec<f64> = found
            .iter()
            .flatten()
            .zip(&exact[difference.half_frames..])
            .map(|(v, e)| (v - share * e).powi(2))
            .collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }

    #[test]
    fn a_sine_loses_what_the_difference_takes_and_the_longest_takes_little() {
        let (tip, exact) = swinging(2e5, 1e-4, 0.0, 2000);
        for half_frames in [1, 2, 5, 40] {
            let difference = CentralDifference { half_frames, frame_rate_hz: 2e5 };
            let error = off(difference, &tip, &exact, velocity_gain(difference, FASTEST_HZ));
            assert!(error < 1e-9, "{half_frames}: {error}");
        }
        let longest = CentralDifference::for_noise(2e5, 1.0, 1e-9, Some(FASTEST_HZ));
        assert!(
            longest.frame_gap_s() <= MAX_DIFFERENCE_PERIODS / FASTEST_HZ && longest.half_frames == 22,
            "{longest:?}"
        );
        assert!(velocity_gain(longest, FASTEST_HZ) > 0.935, "{}", velocity_gain(longest, FASTEST_HZ));
    }

    #[test]
    fn noise_is_kept_below_a_tenth_of_the_swing_by_the_shortest_difference_that_does() {
        const NOISE_M: f64 = 2e-6;
        for (rate_hz, half_frames) in [(5e3, 1), (4e4, 1), (1e5, 2), (2e5, 3)] {
            let (tip, exact) = swinging(rate_hz, 1e-4, NOISE_M, 40_000);
            let swing = 2.0 * exact[0];
            let chosen = CentralDifference::for_noise(rate_hz, NOISE_M, swing, Some(FASTEST_HZ));
            assert_eq!(chosen.half_frames, half_frames, "at {rate_hz} Hz");
            let noise = off(chosen, &tip, &exact, velocity_gain(chosen, FASTEST_HZ));
            assert!(
                (noise / chosen.noise_m_per_s(NOISE_M) - 1.0).abs() < 0.03
                    && noise < MAX_VELOCITY_NOISE * swing,
                "{noise} of {swing}"
            );
        }
        // with a velocity range of 0.1 m/s, every permitted difference gives too much noise, so the longest
        // permitted one is chosen
        let drowned = CentralDifference::for_noise(2e5, NOISE_M, 0.1, Some(FASTEST_HZ));
        assert_eq!(drowned.half_frames, 22);
        assert!(drowned.noise_m_per_s(NOISE_M) > MAX_VELOCITY_NOISE * 0.1);
        assert_eq!(CentralDifference::for_noise(2e5, NOISE_M, 0.1, None).half_frames, 1);
        assert_eq!(CentralDifference::for_noise(2e5, 0.0, 0.0, Some(FASTEST_HZ)).half_frames, 1);
    }
}
