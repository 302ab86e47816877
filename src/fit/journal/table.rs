//! Evaluations as rows of a table.

use super::{Body, Entry};
use crate::feature::Unit;
use crate::fit::evaluation::{Observation, Observed};
use crate::fit::objective::price;
use crate::fit::scale::Spacing;
use crate::journal::Tabled;

impl Tabled for Entry {
    fn group(&self) -> (&'static str, &'static str) {
        let ended = self.outcome.failure.as_ref().map(|failure| failure.reason.as_str());
        (self.stage.word(), ended.unwrap_or("done"))
    }

    fn about(body: &Body) -> Vec<[String; 2]> {
        let seed = ["seed".to_owned(), body.seed.to_string()];
        let parameters = body.parameters.iter().map(|parameter| {
            let range = parameter.axis.map_or_else(String::new, |axis| {
                let (bounds, unit) = (axis.bounds, spaced(&parameter.unit));
                let spacing = match bounds.spacing() {
                    Spacing::Log => "by ratios",
                    Spacing::Linear => "by differences",
                };
                format!(": {} to {}{unit}, {spacing}", bounds.lower(), bounds.upper())
            });
            ["parameter".to_owned(), parameter.name.clone() + &range]
        });
        let features = body.features.iter().map(|feature| {
            let target = feature.target.as_ref().map_or_else(String::new, |target| {
                let unit = spaced(&feature.unit);
                let camera = target.calibration.map_or_else(String::new, |found| {
                    let [scale, offset_m] = found.sds();
                    format!("; of its camera scale to {scale}, offset to {offset_m} m")
                });
                format!(": {}{unit}, standard deviation {}{unit}{camera}", target.value, target.sd)
            });
            ["feature".to_owned(), feature.name.clone() + &target]
        });
        std::iter::once(seed).chain(parameters).chain(features).collect()
    }

    fn columns(body: &Body) -> Vec<String> {
        let mut columns: Vec<String> = ["index", "stage", "seed"].map(str::to_owned).into();
        columns.extend(body.parameters.iter().map(|parameter| parameter.name.clone()));
        columns.push("cost_without_scatter".to_owned());
        for feature in &body.features {
            columns.push(with_unit(&feature.name, &feature.unit));
            columns.push(with_unit(&format!("{} spread", feature.name), &feature.unit));
            columns.push(format!("{} below strongest [dB]", feature.name));
        }
        columns.extend(["missing", "failure", "failure_message", "failure_progress"].map(str::to_owned));
        columns
    }

    fn cells(&self, at: usize, body: &Body) -> Vec<String> {
        let seed = self.from.unwrap_or(body.seed);
        let mut cells = vec![at.to_string(), self.stage.word().to_owned(), seed.to_string()];
        cells.extend(self.outcome.values.iter().map(f64::to_string));
        cells.push(self.cost(body).map_or_else(String::new, |cost| cost.to_string()));
        for at in 0..body.features.len() {
            cells.extend(feature_cells(self.outcome.features.get(at)));
        }
        let missing = self.outcome.features.iter().zip(&body.features).filter_map(|(observed, feature)| {
            let Observed::Missing(why) = observed else { return None };
            Some(format!("{}: {why}", feature.name))
        });
        cells.push(missing.collect::<Vec<_>>().join("; "));
        cells.extend(self.outcome.failure.as_ref().map_or_else(Default::default, |failure| {
            [failure.reason.to_string(), failure.message.clone(), failure.progress.to_string()]
        }));
        cells
    }

    /// Without the scatter of the features, which a search finds as it goes.
    fn cost(&self, body: &Body) -> Option<f64> {
        Some(price(&body.axes()?, &body.targets()?, self.outcome.clone()).cost)
    }
}

/// Value, spread and level; empty where there is none.
fn feature_cells(observed: Option<&Observed>) -> [String; 3] {
    let Some(Observation { value, spread, below_db }) = observed.and_then(Observed::observation) else {
        return Default::default();
    };
    [value, spread, below_db].map(f64::to_string)
}

fn with_unit(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name} [{unit}]") }
}

fn spaced(unit: &str) -> String {
    if unit == Unit::PLAIN.name { String::new() } else { format!(" {unit}") }
}
