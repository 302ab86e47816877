//! The columns of a comparison as CSV, on the clocks of the recordings.

use super::case::Case;
use super::ridge::FollowedRidge;
use super::traces::CHANNELS;
use std::fmt::Write;

/// A file of a comparison.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    /// Its name.
    pub file: &'static str,
    /// What it holds.
    pub text: String,
}

/// Residuals, ridges and transitions of every condition, in the order of the job.
#[must_use]
pub fn tables(cases: &[Case]) -> Vec<Table> {
    let table = |file, header: &str, rows: fn(&mut String, &str, &Case)| {
        let mut text = format!("{header}\n");
        cases.iter().for_each(|case| rows(&mut text, &field(case.name()), case));
        Table { file, text }
    };
    vec![
        table("residuals.csv", "condition,time_s,tip_x_m,head_x_m,deflection_m,head_drop_m", residuals),
        table("ridge.csv", "condition,source,time_s,frequency_hz,frequency_sd_hz,amplitude_m,course", ridges),
        table("transitions.csv", "condition,time_s,from,to,cause", transitions),
    ]
}

/// A name as a field; one with a comma, a quote or a line break in quotes (RFC 4180).
fn field(name: &str) -> String {
    let plain = !name.contains([',', '"', '\n', '\r']);
    if plain { name.to_owned() } else { format!("\"{}\"", name.replace('"', "\"\"")) }
}

// (writing to a String cannot fail)

/// Measured minus model; an empty field where either is missing.
fn residuals(text: &mut String, condition: &str, case: &Case) {
    let Some(residual) = &case.residual else { return };
    for (i, time_s) in residual.time_s.iter().enumerate() {
        let _ = write!(text, "{condition},{time_s}");
        for channel in CHANNELS {
            let _ = match residual.column(channel).get(i).copied().flatten() {
                Some(left_m) => write!(text, ",{left_m:e}"),
                None => write!(text, ","),
            };
        }
        text.push('\n');
    }
}

fn ridges(text: &mut String, condition: &str, case: &Case) {
    let sides =
        [("measured", &case.ridges.measured, 0.0), ("model", &case.ridges.model, case.alignment.shift_s)];
    for (source, followed, shift_s) in sides {
        followed.iter().for_each(|followed| ridge(text, &format!("{condition},{source}"), followed, shift_s));
    }
}

/// Every point of a ridge, with the number of the course that it is on, where it is on one.
fn ridge(text: &mut String, start: &str, followed: &FollowedRidge, shift_s: f64) {
    for point in &followed.ridge.points {
        let time_s = followed.start_s + point.time_s + shift_s;
        let course = followed.courses.iter().position(|course| course.contains(point));
        let course = course.map_or_else(String::new, |number| (number + 1).to_string());
        let (frequency_hz, sd_hz, amplitude_m) =
            (point.frequency_hz, point.frequency_sd_hz, point.amplitude_m);
        let _ = writeln!(text, "{start},{time_s},{frequency_hz},{sd_hz},{amplitude_m:e},{course}");
    }
}

fn transitions(text: &mut String, condition: &str, case: &Case) {
    for transition in &case.model.motion.transitions {
        let time_s = transition.time_s + case.alignment.shift_s;
        let (from, to, cause) = (transition.from.name(), transition.to.name(), transition.cause.name());
        let _ = writeln!(text, "{condition},{time_s:.16e},{from},{to},{cause}");
    }
}

#[cfg(test)]
mod tests {
    use super::field;

    #[test]
    fn a_name_with_a_comma_or_a_quote_stays_one_field() {
        assert_eq!(["slow", "a,b", "a\"b"].map(field), ["slow", "\"a,b\"", "\"a\"\"b\""]);
    }
}
