//! Whether the numbers of a blade are believable: a table of quantities with the range in which each is
//! expected and the slips that usually lead out of it.
//!
//! A value out of its range is a finding and no refusal: a blade may be unlike all others.

mod ranges;

pub use ranges::{SCENE_RANGES, SECTION_RANGES};

use crate::blade::parameters;
use crate::text::{format_plain, round_to_digits};
use serde::Serialize;

/// Digits of a number in a finding.
const DIGITS: usize = 6;

/// A value that is hard to believe.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlausibilityFinding {
    /// Table and key.
    pub key: String,
    /// The value and its unit.
    pub found: String,
    /// The range and its reason.
    pub expected: String,
    /// What it probably is, and what to do.
    pub advice: String,
}

impl std::fmt::Display for PlausibilityFinding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { key, found, expected, advice } = self;
        write!(f, "key `{key}`: found {found}, expected {expected}; {advice}")
    }
}

/// A usual slip: the factor by which it is undone, and its name.
#[derive(Debug, Clone, Copy)]
pub struct UnitSlip {
    /// What the value has to be multiplied by.
    pub factor: f64,
    /// What was written as what.
    pub words: &'static str,
}

/// Values by key; `None` for what is not there.
pub type ValueLookup<'a> = dyn Fn(&str) -> Option<f64> + 'a;

/// What is held against a range.
#[derive(Debug, Clone, Copy)]
pub enum PlausibilitySubject {
    /// The value of the key.
    Value,
    /// A number that is computed from it and from others; not judged where one of those has a finding.
    Derived {
        /// What it is.
        name: &'static str,
        /// The keys that it depends on, its own first.
        keys: &'static [&'static str],
        /// How it is computed.
        of: fn(&ValueLookup<'_>) -> Option<f64>,
    },
}

/// A row of the table.
#[derive(Debug, Clone, Copy)]
pub struct PlausibleRange {
    /// Table and key.
    pub key: &'static str,
    /// What is judged.
    pub judged: PlausibilitySubject,
    /// Unit of what is judged.
    pub unit: &'static str,
    /// Least and greatest value without a finding.
    pub range: [f64; 2],
    /// Why these limits.
    pub reason: &'static str,
    /// Slips to look for, the likeliest first.
    pub slips: &'static [UnitSlip],
}

/// What is hard to believe among the values of a file, in the order of the table.
///
/// `written` gives the key under which a file has the quantity of another key; a quantity that is written
/// another way is judged like a derived one.
#[must_use]
pub fn find_implausible(
    table: &[PlausibleRange],
    value: &ValueLookup<'_>,
    written: &dyn Fn(&'static str) -> &'static str,
) -> Vec<PlausibilityFinding> {
    let mut found: Vec<PlausibilityFinding> = Vec::new();
    for row in table {
        let doubted = |key: &&str| found.iter().any(|finding| finding.key == *key);
        let (judged, rests_on_doubt) = match row.judged {
            PlausibilitySubject::Derived { keys, of, .. } => (of(value), keys.iter().any(doubted)),
            // a frequency from a stiffness rests on masses and lengths, and the other way round
            PlausibilitySubject::Value => (value(row.key), written(row.key) != row.key && !found.is_empty()),
        };
        let judged = judged.filter(|judged| !rests_on_doubt && !row.admits(*judged));
        found.extend(judged.map(|judged| row.describe_finding(judged, value, written(row.key))));
    }
    found
}

impl PlausibleRange {
    fn admits(&self, judged: f64) -> bool {
        let [least, greatest] = self.range;
        (least..=greatest).contains(&judged)
    }

    fn describe_finding(
        &self,
        judged: f64,
        value: &ValueLookup<'_>,
        key: &'static str,
    ) -> PlausibilityFinding {
        let [least, greatest] = self.range.map(format_value);
        let unit = if self.unit == "1" { String::new() } else { format!(" {}", self.unit) };
        let name = match self.judged {
            PlausibilitySubject::Derived { name, .. } => format!(" for {name}"),
            PlausibilitySubject::Value if key != self.key => {
                format!(" for {}", parameters::find_parameter(self.key).map_or(self.key, |p| p.meaning))
            }
            PlausibilitySubject::Value => String::new(),
        };
        PlausibilityFinding {
            key: key.to_owned(),
            found: format!("{}{unit}{name}", format_value(judged)),
            expected: format!("{least} to {greatest}{unit} ({})", self.reason),
            // a slip is one of the row's own unit
            advice: self.advise_correction(judged, value(key).filter(|_| key == self.key)),
        }
    }

    /// The likeliest slip that leads back into the range, or else what to check. All that is judged by slips
    /// is proportional to the value of its own key.
    fn advise_correction(&self, judged: f64, written: Option<f64>) -> String {
        let slip = self.slips.iter().find(|slip| self.admits(judged * slip.factor));
        match slip.zip(written) {
            Some((slip, written)) => {
                format!("probably {}: then write {}", slip.words, format_value(written * slip.factor))
            }
            None => "check the value and its unit".to_owned(),
        }
    }
}

fn format_value(value: f64) -> String {
    format_plain(round_to_digits(value, DIGITS))
}
