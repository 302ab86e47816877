//! A fine trace as the tracking of a given recording would show it: its frames, its noise, its lost points.

use super::{FilmError, film_trace};
use crate::math::StandardNormal;
use crate::recording::channel::ReversalInstants;
use crate::recording::quality::noise_floor;
use crate::recording::{FrameGrid, Recording, RecordingError, Traces};
use crate::twin::Camera;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Columns of a recording: tip x, tip y, head x, head y.
const COORDINATES: usize = 4;

/// Which frames were dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DropoutPattern {
    /// Those that the recording misses: both clocks were aligned at the first turn of the head that each
    /// shows.
    SameFrames,
    /// As large a share, at random: one of them shows no turn of the head, so that their clocks cannot be
    /// aligned.
    AtRandom,
}

/// A trace filmed like a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct MatchedFilm {
    /// What was seen, on the clock of the fine trace; marked synthetic.
    pub recording: Recording,
    /// Standard deviation of the white noise added to tip x, tip y, head x, head y, m; 0 where the recording
    /// has no such column.
    pub noise_m: [f64; COORDINATES],
    /// Which frames were dropped.
    pub dropouts: DropoutPattern,
}

/// Why a trace cannot be filmed like a recording.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MatchedFilmError {
    /// The trace cannot be filmed.
    #[error(transparent)]
    Film(#[from] FilmError),
    /// A column has too few frames in a row for its noise.
    #[error(
        "{recording}, column {column}: found too few frames in a row to measure its noise, expected 11; track the lost frames again"
    )]
    NoNoise {
        /// Name of the recording.
        recording: String,
        /// The column.
        column: &'static str,
    },
}

/// Films `fine` at the rate of `like` with `exposure_s`, adds white noise of the size that [`noise_floor`]
/// measures on each column of `like` (an upper estimate where that oscillates within a few frames), and drops
/// frames: the same ones where the first turn of the head shows in both, else as many at random. Frames that
/// the aligned recording does not have are not taken. `seed` settles noise and random dropouts; dropouts do
/// not reshuffle the noise.
///
/// # Errors
/// [`MatchedFilmError`].
pub fn film_like_recording(
    fine: &Recording,
    like: &Recording,
    exposure_s: f64,
    seed: u64,
) -> Result<MatchedFilm, MatchedFilmError> {
    let camera = Camera { frame_rate_hz: like.grid().frame_rate_hz, exposure_s };
    let noise_m = measure_noises(like)?;
    let shown = align_recordings(fine, like).filter(|shown| shown.frames >= 2);
    let seen = film_trace(fine, &camera, shown.as_ref().map_or(fine.grid().start_s, |shown| shown.start_s))?;
    let frames = shown.as_ref().map_or(seen.grid().frames, |shown| shown.frames.min(seen.grid().frames));
    let tracker = MatchedTracker {
        like: coordinate_columns(like).map(|(_, column)| column),
        first: shown.as_ref().map(|shown| shown.first),
        noise_m,
        seed,
    };
    let [tip_x_m, tip_y_m, head_x_m, head_y_m] = tracker.track_frames(&seen, frames);
    let traces = Traces { tip_x_m, tip_y_m, head_x_m, head_y_m, ..Traces::default() };
    let refused = |error: RecordingError| FilmError::Recording { trace: fine.name().to_owned(), error };
    let recording =
        Recording::new(fine.name(), FrameGrid { frames, ..seen.grid() }, traces, true).map_err(refused)?;
    let dropouts = if shown.is_some() { DropoutPattern::SameFrames } else { DropoutPattern::AtRandom };
    Ok(MatchedFilm { recording, noise_m, dropouts })
}

fn coordinate_columns(recording: &Recording) -> [(&'static str, &[Option<f64>]); COORDINATES] {
    let traces = recording.traces();
    [
        ("tip_x_m", &traces.tip_x_m),
        ("tip_y_m", &traces.tip_y_m),
        ("head_x_m", &traces.head_x_m),
        ("head_y_m", &traces.head_y_m),
    ]
}

fn measure_noises(like: &Recording) -> Result<[f64; COORDINATES], MatchedFilmError> {
    let mut noises = [0.0; COORDINATES];
    for (noise, (column, samples)) in noises.iter_mut().zip(coordinate_columns(like)) {
        if samples.iter().any(Option::is_some) {
            let refused = || MatchedFilmError::NoNoise { recording: like.name().to_owned(), column };
            *noise = noise_floor(samples).ok_or_else(refused)?;
        }
    }
    Ok(noises)
}

fn missing_share(column: &[Option<f64>]) -> f64 {
    column.iter().filter(|x| x.is_none()).count() as f64 / column.len() as f64
}

/// The part of a recording whose frames lie in the fine trace.
struct SharedFrames {
    /// Its first frame in the recording.
    first: usize,
    /// The same on the clock of the fine trace, s.
    start_s: f64,
    frames: usize,
}

/// Lays the first turn of the head of both on the same instant.
fn align_recordings(fine: &Recording, like: &Recording) -> Option<SharedFrames> {
    let shift_s = ReversalInstants::first_turn_s(fine)? - ReversalInstants::first_turn_s(like)?;
    let (grid, on) = (like.grid(), fine.grid());
    let end_s = on.time_s(on.frames.checked_sub(1)?);
    let inside = |frame: &usize| (on.start_s..=end_s).contains(&(grid.time_s(*frame) + shift_s));
    let first = (0..grid.frames).find(inside)?;
    let frames = (first..grid.frames).take_while(inside).count();
    Some(SharedFrames { first, start_s: grid.time_s(first) + shift_s, frames })
}

/// What tracking does to a film.
struct MatchedTracker<'a> {
    /// Columns of the recording that is followed.
    like: [&'a [Option<f64>]; COORDINATES],
    /// Its frame that is the film's first; `None` where points are lost at random.
    first: Option<usize>,
    noise_m: [f64; COORDINATES],
    seed: u64,
}

impl MatchedTracker<'_> {
    /// The first `frames` frames with noise and lost points.
    fn track_frames(&self, seen: &Recording, frames: usize) -> [Vec<Option<f64>>; COORDINATES] {
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(self.seed);
        let clean = coordinate_columns(seen).map(|(_, column)| column);
        let shares = self.like.map(missing_share);
        let mut tracked = [const { Vec::new() }; COORDINATES];
        (0..frames).for_each(|frame| {
            let points: [f64; COORDINATES / 2] = generator.random(); // (one for both coordinates of a point)
            for (c, column) in tracked.iter_mut().enumerate() {
                let lost = self
                    .first
                    .map_or(points[c / 2] < shares[c], |first| self.like[c][first + frame].is_none());
                let noise: f64 = generator.sample(StandardNormal);
                column.push(clean[c][frame].filter(|_| !lost).map(|x| x + self.noise_m[c] * noise));
            }
        });
        tracked
    }
}
