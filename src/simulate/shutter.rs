//! What an open shutter sees of a run: the mean of the places over its interval.

use super::{BladePoints, Observer, SegmentPath, SolutionSegment};
use std::iter::Peekable;

/// Hands the mean place over every interval to `sink`; that of an interval of no length is the place then.
pub struct ShutterObserver<I: Iterator<Item = [f64; 2]>, F: FnMut(&BladePoints)> {
    intervals: Peekable<I>,
    sink: F,
    sum: [f64; 4],
    open_s: f64,
}

impl<I: Iterator<Item = [f64; 2]>, F: FnMut(&BladePoints)> ShutterObserver<I, F> {
    /// Shutters that open at the first and close at the second of each two times, s. They follow one another
    /// without overlap and lie within the run; one that the run does not see closed gives nothing.
    pub fn new(intervals: I, sink: F) -> Self {
        Self { intervals: intervals.peekable(), sink, sum: [0.0; 4], open_s: 0.0 }
    }

    /// Adds what lies within a piece.
    fn add_exposure(&mut self, path: &SegmentPath<'_>, from_s: f64, to_s: f64) {
        if to_s > from_s {
            let integral = path.integrate_points(from_s, to_s).to_array();
            self.sum.iter_mut().zip(integral).for_each(|(sum, part)| *sum += part);
            self.open_s += to_s - from_s;
        }
    }

    /// The mean of the interval that ends at `close_s`; the next one begins with nothing.
    fn take_mean(&mut self, path: &SegmentPath<'_>, close_s: f64) -> BladePoints {
        let (sum, open_s) = (std::mem::take(&mut self.sum), std::mem::take(&mut self.open_s));
        if open_s > 0.0 {
            BladePoints::from_array(sum.map(|sum| sum / open_s))
        } else {
            path.points_at(close_s)
        }
    }
}

impl<I: Iterator<Item = [f64; 2]>, F: FnMut(&BladePoints)> Observer for ShutterObserver<I, F> {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        let mut path = None;
        while let Some(&[opens_s, closes_s]) = self.intervals.peek() {
            if opens_s > piece.end_s {
                return;
            }
            let path = path.get_or_insert_with(|| piece.path());
            self.add_exposure(path, opens_s.max(piece.start_s), closes_s.min(piece.end_s));
            if closes_s > piece.end_s {
                return;
            }
            let mean = self.take_mean(path, closes_s.max(piece.start_s));
            (self.sink)(&mean);
            self.intervals.next();
        }
    }
}
