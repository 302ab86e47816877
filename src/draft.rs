//! Writes a first scene and a first job for a recording. Comments in the files give the findings in the
//! recording, the reason of each number, and the numbers that only the user knows.
//!
//! The blade is that of the bundled example. Parameters that a fit can find in any recording (friction,
//! stiffness, damping) are free within wide bounds; those that have to be measured on the blade (lengths,
//! masses, preload) are marked.

mod findings;
mod job;
mod scene;
mod stroke;

use crate::text::{make_printable, wrap_words};
pub(crate) use findings::DraftFindings;
pub(crate) use job::write_job;
pub(crate) use scene::{FittedScene, YOURS_MARK, write_fitted_scene, write_scene, write_scene_alone};
use serde::Serialize;
pub(crate) use stroke::KnownStroke;

/// Widest line of a comment, characters.
const WIDTH: usize = 100;

/// Builder of a TOML file with comments.
#[derive(Default)]
pub(super) struct CommentedToml(String);

impl CommentedToml {
    /// Adds a comment, wrapped to [`WIDTH`].
    pub(super) fn add_comment(self, words: &str) -> Self {
        let lines = wrap_words(&make_printable(words), WIDTH - 2);
        lines.iter().fold(self, |text, line| text.add_line(&format!("# {line}")))
    }

    /// Adds comments, each on lines of its own.
    pub(super) fn add_comments(self, all: impl IntoIterator<Item = impl AsRef<str>>) -> Self {
        all.into_iter().fold(self, |text, words| text.add_comment(words.as_ref()))
    }

    /// Adds a line as it is.
    pub(super) fn add_line(mut self, line: &str) -> Self {
        self.0.push_str(line.trim_end());
        self.0.push('\n');
        self
    }

    pub(super) fn add_empty_line(self) -> Self {
        self.add_line("")
    }

    /// Adds an empty line and the head of a table.
    pub(super) fn add_table(self, name: &str) -> Self {
        self.add_empty_line().add_line(&format!("[{name}]"))
    }

    /// Adds a key with a text.
    pub(super) fn add_text(self, key: &str, value: &str) -> Self {
        let value = toml::Value::String(value.to_owned());
        self.add_line(&format!("{key} = {value}"))
    }

    /// Adds a key with the shortest decimal number that reads back as the same.
    pub(super) fn add_number(self, key: &str, value: f64) -> Self {
        self.add_line(&format!("{key} = {value:?}"))
    }

    /// Adds a line per key and number.
    pub(super) fn add_numbers(self, rows: &[(&str, f64)]) -> Self {
        rows.iter().fold(self, |text, (key, value)| text.add_number(key, *value))
    }

    /// Adds a key with a word or a list of words.
    pub(super) fn add_word(self, key: &str, value: impl Serialize) -> Self {
        // words and lists of them cannot fail
        let value = toml::Value::try_from(value).unwrap_or_else(|_| toml::Value::Array(Vec::new()));
        self.add_line(&format!("{key} = {value}"))
    }

    pub(super) fn into_text(self) -> String {
        self.0
    }
}

/// How a first job treats a number of the blade.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ParameterRole {
    /// Measured on the blade by the user: freed with this relative standard deviation, or held where there is
    /// none.
    Yours(Option<f64>),
    /// Poorly known before a fit: freed with this relative standard deviation around the example's value.
    Guessed(f64),
    /// Fitted between two bounds.
    Fitted([f64; 2]),
    /// Fitted between two bounds in units of the inverse of the greatest head speed.
    FittedOverSpeed([f64; 2]),
}

// Bounds are about a decade wide. With wider ones, searches that start far from the middle fail.

/// Bounds of the decaying part of the friction coefficient: rubber on wet glass at rest.
const FALLING: [f64; 2] = [0.03, 0.6];
/// Bounds of the friction coefficient at high speed.
const STAYING: [f64; 2] = [0.1, 0.8];
/// Bounds of the decay rate of the friction: over an eighth of the greatest speed to five times that speed.
/// Outside of them the friction looks constant.
const DECAY: [f64; 2] = [0.2, 8.0];
/// Bounds around the 195 Hz of the paper's blade.
const NECK_HZ: [f64; 2] = [60.0, 600.0];
/// Bounds of the stiffness ratio: from a negligible shoulder to a nearly rigid one.
const SHOULDER: [f64; 2] = [4.0, 60.0];
/// A part that was weighed or computed from its cross section.
const WEIGHED: ParameterRole = ParameterRole::Yours(Some(0.05));
/// Read from a scale below the blade.
const PRELOAD: ParameterRole = ParameterRole::Yours(Some(0.05));
/// Measured on a picture of the cross section; a fit holds lengths.
const MEASURED: ParameterRole = ParameterRole::Yours(None);
/// A natural frequency or an angle of a blade of the same kind.
const SIMILAR: ParameterRole = ParameterRole::Guessed(0.2);
/// The largest deviation of a freed constant: damping ratios of rubbers differ by factors.
const UNKNOWN: ParameterRole = ParameterRole::Guessed(0.5);

/// The parameters of the example's blade, shoulder and friction in the form of a draft.
pub(crate) const PARAMETER_PLAN: [(&str, ParameterRole); 21] = [
    ("blade.head_mass_kg", WEIGHED),
    ("blade.neck_mass_kg", WEIGHED),
    ("blade.lip_mass_kg", WEIGHED),
    ("blade.neck_length_m", MEASURED),
    ("blade.lip_length_m", MEASURED),
    ("blade.neck_centre_m", MEASURED),
    ("blade.lip_centre_m", MEASURED),
    ("blade.neck_inertia_kg_m2", WEIGHED),
    ("blade.lip_inertia_kg_m2", WEIGHED),
    ("blade.preload_force_n", PRELOAD),
    ("blade.head_natural_frequency_hz", SIMILAR),
    ("blade.neck_natural_frequency_hz", ParameterRole::Fitted(NECK_HZ)),
    ("blade.lip_natural_frequency_hz", SIMILAR),
    ("blade.head_damping_ratio", UNKNOWN),
    ("blade.neck_damping_ratio", UNKNOWN),
    ("blade.lip_damping_ratio", UNKNOWN),
    ("shoulder.contact_angle_rad", SIMILAR),
    ("shoulder.stiffness_ratio", ParameterRole::Fitted(SHOULDER)),
    ("friction.a", ParameterRole::Fitted(FALLING)),
    ("friction.b_s_per_m", ParameterRole::FittedOverSpeed(DECAY)),
    ("friction.c", ParameterRole::Fitted(STAYING)),
];

/// The parameters of a blade with or without a shoulder.
pub(super) fn plan_parameters(shoulder: bool) -> impl Iterator<Item = (&'static str, ParameterRole)> {
    PARAMETER_PLAN.into_iter().filter(move |(name, _)| shoulder || !name.starts_with("shoulder."))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comment_stays_a_comment_whatever_a_file_is_called() {
        let text = CommentedToml::default().add_comment("of data/a\nformat = 2\r# and \u{2028}b").into_text();
        assert!(text.lines().all(|line| line.starts_with("# ")), "{text}");
        let long = CommentedToml::default().add_comment(&"word ".repeat(60)).into_text();
        assert!(long.lines().count() > 2 && long.lines().all(|line| line.chars().count() <= WIDTH));
    }

    #[test]
    fn numbers_and_texts_read_back_as_they_are() {
        let text = CommentedToml::default()
            .add_number("a", 7.687e-12)
            .add_number("b", 20.0)
            .add_text("c", "a\"b\\c\n")
            .into_text();
        let table: toml::Table = text.parse().unwrap();
        assert_eq!((table["a"].as_float(), table["b"].as_float()), (Some(7.687e-12), Some(20.0)));
        assert_eq!(table["c"].as_str(), Some("a\"b\\c\n"));
    }
}
