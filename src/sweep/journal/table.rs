//! Points of a study as rows of a table.

use super::{Body, Point};
use crate::feature::Unit;
use crate::journal::Tabled;
use crate::sweep::point::Outcome;

impl Tabled for Point {
    fn group(&self) -> (&'static str, &'static str) {
        ("", self.outcome.status())
    }

    fn about(body: &Body) -> Vec<[String; 2]> {
        let points = ["points".to_owned(), body.points.to_string()];
        let axes = body.axes.iter().map(|axis| {
            let ends = axis.values.first().zip(axis.values.last());
            let ends = ends.map_or_else(String::new, |(from, to)| format!(" from {} to {}", from.0, to.0));
            let unit = if axis.unit == Unit::PLAIN.name { String::new() } else { format!(" {}", axis.unit) };
            let values = match body.sample {
                Some(_) => "sampled".to_owned(),
                None => format!("{} values", axis.values.len()),
            };
            ["axis".to_owned(), format!("{}: {values}{ends}{unit}", axis.name)]
        });
        let maps = body.maps.iter().map(|map| ["map".to_owned(), map.clone()]);
        std::iter::once(points).chain(axes).chain(maps).collect()
    }

    fn columns(body: &Body) -> Vec<String> {
        let mut columns = vec!["index".to_owned()];
        columns.extend(body.axes.iter().map(|axis| axis.name.clone()));
        columns.extend(["status", "why", "stopped_at_s"].map(str::to_owned));
        columns.extend(body.maps.iter().cloned());
        columns.push("missing".to_owned());
        columns
    }

    fn cells(&self, _: usize, body: &Body) -> Vec<String> {
        let Outcome { ended, stopped_at_s, values } = &self.outcome;
        let number = |number: Option<f64>| number.map_or_else(String::new, |number| number.to_string());
        let mut cells = vec![self.index.to_string()];
        cells.extend(body.place(self.index).into_iter().map(|value| value.to_string()));
        cells.push(self.outcome.status().to_owned());
        cells.push(ended.as_ref().map_or_else(String::new, |ended| ended.why.clone()));
        cells.push(number(*stopped_at_s));
        cells.extend(values.iter().map(|value| number(value.ok())));
        let missing = values.iter().zip(&body.maps).filter_map(|(value, map)| {
            let reason = value.err()?;
            Some(format!("{map}: {}", reason.name()))
        });
        cells.push(missing.collect::<Vec<_>>().join("; "));
        cells
    }
}
