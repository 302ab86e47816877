//! How much slower than the motion an animation runs, part by part.

use crate::math;

/// A part of the motion that is shown at one pace.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaybackPart {
    /// First instant of the motion, s.
    pub from_s: f64,
    /// Last instant of the motion, s.
    pub to_s: f64,
    /// How many times slower than the motion.
    pub slower: f64,
}

impl PlaybackPart {
    /// The part, as many times slower (a round number) as makes it last about `wanted_s`.
    fn with_duration(from_s: f64, to_s: f64, wanted_s: f64) -> Self {
        Self { from_s, to_s, slower: round_to_125(wanted_s / (to_s - from_s)).max(1.0) }
    }

    fn duration_s(&self) -> f64 {
        (self.to_s - self.from_s) * self.slower
    }
}

/// Parts that follow each other without gaps, then a rest on the last picture.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlaybackPace {
    /// The parts, in order of time.
    pub parts: Vec<PlaybackPart>,
}

/// How long the last picture stays before the animation starts again, s.
const REST_S: f64 = 1.0;
/// How long a viewer should watch the tip at rest and what comes before, s.
const HOLD_SHOWN_S: f64 = 7.0;
/// The same of the release and what follows.
const RELEASE_SHOWN_S: f64 = 10.0;
/// How much is shown before the hold, at the end of it as part of the release, and after it, as shares of its
/// length.
const LEAD_IN: f64 = 0.06;
const RELEASE_LEAD: f64 = 0.02;
const FOLLOW_UP: f64 = 0.3;

impl PlaybackPace {
    /// The hold of the tip, then its release and some cycles after it slower still; within what was run.
    /// `None` where nothing moves between.
    #[must_use]
    pub fn around_hold([hold_s, release_s]: [f64; 2], within: [f64; 2]) -> Option<Self> {
        let length = release_s - hold_s;
        let instants =
            [hold_s - LEAD_IN * length, release_s - RELEASE_LEAD * length, release_s + FOLLOW_UP * length]
                .map(|t| t.max(within[0]).min(within[1]));
        let wanted = [HOLD_SHOWN_S, RELEASE_SHOWN_S];
        let parts: Vec<PlaybackPart> = instants
            .windows(2)
            .zip(wanted)
            .filter(|(pair, _)| pair[0] < pair[1])
            .map(|(pair, s)| PlaybackPart::with_duration(pair[0], pair[1], s))
            .collect();
        (!parts.is_empty()).then_some(Self { parts })
    }

    /// First and last instant of the motion, s.
    #[must_use]
    pub fn span_s(&self) -> [f64; 2] {
        [self.parts.first().map_or(0.0, |p| p.from_s), self.parts.last().map_or(1.0, |p| p.to_s)]
    }

    /// First and last instant of the last part, s.
    #[must_use]
    pub(crate) fn last_part_s(&self) -> [f64; 2] {
        self.parts.last().map_or(self.span_s(), |p| [p.from_s, p.to_s])
    }

    /// The pace of the same motion on a clock that is this far ahead.
    #[must_use]
    pub fn shift_by(self, shift_s: f64) -> Self {
        let later =
            |p: PlaybackPart| PlaybackPart { from_s: p.from_s + shift_s, to_s: p.to_s + shift_s, ..p };
        Self { parts: self.parts.into_iter().map(later).collect() }
    }

    /// How long the animation lasts, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.parts.iter().map(PlaybackPart::duration_s).sum::<f64>() + REST_S
    }

    /// When an instant of the motion is shown, as a share of the animation.
    #[must_use]
    pub fn playback_fraction(&self, time_s: f64) -> f64 {
        let shown_s: f64 =
            self.parts.iter().map(|p| (time_s.clamp(p.from_s, p.to_s) - p.from_s) * p.slower).sum();
        shown_s / self.duration_s()
    }
}

/// The nearest of 1, 2 and 5 times a power of ten, by ratio.
pub(super) fn round_to_125(value: f64) -> f64 {
    let power = math::powf(10.0, math::log10(value).floor());
    let apart = |candidate: &f64| math::ln(candidate / value).abs();
    let nearest =
        [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
    nearest.unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_round() {
        assert_eq!(
            [0.7, 1.2, 1.6, 3.0, 4.0, 98.0, 640.0].map(round_to_125),
            [0.5, 1.0, 2.0, 2.0, 5.0, 100.0, 500.0]
        );
    }

    #[test]
    fn the_release_is_slower_than_the_hold_and_both_last_about_as_long_as_wanted() {
        let pace = PlaybackPace::around_hold([0.666, 0.732], [0.56, 1.15]).unwrap();
        assert_eq!(pace.parts.iter().map(|p| p.slower).collect::<Vec<_>>(), [100.0, 500.0]);
        assert!((12.0..=20.0).contains(&pace.duration_s()), "{}", pace.duration_s());
        assert_eq!(pace.parts[0].to_s, pace.parts[1].from_s);
    }

    #[test]
    fn shares_follow_the_parts_and_leave_a_rest() {
        let part = |from_s, to_s, slower| PlaybackPart { from_s, to_s, slower };
        let pace = PlaybackPace { parts: vec![part(1.0, 1.02, 100.0), part(1.02, 1.03, 500.0)] };
        assert!((pace.duration_s() - 8.0).abs() < 1e-9); // 2 s, 5 s and the rest of 1 s
        for (time_s, expected) in [
            (0.5, 0.0),
            (1.01, 1.0 / 8.0),
            (1.02, 2.0 / 8.0),
            (1.025, 4.5 / 8.0),
            (1.03, 7.0 / 8.0),
            (9.0, 7.0 / 8.0),
        ] {
            assert!((pace.playback_fraction(time_s) - expected).abs() < 1e-9, "{time_s}");
        }
    }

    #[test]
    fn a_run_that_ends_early_is_shown_as_far_as_it_goes() {
        let pace = PlaybackPace::around_hold([0.666, 0.732], [0.56, 0.70]).unwrap();
        assert_eq!((pace.parts.len(), pace.span_s()[1]), (1, 0.70));
        assert_eq!(PlaybackPace::around_hold([0.666, 0.732], [0.9, 0.9]), None);
        assert_eq!(PlaybackPace::around_hold([0.7, f64::NAN], [f64::NAN, f64::NAN]), None);
    }
}
