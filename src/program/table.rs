//! Tables that are written row by row.

use crate::program::files::PendingFile;
use std::time::{Duration, Instant};

/// A table on its way to its file.
pub struct StreamedTable {
    pub file: PendingFile,
    row: String,
    /// Rows that are held back until there are enough of them, and how many those are.
    held: String,
    missing: usize,
    /// Time spent on text and file, which is not the run's.
    pub spent: Duration,
}

impl StreamedTable {
    pub fn new(mut file: PendingFile, header: &str, least_rows: usize) -> Self {
        file.write_text(header);
        file.write_text("\n");
        Self { file, row: String::new(), held: String::new(), missing: least_rows, spent: Duration::ZERO }
    }

    pub fn add_row(&mut self, push: impl FnOnce(&mut String)) {
        let clock = Instant::now();
        self.row.clear();
        push(&mut self.row);
        if self.missing > 1 {
            self.held.push_str(&self.row);
        } else {
            self.file.write_text(&std::mem::take(&mut self.held));
            self.file.write_text(&self.row);
        }
        self.missing = self.missing.saturating_sub(1);
        self.spent += clock.elapsed();
    }
}
