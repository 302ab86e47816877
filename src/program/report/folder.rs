//! The folder of a report: what is written into it.

use crate::compare::ComparisonTable;
use crate::figures::{Drawing, FigureBlock};
use crate::program::failure::Failure;
use crate::program::files::{self, OutputFolder, WritePolicy, figure_files};
use crate::program::global::GlobalArgs;
use std::path::Path;

const JSON_FILE: &str = "report.json";
const PAGE_FILE: &str = "index.html";
const FIGURE_EXTENSION: &str = ".svg";

/// What goes into a folder.
pub struct ReportFiles<'a> {
    pub figures: Vec<&'a FigureBlock>,
    pub json: String,
    pub tables: &'a [ComparisonTable],
    pub page: String,
    /// What is printed.
    pub summary: Vec<String>,
}

impl ReportFiles<'_> {
    /// Writes everything or nothing.
    pub fn write_to_folder(
        &self,
        folder: &Path,
        writer: &WritePolicy,
        global: &GlobalArgs,
    ) -> Result<(), Failure> {
        files::write_outputs(folder, writer, &self.to_files())?;
        if !global.quiet {
            self.summary.iter().for_each(|line| print_line!("{line}"));
            print_line!("written to {}", folder.join(PAGE_FILE).display());
        }
        Ok(())
    }

    fn to_files(&self) -> Vec<(String, Vec<u8>)> {
        let figure = |block: &&FigureBlock| match &block.drawing {
            Drawing::Chart(figure) => {
                figure_files(block.file.trim_end_matches(FIGURE_EXTENSION), figure).to_vec()
            }
            Drawing::Moving(svg) => vec![(block.file.clone(), svg.clone().into_bytes())],
        };
        let page = [(JSON_FILE, &self.json), (PAGE_FILE, &self.page)]
            .map(|(name, text)| (name.to_owned(), text.clone().into_bytes()));
        let tables = self.tables.iter().map(|t| (t.file.to_owned(), t.text.clone().into_bytes()));
        self.figures.iter().flat_map(figure).chain(tables).chain(page).collect()
    }
}

/// Refuses a folder that a report must not be written into, before the model is run.
pub fn check_report_folder(folder: &Path, writer: &WritePolicy) -> Result<(), Failure> {
    OutputFolder::check(folder, writer, &[JSON_FILE, PAGE_FILE]).map(|_| ())
}
