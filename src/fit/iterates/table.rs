//! Iterates as rows of a table.

use super::{Body, Step};
use crate::fit::trace::Branch;
use crate::journal::Tabled;

impl Tabled for Step {
    fn group(&self) -> (&'static str, &'static str) {
        let phase = match (Branch::of(self.start), self.iterate.plain) {
            (Some(Branch::Twin(_)), _) => "twin",
            (Some(Branch::Shorter), _) => "shorter segments",
            (Some(Branch::Side { .. }), _) => "profile",
            (None, true) => "plain",
            (None, false) => "robust",
        };
        (phase, if self.iterate.settled { "settled" } else { "on the way" })
    }

    fn about(body: &Body) -> Vec<[String; 2]> {
        let pair = |what: &str, value: String| [what.to_owned(), value];
        let lengths = body.segment_s.iter().map(|length| pair("segments", format!("{} s", length.0)));
        let recordings = body.recordings.iter().map(|name| pair("recording", name.clone()));
        let unknowns = body.unknowns.iter().map(|unknown| {
            let [low, high] = unknown.range.map(|end| unknown.value(end.0));
            let unit = if unknown.unit == "1" { String::new() } else { format!(" {}", unknown.unit) };
            pair("unknown", format!("{}: {low} to {high}{unit}", unknown.name))
        });
        std::iter::once(pair("seed", body.seed.to_string()))
            .chain(recordings)
            .chain(lengths)
            .chain(unknowns)
            .collect()
    }

    fn columns(body: &Body) -> Vec<String> {
        let first = ["index", "start", "step", "segment_s", "phase", "number", "settled", "damping", "cost"];
        let mut columns: Vec<String> = first.map(str::to_owned).into();
        columns.extend(body.unknowns.iter().map(|unknown| format!("{} [{}]", unknown.name, unknown.unit)));
        columns.extend(["segments", "bad_segments", "failed_segments", "chi2", "data"].map(str::to_owned));
        columns
    }

    fn cells(&self, at: usize, body: &Body) -> Vec<String> {
        let iterate = &self.iterate;
        let mut cells = vec![
            at.to_string(),
            self.start.to_string(),
            self.step.to_string(),
            body.segment_s.get(iterate.stage).map_or_else(String::new, |length| length.0.to_string()),
            self.group().0.to_owned(),
            iterate.number.to_string(),
            iterate.settled.to_string(),
            iterate.damping.to_string(),
            iterate.cost.to_string(),
        ];
        let values = body.unknowns.iter().zip(&iterate.point);
        cells.extend(values.map(|(unknown, z)| unknown.value(*z).to_string()));
        let segments = || iterate.segments.iter();
        let failed = segments().filter(|segment| segment.chi2.is_infinite()).count();
        let bad = segments().filter(|segment| segment.is_bad()).count();
        let chi2: f64 = segments().map(|segment| segment.chi2).filter(|chi2| chi2.is_finite()).sum();
        let data: usize = segments().map(|segment| segment.data).sum();
        cells.extend([segments().count(), bad, failed].map(|count| count.to_string()));
        cells.extend([chi2.to_string(), data.to_string()]);
        cells
    }

    /// Costs of one stage are comparable; the last stage is what counts.
    fn cost(&self, body: &Body) -> Option<f64> {
        let is_last = self.iterate.stage + 1 == body.segment_s.len() && self.iterate.plain;
        (is_last && Branch::of(self.start).is_none()).then_some(self.iterate.cost)
    }
}
