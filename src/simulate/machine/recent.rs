//! Whether events accumulate in no time.

/// The last events, to tell chattering from motion.
pub(super) struct ChatterDetector {
    times: [f64; Self::WINDOW],
    next: usize,
    shortest_s: f64,
}

impl ChatterDetector {
    /// Events compared with each other.
    const WINDOW: usize = 64;
    /// Share of the blade's shortest period that as many events must take together: real cycles take about a
    /// period each.
    const SHARE: f64 = 1e-6;

    pub(super) fn new(period_s: f64) -> Self {
        Self { times: [f64::NEG_INFINITY; Self::WINDOW], next: 0, shortest_s: Self::SHARE * period_s }
    }

    pub(super) fn note_event(&mut self, t: f64) {
        self.times[self.next] = t;
        self.next = (self.next + 1) % Self::WINDOW;
    }

    pub(super) fn is_chattering(&self, t: f64) -> bool {
        t - self.times[self.next] < self.shortest_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A window full of events within a millionth of the shortest period is chattering; one event a period is
    /// not, however long it lasts.
    #[test]
    fn events_that_accumulate_differ_from_cycles() {
        let period_s = 2e-3;
        let mut recent = ChatterDetector::new(period_s);
        for cycle in 0..1000 {
            let t = f64::from(cycle) * period_s;
            assert!(!recent.is_chattering(t), "cycle {cycle}");
            recent.note_event(t);
        }
        let t = 1000.0 * period_s;
        for event in 0..ChatterDetector::WINDOW {
            assert!(!recent.is_chattering(t), "event {event}");
            recent.note_event(t + event as f64 * 1e-12);
        }
        assert!(recent.is_chattering(t + 1e-10));
    }
}
