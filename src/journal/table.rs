//! Records as rows of a table for people and for other programs.

use super::record::Record;

/// A record of which a table can be made.
pub trait Tabled: Record {
    /// What a record was made for, in a word, where that differs between records; and how it ended.
    fn group(&self) -> (&'static str, &'static str);

    /// What the header says, as pairs of what and value.
    fn about(body: &Self::Body) -> Vec<[String; 2]>;

    /// Columns of the table, units in their names.
    fn columns(body: &Self::Body) -> Vec<String>;

    /// Cells of the row of a record that stands in line `at`, counted from 0 behind the header; empty where
    /// there is no value.
    fn cells(&self, at: usize, body: &Self::Body) -> Vec<String>;

    /// By what records are compared, the lowest being the best; `None` where there is no such thing.
    fn cost(&self, body: &Self::Body) -> Option<f64> {
        let _ = body;
        None
    }
}
