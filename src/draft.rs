//! Writes a first scene and a first job for a recording. Comments in these files list the findings in the
//! recording, the reason for each number, and the numbers that only the user knows.
//!
//! The blade is that of the bundled example. Parameters that a fit can determine from any recording
//! (friction, stiffness, damping) are free within wide bounds; those that must be measured on the blade
//! (lengths, masses, preload) are marked.

mod findings;
mod job;
mod scene;
mod slider;
mod stroke;

use crate::text::{make_printable, wrap_words};
pub(crate) use findings::DraftFindings;
pub(crate) use job::write_job;
pub(crate) use scene::{FittedScene, YOURS_MARK, write_fitted_scene, write_scene, write_scene_alone};
use serde::Serialize;
pub(crate) use slider::KnownSlider;
pub(crate) use stroke::KnownStroke;

/// Maximum width of a comment line, in characters.
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

    /// Adds a line without its trailing blanks.
    pub(super) fn add_line(mut self, line: &str) -> Self {
        self.0.push_str(line.trim_end());
        self.0.push('\n');
        self
    }

    pub(super) fn add_empty_line(self) -> Self {
        self.add_line("")
    }

    /// Adds an empty line and the header of a table.
    pub(super) fn add_table(self, name: &str) -> Self {
        self.add_empty_line().add_line(&format!("[{name}]"))
    }

    /// Adds a key with a string.
    pub(super) fn add_text(self, key: &str, value: &str) -> Self {
        let value = toml::Value::String(value.to_owned());
        self.add_line(&format!("{key} = {value}"))
    }

    /// Adds a key with a number, written as the shortest decimal that is read back unchanged.
    pub(super) fn add_number(self, key: &str, value: f64) -> Self {
        self.add_line(&format!("{key} = {value:?}"))
    }

    /// Adds one line for each key with its number.
    pub(super) fn add_numbers(self, rows: &[(&str, f64)]) -> Self {
        rows.iter().fold(self, |text, (key, value)| text.add_number(key, *value))
    }

    /// Adds a key with a word or a list of words.
    pub(super) fn add_word(self, key: &str, value: impl Serialize) -> Self {
        // converting words and lists of words cannot fail
        let value = toml::Value::try_from(value).unwrap_or_else(|_| toml::Value::Array(Vec::new()));
        self.add_line(&format!("{key} = {value}"))
    }

    pub(super) fn into_text(self) -> String {
        self.0
    }
}

/// Role of a parameter of the blade in a first job.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ParameterRole {
    /// Must be measured on the blade by the user. Free within the default prior of its kind.
    Yours,
    /// Poorly known before a fit. Free within the default prior of its kind around the value of the example.
    Guessed,
    /// Fitted between two bounds.
    Fitted([f64; 2]),
    /// Fitted between two bounds. Each bound is one of these two numbers divided by the maximum head speed in
    /// m/s.
    FittedOverSpeed([f64; 2]),
}

// Bounds are about a decade wide. With wider bounds, searches that start far from their middle fail.

/// Bounds of the part of the friction coefficient that decays with speed, for rubber on wet glass.
const FALLING: [f64; 2] = [0.03, 0.6];
/// Bounds of the friction coefficient at high speed.
const STAYING: [f64; 2] = [0.1, 0.8];
/// Bounds of the product of the decay rate of the friction, s/m, and the maximum head speed, m/s. Within
/// them, the friction decays over a speed between an eighth of the maximum head speed and five times that
/// speed; outside them, the friction looks constant.
const DECAY: [f64; 2] = [0.2, 8.0];
/// Bounds of the natural frequency of the neck, Hz, around the 195 Hz of the blade in the paper.
const NECK_HZ: [f64; 2] = [60.0, 600.0];
/// Bounds of the ratio of shoulder stiffness to neck stiffness: from a negligible shoulder to a nearly rigid
/// one.
const SHOULDER: [f64; 2] = [4.0, 60.0];
/// Parameters of the blade, the shoulder and the friction in the order of a draft, with their roles.
pub(crate) const PARAMETER_PLAN: [(&str, ParameterRole); 21] = [
    ("blade.head_mass_kg", ParameterRole::Yours),
    ("blade.neck_mass_kg", ParameterRole::Yours),
    ("blade.lip_mass_kg", ParameterRole::Yours),
    ("blade.neck_length_m", ParameterRole::Yours),
    ("blade.lip_length_m", ParameterRole::Yours),
    ("blade.neck_centre_m", ParameterRole::Yours),
    ("blade.lip_centre_m", ParameterRole::Yours),
    ("blade.neck_inertia_kg_m2", ParameterRole::Yours),
    ("blade.lip_inertia_kg_m2", ParameterRole::Yours),
    ("blade.preload_force_n", ParameterRole::Yours),
    ("blade.head_natural_frequency_hz", ParameterRole::Guessed),
    ("blade.neck_natural_frequency_hz", ParameterRole::Fitted(NECK_HZ)),
    ("blade.lip_natural_frequency_hz", ParameterRole::Guessed),
    ("blade.head_damping_ratio", ParameterRole::Guessed),
    ("blade.neck_damping_ratio", ParameterRole::Guessed),
    ("blade.lip_damping_ratio", ParameterRole::Guessed),
    ("shoulder.contact_angle_rad", ParameterRole::Guessed),
    ("shoulder.stiffness_ratio", ParameterRole::Fitted(SHOULDER)),
    ("friction.a", ParameterRole::Fitted(FALLING)),
    ("friction.b_s_per_m", ParameterRole::FittedOverSpeed(DECAY)),
    ("friction.c", ParameterRole::Fitted(STAYING)),
];

/// Parameters of a blade with or without a shoulder, with their roles.
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
