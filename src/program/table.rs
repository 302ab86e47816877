//! Tables that are written row by row.

use crate::program::files::Growing;
use std::time::{Duration, Instant};

/// A table on its way to its file.
pub struct Table {
    pub file: Growing,
    row: String,
    /// Rows that are held back until there are enough of them, and how many those are.
    held: String,
    missing: usize,
    /// Time spent on text and file, which is not the run's.
    pub spent: Duration,
}

impl Table {
    pub fn new(mut file: Growing, header: &str, least_rows: usize) -> Self {
        file.write(header);
        file.write("\n");
        Self { file, row: String::new(), held: String::new(), missing: least_rows, spent: Duration::ZERO }
    }

    pub fn add(&mut self, push: impl FnOnce(&mut String)) {
        let clock = Instant::now();
        self.row.clear();
        push(&mut self.row);
        if self.missing > 1 {
            self.held.push_str(&self.row);
        } else {
            self.file.write(&std::mem::take(&mut self.held));
            self.file.write(&self.row);
        }
        self.missing = self.missing.saturating_sub(1);
        self.spent += clock.elapsed();
    }
}
