//! A first scene and a first job for a recording, with comments: what was found in the recording, why each
//! number was chosen, and which numbers only the user can give.
//!
//! The blade is that of the bundled example. What a job can find in any recording (friction, stiffness,
//! damping) starts there and is free within wide bounds; what has to be measured on the blade (lengths,
//! masses, preload) is marked.

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

// TOML with comments.

/// Widest line of a comment, characters.
const WIDTH: usize = 100;

/// A file of TOML as it grows.
#[derive(Default)]
pub(super) struct CommentedToml(String);

impl CommentedToml {
    /// A comment, broken into lines.
    pub(super) fn add_comment(mut self, words: &str) -> Self {
        wrap_words(&make_printable(words), WIDTH - 2)
            .iter()
            .for_each(|line| self.push_line(&format!("# {line}")));
        self
    }

    /// Several comments, each on lines of its own.
    pub(super) fn add_comments(self, all: impl IntoIterator<Item = impl AsRef<str>>) -> Self {
        all.into_iter().fold(self, |text, words| text.add_comment(words.as_ref()))
    }

    /// Lines as they are.
    pub(super) fn add_line(mut self, line: &str) -> Self {
        self.push_line(line);
        self
    }

    pub(super) fn add_empty_line(self) -> Self {
        self.add_line("")
    }

    /// A key with a text.
    pub(super) fn add_text(self, key: &str, value: &str) -> Self {
        let value = toml::Value::String(value.to_owned());
        self.add_line(&format!("{key} = {value}"))
    }

    /// A key with a number.
    pub(super) fn add_number(self, key: &str, value: f64) -> Self {
        self.add_line(&format!("{key} = {}", format_toml_number(value)))
    }

    /// A key with a word of a list, or several.
    pub(super) fn add_word(self, key: &str, value: impl Serialize) -> Self {
        // (words and lists of them cannot fail)
        let value = toml::Value::try_from(value).unwrap_or_else(|_| toml::Value::Array(Vec::new()));
        self.add_line(&format!("{key} = {value}"))
    }

    pub(super) fn into_text(self) -> String {
        self.0
    }

    fn push_line(&mut self, line: &str) {
        self.0.push_str(line.trim_end());
        self.0.push('\n');
    }
}

/// The shortest decimal number that reads back as the same, with a point or a power of ten, as TOML wants it.
pub(super) fn format_toml_number(value: f64) -> String {
    format!("{value:?}")
}

// What a first job does with each number of a blade.

/// What becomes of a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ParameterRole {
    /// The user measures it on the blade, to this relative standard deviation: it is held there, or freed
    /// within it where it is a constant that a fit may free.
    Yours(Option<f64>),
    /// Nobody knows it well before a fit: freed within this relative standard deviation around the example.
    Guessed(f64),
    /// What the fit is for: free between two bounds.
    Fitted([f64; 2]),
    /// Free between these multiples of one over the greatest speed of the head.
    FittedOverSpeed([f64; 2]),
}

// Bounds are about a decade wide: wider ones led searches from other places than the middle nowhere.

/// Rubber on wet glass at rest, less what stays at speed.
const FALLING: [f64; 2] = [0.03, 0.6];
/// What stays at speed.
const STAYING: [f64; 2] = [0.1, 0.8];
/// Friction that falls over an eighth of the greatest speed, or over five times as much: what is outside
/// shows as a constant.
const DECAY: [f64; 2] = [0.2, 8.0];
/// About the 195 Hz of the paper's blade.
const NECK_HZ: [f64; 2] = [60.0, 600.0];
/// From a shoulder that is hardly felt to one that is as good as rigid.
const SHOULDER: [f64; 2] = [4.0, 60.0];
/// A part that was weighed or computed from its cross section.
const WEIGHED: ParameterRole = ParameterRole::Yours(Some(0.05));
/// Read from a scale below the blade.
const PRELOAD: ParameterRole = ParameterRole::Yours(Some(0.05));
/// Measured on a picture of the cross section; a fit holds lengths.
const MEASURED: ParameterRole = ParameterRole::Yours(None);
/// A natural frequency or an angle of a blade of the same kind.
const SIMILAR: ParameterRole = ParameterRole::Guessed(0.2);
/// The widest that a constant may be freed: dampings of rubber differ by a factor.
const UNKNOWN: ParameterRole = ParameterRole::Guessed(0.5);

/// Every number of the example's blade, shoulder and friction in the form in which a draft writes it.
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

/// The numbers of a blade with or without a shoulder.
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
