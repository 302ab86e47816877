//! The folder of a report: what is written into it, and what an earlier report left there.

use crate::failure::Failure;
use crate::files::{self, drawn};
use crate::global::Global;
use serde_json::Value;
use std::fs;
use std::path::Path;
use wiperlab::compare::Table;
use wiperlab::report::{Drawing, FigureBlock};

const JSON: &str = "report.json";
const PAGE: &str = "index.html";
const FIGURE: &str = ".svg";
const PAPER: &str = "paper";

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
    /// Writes everything or nothing, and then removes the figures of an earlier report that this one does not
    /// have.
    pub fn write(&self, folder: &Path, global: &Global) -> Result<(), Failure> {
        let earlier = listed(folder);
        let outputs = self.files();
        files::write_all(folder, &outputs)?;
        let left = earlier
            .iter()
            .flat_map(|name| of_figure(name))
            .filter(|name| !outputs.iter().any(|(written, _)| written == name));
        for name in left {
            remove(&folder.join(name));
        }
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

/// Figures that the report in a folder lists; nothing where there is none, or where it cannot be read.
fn listed(folder: &Path) -> Vec<String> {
    let report: Value = files::read_json(&folder.join(JSON))
        .ok()
        .and_then(|text| serde_json::from_str(&text).ok())
        .unwrap_or_default();
    let names =
        report["figures"].as_array().into_iter().flatten().filter_map(|figure| figure["file"].as_str());
    names.filter(|name| is_figure(name)).map(str::to_owned).collect()
}

/// Whether a name can only be that of a figure in the folder itself.
fn is_figure(name: &str) -> bool {
    let plain = name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.'));
    plain && name.ends_with(FIGURE) && !name.starts_with('.') && !name.contains("..")
}

/// The files of a figure: for the screen and for a paper.
fn of_figure(name: &str) -> [String; 3] {
    let stem = name.trim_end_matches(FIGURE);
    [name.to_owned(), format!("{PAPER}/{stem}-85mm.svg"), format!("{PAPER}/{stem}-170mm.svg")]
}

/// Removes a file of a report's folder, but no folder, no link and nothing in a folder `paper` that is a link
/// to another one.
fn remove(path: &Path) {
    let elsewhere = path.parent().is_some_and(|folder| folder.ends_with(PAPER) && folder.is_symlink());
    if !elsewhere && fs::symlink_metadata(path).is_ok_and(|found| found.is_file()) {
        let removed = fs::remove_file(path);
        if let Err(error) = removed {
            warn_line!(
                "warning: {}: left from an earlier report, and cannot be removed: {error}",
                path.display()
            );
        }
    }
}
