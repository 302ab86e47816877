//! The folder of a report: what is written into it.

use crate::compare::Table;
use crate::figures::{Drawing, FigureBlock};
use crate::program::failure::Failure;
use crate::program::files::{self, Place, Writer, drawn};
use crate::program::global::Global;
use std::path::Path;

const JSON: &str = "report.json";
const PAGE: &str = "index.html";
const FIGURE: &str = ".svg";

/// What goes into a folder.
pub struct Output<'a> {
    pub figures: Vec<&'a FigureBlock>,
    pub json: String,
    pub tables: &'a [Table],
    pub page: String,
    /// What is printed.
    pub summary: Vec<String>,
}

impl Output<'_> {
    /// Writes everything or nothing.
    pub fn write(&self, folder: &Path, writer: &Writer, global: &Global) -> Result<(), Failure> {
        files::write_outputs(folder, writer, &self.files())?;
        if !global.quiet {
            self.summary.iter().for_each(|line| print_line!("{line}"));
            print_line!("written to {}", folder.join(PAGE).display());
        }
        Ok(())
    }

    fn files(&self) -> Vec<(String, Vec<u8>)> {
        let figure = |block: &&FigureBlock| match &block.drawing {
            Drawing::Chart(figure) => drawn(block.file.trim_end_matches(FIGURE), figure).to_vec(),
            Drawing::Moving(svg) => vec![(block.file.clone(), svg.clone().into_bytes())],
        };
        let page = [(JSON, &self.json), (PAGE, &self.page)]
            .map(|(name, text)| (name.to_owned(), text.clone().into_bytes()));
        let tables = self.tables.iter().map(|t| (t.file.to_owned(), t.text.clone().into_bytes()));
        self.figures.iter().flat_map(figure).chain(tables).chain(page).collect()
    }
}

/// Refuses a folder that a report must not be written into, before the model is run.
pub fn check(folder: &Path, writer: &Writer) -> Result<(), Failure> {
    Place::check(folder, writer, &[JSON, PAGE]).map(|_| ())
}
