//! Instants of a stroke that are found in a recording: the head turns, the tip stops, the deflection flips,
//! the tip slips again.

use super::Channel;
use super::flip::{self, Flip, TurnNeighbourhood};
use super::turns::{find_turns, longest_hold};
use super::{TrackPoints, median_or_zero, present_points};
use crate::recording::Recording;
use portable_math as math;
use serde::Serialize;

/// An instant that is found in the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum InstantKind {
    /// The tip stops.
    Hold,
    /// The head turns.
    Reversal,
    /// The deflection leaves its level and passes to the other side.
    Flip,
    /// The tip slips again.
    Release,
}

impl InstantKind {
    pub(crate) const ALL: [Self; 4] = [Self::Hold, Self::Reversal, Self::Flip, Self::Release];

    /// Name of the instant in a window.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Reversal => "reversal",
            Self::Flip => "flip",
            Self::Release => "release",
        }
    }
}

/// The instants around one turn of the head, in s of the recording's time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reversal {
    /// Time at which the head turns.
    pub reversal_s: f64,
    /// Time at which the tip stops; `None` if it stops before the recording starts, or not at all.
    pub hold_s: Option<f64>,
    /// Time at which the tip slips again; `None` if this is after the end of the recording, or if the tip
    /// does not stop.
    pub release_s: Option<f64>,
    /// The flip of the deflection to the other side; `None` without a release, or if the deflection changes
    /// by no more than its noise.
    pub flip: Option<Flip>,
}

impl Reversal {
    /// End of the flip, s, or the release of the tip if that is later: from this time on the blade trails on
    /// its new side.
    pub(crate) fn settling_time_s(&self) -> Option<f64> {
        Some(self.flip?.end_s.max(self.release_s?))
    }
}

/// Why a recording does not show an instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum InstantNotFound {
    /// The head was not tracked.
    #[error("the head was tracked in none of its frames")]
    HeadNotTracked,
    /// The head does not turn.
    #[error("the head does not turn in it")]
    NoTurn,
    /// The head turns at least once, but fewer times than the requested number of the turn.
    #[error("{turns} reversal{} found", if *turns == 1 { " was" } else { "s were" })]
    FewerTurns {
        /// Number of turns that were found.
        turns: usize,
    },
    /// The tip does not stop.
    #[error("the tip does not come to rest there, or did so before the recording")]
    NoHold,
    /// The tip does not slip again.
    #[error("the tip does not rest there and then leave its place")]
    NoRelease,
    /// The deflection does not change sides.
    #[error(
        "the deflection changes there by no more than its noise, or is tracked too little after the tip \
         slips again"
    )]
    NoFlip,
}

/// All turns of the head that a recording shows, in order of time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReversalInstants {
    /// One entry per turn.
    pub reversals: Vec<Reversal>,
}

impl ReversalInstants {
    /// Finds the turns of the head and, around each, the interval in which the tip rests.
    #[must_use]
    pub fn find_instants(recording: &Recording) -> Self {
        let recording = &*recording.resample_to_grid();
        let rate = recording.grid().frame_rate_hz;
        let head = TrackPoints::from_samples(&recording.traces().head_x_m);
        let tip = TrackPoints::from_samples(&recording.traces().tip_x_m);
        let time_s = |frame: f64| recording.grid().start_s + frame / rate;
        let turns = find_turns(&head);
        let deflection = present_points(&Channel::Deflection.samples(recording));
        let noise_m = math::hypot(head.noise_m, tip.noise_m);
        let lean_m = 2.0 * median_or_zero(deflection.iter().map(|(_, x)| x.abs()));
        let reversals = turns.iter().enumerate().map(|(i, turn)| {
            let last_turn = i.checked_sub(1).map_or(0.0, |last| turns[last].frame);
            let next_turn = turns.get(i + 1).map_or(f64::INFINITY, |next| next.frame);
            let hold = longest_hold(&head, &tip, turn, lean_m, [last_turn, next_turn]);
            let (start, end) = hold.map_or((None, None), |hold| (hold.start, hold.end));
            let flip = end.and_then(|release| {
                let around = TurnNeighbourhood { turn: turn.frame, hold: start, release, next_turn };
                let (start, end) = flip::find_flip(&deflection, noise_m, &around)?;
                Some(Flip { start_s: time_s(start), end_s: time_s(end) })
            });
            let [hold_s, release_s] = [start, end].map(|frame| frame.map(time_s));
            Reversal { reversal_s: time_s(turn.frame), hold_s, release_s, flip }
        });
        Self { reversals: reversals.collect() }
    }

    /// Time of the first turn of the head, s; `None` without a turn.
    pub(crate) fn first_turn_s(recording: &Recording) -> Option<f64> {
        Self::find_instants(recording).time_s(InstantKind::Reversal, 1).ok()
    }

    /// Time of an instant of the `reversal`-th turn (counted from 1), s.
    ///
    /// # Errors
    /// [`InstantNotFound`] with what was found instead.
    pub fn time_s(&self, anchor: InstantKind, reversal: usize) -> Result<f64, InstantNotFound> {
        let found = self.find_reversal(reversal).ok_or(match self.reversals.len() {
            0 => InstantNotFound::NoTurn,
            turns => InstantNotFound::FewerTurns { turns },
        })?;
        match anchor {
            InstantKind::Reversal => Ok(found.reversal_s),
            InstantKind::Hold => found.hold_s.ok_or(InstantNotFound::NoHold),
            InstantKind::Release => found.release_s.ok_or(InstantNotFound::NoRelease),
            InstantKind::Flip => {
                let missing = found.release_s.map_or(InstantNotFound::NoRelease, |_| InstantNotFound::NoFlip);
                found.flip.map(|flip| flip.start_s).ok_or(missing)
            }
        }
    }

    /// Time from which the blade trails on its new side after the `reversal`-th turn (counted from 1), s: the
    /// end of the flip, or the release of the tip if that is later.
    ///
    /// # Errors
    /// The errors of [`Self::time_s`] for [`InstantKind::Flip`].
    pub(crate) fn settling_time_s(&self, reversal: usize) -> Result<f64, InstantNotFound> {
        self.time_s(InstantKind::Flip, reversal)?;
        self.find_reversal(reversal).and_then(Reversal::settling_time_s).ok_or(InstantNotFound::NoRelease)
    }

    /// The `reversal`-th turn, counted from 1.
    pub(crate) fn find_reversal(&self, reversal: usize) -> Option<&Reversal> {
        self.reversals.get(reversal.checked_sub(1)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{FrameGrid, Traces};
    use std::f64::consts::TAU;

    const RATE_HZ: f64 = 10_000.0;
    const HOLD_BEFORE_S: f64 = 0.02;
    const RELEASE_AFTER_S: f64 = 0.05;

    /// A head on a cosine of 0.5 Hz (with turns at 1, 2, 3 s ...) and a tip that trails by 2 mm, rests around
    /// each turn, and is then dragged along again.
    fn stroke(start_s: f64, stop_s: f64, noise_m: f64, missing: impl Fn(usize) -> bool) -> Recording {
        stroke_with_release(RELEASE_AFTER_S, [start_s, stop_s], noise_m, missing)
    }

    fn stroke_with_release(
        release_after_s: f64,
        [start_s, stop_s]: [f64; 2],
        noise_m: f64,
        missing: impl Fn(usize) -> bool,
    ) -> Recording {
        let frames = ((stop_s - start_s) * RATE_HZ).round() as usize;
        let head = |t: f64| 0.018 * (1.0 - (TAU * 0.5 * t).cos());
        let tip = |t: f64| {
            let (turn, sign) = (t.round(), if t.round() as i64 % 2 == 0 { -1.0 } else { 1.0 });
            let (hold, release) = (turn - HOLD_BEFORE_S, turn + release_after_s);
            let place = head(hold) - sign * 2e-3;
            // the tip stops along a parabola and leaves along a cubic, and is far away within 20 ms
            if t < hold {
                place - sign * 40.0 * (hold - t).powi(2)
            } else if t > release {
                place - sign * 3e5 * (t - release).powi(3).min(0.1)
            } else {
                place
            }
        };
        let mut state = 7_u64;
        let mut jitter = || {
            let mut sum = 0.0;
            for _ in 0..12 {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                sum += (state >> 11) as f64 / (1_u64 << 53) as f64;
            }
            (sum - 6.0) * noise_m
        };
        let column = |f: &dyn Fn(f64) -> f64, jitter: &mut dyn FnMut() -> f64| -> Vec<Option<f64>> {
            (0..frames)
                .map(|i| (f(start_s + i as f64 / RATE_HZ) + jitter(), i))
                .map(|(x, i)| (!missing(i)).then_some(x))
                .collect()
        };
        let (head_x_m, tip_x_m) = (column(&head, &mut jitter), column(&tip, &mut jitter));
        let traces = Traces {
            tip_x_m,
            tip_y_m: vec![None; frames],
            head_x_m,
            head_y_m: vec![None; frames],
            ..Traces::default()
        };
        Recording::new("r", FrameGrid { start_s, frame_rate_hz: RATE_HZ, frames }, traces, true).unwrap()
    }

    /// Asserts that an instant is found within `frames` of its true time.
    fn assert_near(found_s: Option<f64>, truth_s: f64, frames: f64) {
        let found_s = found_s.unwrap_or_else(|| panic!("nothing found near {truth_s} s"));
        assert!((found_s - truth_s).abs() * RATE_HZ <= frames, "found {found_s} s, expected {truth_s} s");
    }

    #[test]
    fn noiseless_instants_are_found_to_a_frame() {
        let found = ReversalInstants::find_instants(&stroke(0.8, 3.2, 0.0, |_| false)).reversals;
        assert_eq!(found.len(), 3);
        for (turn, reversal) in [1.0, 2.0, 3.0].into_iter().zip(&found) {
            assert_near(Some(reversal.reversal_s), turn, 0.1);
            assert_near(reversal.hold_s, turn - HOLD_BEFORE_S, 1.0);
            assert_near(reversal.release_s, turn + RELEASE_AFTER_S, 1.0);
        }
    }

    #[test]
    fn tracking_noise_of_a_tenth_of_a_pixel_moves_them_by_a_few_frames() {
        let found = ReversalInstants::find_instants(&stroke(0.8, 1.4, 2e-6, |_| false)).reversals;
        assert_eq!(found.len(), 1);
        assert_near(Some(found[0].reversal_s), 1.0, 5.0);
        assert_near(found[0].hold_s, 1.0 - HOLD_BEFORE_S, 4.0);
        assert_near(found[0].release_s, 1.0 + RELEASE_AFTER_S, 4.0);
    }

    /// A marker that is `offset_m` beside the edge of the lip turns with the lip, slowly with the deflection
    /// and quickly at the flip, while the head moves by 3.5 mm.
    #[test]
    fn a_marker_that_turns_with_the_lip_does_not_hide_them() {
        let (release_after_s, flip_after_s, flip_s) = (0.2, 0.12, 2e-3);
        for offset_m in [0.0, 2e-5, 1e-4, 2e-4] {
            let still = stroke_with_release(release_after_s, [0.95, 1.3], 2e-6, |_| false);
            let mut traces = still.traces().clone();
            for (i, x) in traces.tip_x_m.iter_mut().enumerate() {
                let t = 0.95 + i as f64 / RATE_HZ;
                let lean = traces.head_x_m[i].zip(*x).map_or(0.0, |(head, tip)| (tip - head) / 5e-3);
                let side = ((t - 1.0 - flip_after_s) / flip_s).tanh();
                *x = x.map(|x| x + offset_m * (0.6 * lean.clamp(-1.0, 1.0) + 0.5 * side));
            }
            let found = ReversalInstants::find_instants(&still.with_traces(traces).unwrap());
            let [found] = found.reversals[..] else { panic!("{found:?}") };
            assert_near(found.hold_s, 1.0 - HOLD_BEFORE_S, 30.0);
            assert_near(found.release_s, 1.0 + release_after_s, 10.0);
        }
    }

    #[test]
    fn gaps_do_not_hide_them() {
        let found = ReversalInstants::find_instants(&stroke(0.8, 1.4, 2e-6, |i| {
            i % 7 == 3 || (1900..2100).contains(&i)
        }))
        .reversals;
        assert_eq!(found.len(), 1);
        assert_near(Some(found[0].reversal_s), 1.0, 10.0);
        assert_near(found[0].release_s, 1.0 + RELEASE_AFTER_S, 5.0);
    }

    #[test]
    fn a_release_after_the_end_is_not_found() {
        let found = ReversalInstants::find_instants(&stroke(0.8, 1.04, 2e-6, |_| false)).reversals;
        assert_eq!(found.len(), 1);
        assert!(found[0].hold_s.is_some() && found[0].release_s.is_none());
    }

    #[test]
    fn a_head_that_rests_or_jitters_does_not_turn() {
        let still = |x: f64| {
            (0..4000).map(|i| Some(x + 2e-6 * f64::from(i * 7919 % 13 - 6) / 4.0)).collect::<Vec<_>>()
        };
        let traces = Traces {
            tip_x_m: still(0.0),
            tip_y_m: vec![None; 4000],
            head_x_m: still(1.0),
            head_y_m: vec![None; 4000],
            ..Traces::default()
        };
        let recording = Recording::new(
            "r",
            FrameGrid { start_s: 0.0, frame_rate_hz: RATE_HZ, frames: 4000 },
            traces,
            true,
        )
        .unwrap();
        assert_eq!(ReversalInstants::find_instants(&recording), ReversalInstants::default());
    }

    #[test]
    fn a_tip_that_follows_the_head_does_not_hold() {
        let traces = stroke(0.8, 1.4, 2e-6, |_| false).traces().clone();
        let follower = Traces { tip_x_m: traces.head_x_m.clone(), ..traces };
        let recording = Recording::new(
            "r",
            FrameGrid { start_s: 0.8, frame_rate_hz: RATE_HZ, frames: 6000 },
            follower,
            true,
        )
        .unwrap();
        let found = ReversalInstants::find_instants(&recording).reversals;
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].hold_s, found[0].release_s), (None, None));
    }

    #[test]
    fn chatter_before_and_after_is_not_taken_for_the_hold() {
        let calm = stroke(0.8, 1.4, 2e-6, |_| false);
        let mut traces = calm.traces().clone();
        for (i, x) in traces.tip_x_m.iter_mut().enumerate() {
            let t = 0.8 + i as f64 / RATE_HZ;
            let since_rest = (1.0 - HOLD_BEFORE_S - t).max(t - 1.0 - RELEASE_AFTER_S - 2e-3).max(0.0);
            // the tip sticks and slips 900 times a second, each slip 60 um, and comes to rest where the
            // chatter ends
            *x = x.map(|x| {
                x + 60e-6 * ((since_rest * 900.0).fract() - 0.5) * f64::from(u8::from(since_rest > 0.0))
            });
        }
        let recording = Recording::new("r", calm.grid(), traces, true).unwrap();
        let found = ReversalInstants::find_instants(&recording).reversals;
        assert_eq!(found.len(), 1);
        assert_near(found[0].hold_s, 1.0 - HOLD_BEFORE_S, 5.0);
        assert_near(found[0].release_s, 1.0 + RELEASE_AFTER_S, 5.0);
    }

    #[test]
    fn nothing_tracked_is_nothing_found() {
        let recording = stroke(0.8, 1.4, 0.0, |_| true);
        assert_eq!(ReversalInstants::find_instants(&recording), ReversalInstants::default());
    }
}
