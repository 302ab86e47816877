//! `wiperlab simulate --sensitivities`: derivatives of a run with respect to named parameters.

use super::files::StreamedTable;
use super::prelude::*;
use crate::model::parameters;
use crate::simulate::outputs::{EVENTS_HEADER, push_event_row};
use crate::simulate::scene::Scene;
use crate::simulate::sensitivity::{
    Channel, TangentDirection, TangentObserver, TangentSeeds, TangentSegment, run_with_tangents,
};
use crate::simulate::{IntegrationMethod, SolverOptions, Transition};
use crate::toml_file::suggest_key;
use std::fmt::Write;
use std::iter::Peekable;
use std::ops::ControlFlow;

pub(crate) const SENSITIVITY_FILES: [&str; 2] = ["sensitivities.csv", "event_sensitivities.csv"];

/// Columns that have derivatives.
const COLUMNS: [(Channel, &str); 7] = [
    (Channel::TipX, "tip_x_m"),
    (Channel::HeadDrop, "head_drop_m"),
    (Channel::NeckAngle, "neck_angle_rad"),
    (Channel::LipAngle, "lip_angle_rad"),
    (Channel::NeckRate, "neck_rate_rad_per_s"),
    (Channel::LipRate, "lip_rate_rad_per_s"),
    (Channel::TipVelocity, "tip_velocity_m_per_s"),
];

/// Columns of a slider that have derivatives.
const SLIDER_COLUMNS: [(Channel, &str); 2] =
    [(Channel::TipX, "tip_x_m"), (Channel::TipVelocity, "tip_velocity_m_per_s")];

/// Parameters with respect to which a run is differentiated.
pub(crate) struct SensitivityRequest {
    names: Vec<String>,
    columns: &'static [(Channel, &'static str)],
    seeds: TangentSeeds,
}

impl SensitivityRequest {
    /// Checks the names of the parameters; `None` if there are none.
    pub(crate) fn parse(scene: &Scene, names: &[String], effort: &SolverOptions) -> Outcome<Option<Self>> {
        if names.is_empty() {
            return Ok(None);
        }
        let refuse = |found: &str, expected: &str, advice: &str| {
            Err(Failure::at("--sensitivities", format!("found {found}, expected {expected}; {advice}")))
        };
        if effort.method != IntegrationMethod::Taylor {
            let found = format!("it with the method `{}`", effort.method.name());
            return refuse(&found, "the adaptive method, which carries derivatives", "leave --method out");
        }
        let known: Vec<&str> =
            parameters::parameter_names().into_iter().chain(TangentDirection::other_names()).collect();
        for (i, name) in names.iter().enumerate() {
            if !known.contains(&name.as_str()) {
                let expected = "a parameter of the scene, start.neck_angle_rad and the like, drive.scale or drive.delay_s";
                return refuse(&format!("`{name}`"), expected, &suggest_key(name, &known));
            }
            if names[..i].contains(name) {
                return refuse(&format!("`{name}` twice"), "each name once", "remove one");
            }
        }
        let directions: Vec<TangentDirection> =
            names.iter().map(|name| TangentDirection::from_name(name)).collect();
        let seeds = TangentSeeds::new(scene, &directions).map_err(Failure::input)?;
        let columns = if scene.linkage.is_slider() { &SLIDER_COLUMNS[..] } else { &COLUMNS };
        Ok(Some(Self { names: names.to_vec(), columns, seeds }))
    }

    /// Runs the scene again with derivatives, and writes these row by row.
    pub(crate) fn run_to_tables(
        &self,
        scene: &Scene,
        effort: SolverOptions,
        place: &OutputFolder,
        times: impl Iterator<Item = f64>,
    ) -> Outcome<[StreamedTable; 2]> {
        let by = |column: &str| -> String {
            self.names.iter().fold(String::new(), |row, name| row + &format!(",d_{column}_d_{name}"))
        };
        let columns: String = self.columns.iter().map(|(_, column)| by(column)).collect();
        let [samples, events] = SENSITIVITY_FILES;
        let events_header = format!("{EVENTS_HEADER}{}", by("time_s"));
        let mut rows = SensitivityTables {
            columns: self.columns,
            samples: StreamedTable::new(place.create_file(samples)?, &format!("time_s{columns}"), 1),
            events: StreamedTable::new(place.create_file(events)?, &events_header, 1),
            times: times.peekable(),
            row: vec![0.0; self.names.len()],
        };
        run_with_tangents(scene, effort, &self.seeds, &mut rows);
        Ok([rows.samples, rows.events])
    }
}

/// Writes derivatives to the tables of samples and of events.
struct SensitivityTables<I: Iterator<Item = f64>> {
    columns: &'static [(Channel, &'static str)],
    samples: StreamedTable,
    events: StreamedTable,
    times: Peekable<I>,
    /// Derivatives of one column at one instant, one value per parameter; the memory is used again for every
    /// row.
    row: Vec<f64>,
}

impl<I: Iterator<Item = f64>> TangentObserver for SensitivityTables<I> {
    fn observe_segment(&mut self, piece: &TangentSegment<'_>) {
        let Self { columns, samples, times, row, .. } = self;
        while let Some(t) = times.next_if(|&t| t <= piece.end_s) {
            let weights = piece.weights_at(t.max(piece.start_s));
            samples.add_row(|text| {
                let _ = write!(text, "{t}"); // writing to a String cannot fail
                for (channel, _) in *columns {
                    piece.channel_derivatives(*channel, &weights, row);
                    push_numbers(text, row.len(), piece.is_known.then_some(row));
                }
                text.push('\n');
            });
        }
    }

    fn observe_transition(&mut self, transition: &Transition, d_time_s: Option<&[f64]>) {
        let directions = self.row.len();
        self.events.add_row(|text| {
            push_event_row(text, transition);
            push_numbers(text, directions, d_time_s);
            text.push('\n');
        });
    }

    fn control_flow(&self) -> ControlFlow<()> {
        interrupt::control_flow()
    }
}

/// Appends `count` cells: the given numbers, or empty cells if there are none.
fn push_numbers(text: &mut String, count: usize, numbers: Option<&[f64]>) {
    for i in 0..count {
        let _ = match numbers {
            Some(numbers) => write!(text, ",{:e}", numbers[i]),
            None => write!(text, ","),
        };
    }
}
