//! Reading and writing of files. The outputs of a command appear all together or not at all, and replace only
//! files that the same command made.

mod guard;
mod input;
mod marker;
mod preserved_files;
mod staging;

use super::failure::{Failure, Outcome};
use crate::toml_file;
use clap::Args;
use guard::OutputGuard;
pub(crate) use input::{
    FileSize, check_data_size, is_standard_input, read_data, read_json, read_text, read_toml,
};
use marker::MARKER_FILE;
pub(crate) use marker::{CsvDialect, FolderMarker, OutputCommand, Overwrite, WritePolicy};
use plain_charts::{Figure, Medium};
pub(crate) use preserved_files::{SIMULATION_SUMMARY, is_simulation_summary};
pub(crate) use staging::{OutputStaging, check_path_free};
use std::fs::File;
use std::io::{self, BufWriter, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Name of the result of a fit, in the folder of its job.
pub(crate) const RESULT_FILE: &str = "result.json";

/// Name of a file or folder for messages and headings.
pub(crate) fn display_name(path: &Path) -> String {
    if is_standard_input(path) {
        return "standard-input".to_owned();
    }
    let full = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    full.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

/// The folder that contains a file.
pub(crate) fn containing_folder(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Resolves a path that is written in `file`: the path is relative to the folder of that file, not to the
/// working directory.
pub(crate) fn resolve_path(file: &Path, named: &str) -> PathBuf {
    containing_folder(file).join(named)
}

/// Like [`resolve_path`], for a path that must exist; otherwise returns the reason of the refusal.
pub(crate) fn resolve_existing_path(file: &Path, named: &str) -> Result<PathBuf, String> {
    let path = resolve_path(file, named);
    if path.exists() {
        return Ok(path);
    }
    Err(format!(
        "found \"{named}\", but there is no `{}`; a path in a file is relative to that file{}",
        path.display(),
        toml_file::path_hint(named)
    ))
}

/// Rewrites a path so that it is relative to `folder`; the result is absolute if there is no relative path.
pub(crate) fn relative_path(folder: &Path, path: &Path) -> Outcome<String> {
    let in_full = |path: &Path| {
        std::path::absolute(path)
            .map_err(|error| Failure::at(path.display(), format!("cannot be found from here: {error}")))
    };
    // only the existing part of the path has its symbolic links resolved; this is needed since `..` after a
    // link leads to the parent of its target
    let real = |path: &Path| -> Outcome<PathBuf> {
        let full = in_full(path)?;
        let there = full.ancestors().find(|part| part.exists()).unwrap_or(Path::new(""));
        let rest = full.strip_prefix(there).unwrap_or(Path::new(""));
        Ok(there.canonicalize().map_or_else(|_| full.clone(), |there| there.join(rest)))
    };
    let target = real(path)?;
    let way = pathdiff::diff_paths(&target, real(folder)?).unwrap_or(target);
    way.to_str().map(|text| text.replace(std::path::MAIN_SEPARATOR, "/")).ok_or_else(|| {
        Failure::at(
            path.display(),
            "found a path that is no Unicode text, expected one that a TOML file can name; rename the folder",
        )
    })
}

/// Writes all files of a command into `folder`, which is created if missing. All files are first written
/// under temporary names next to their final places, then renamed.
pub(crate) fn write_outputs(
    folder: &Path,
    writer: &WritePolicy,
    files: &[(impl AsRef<str>, Vec<u8>)],
) -> Outcome<()> {
    OutputFolder::find_writable_ancestor(folder)?;
    commit_files(OutputStaging::new(folder, writer, &file_names(files))?, files)
}

/// Like [`write_outputs`], for files that the marker of the folder does not list; the caller ensures that
/// they replace nothing of value.
pub(crate) fn write_unmarked(folder: &Path, files: &[(impl AsRef<str>, Vec<u8>)]) -> Outcome<()> {
    OutputFolder::find_writable_ancestor(folder)?;
    commit_files(OutputStaging::new_unmarked(folder, &file_names(files))?, files)
}

fn file_names(files: &[(impl AsRef<str>, Vec<u8>)]) -> Vec<&str> {
    files.iter().map(|(name, _)| name.as_ref()).collect()
}

fn commit_files(mut staging: OutputStaging, files: &[(impl AsRef<str>, Vec<u8>)]) -> Outcome<()> {
    for (name, bytes) in files {
        staging.stage_file(name.as_ref(), bytes.as_slice())?;
    }
    staging.commit()
}

/// The files of a figure: one for the screen and, under `paper/`, one for a column and one for a page of a
/// journal.
pub(crate) fn figure_files(name: &str, figure: &Figure) -> [(String, Vec<u8>); 3] {
    let file = |name: String, medium| (name, figure.to_svg(medium).into_bytes());
    [
        file(format!("{name}.svg"), Medium::Screen),
        file(format!("paper/{name}-85mm.svg"), Medium::Column),
        file(format!("paper/{name}-170mm.svg"), Medium::Page),
    ]
}

/// A reader of a text that is produced piece by piece.
pub(crate) struct ChunkReader<I> {
    pieces: I,
    present: io::Cursor<Vec<u8>>,
}

impl<I: Iterator<Item = String>> ChunkReader<I> {
    pub(crate) fn new(pieces: I) -> Self {
        Self { pieces, present: io::Cursor::default() }
    }
}

impl<I: Iterator<Item = String>> Read for ChunkReader<I> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            let read = self.present.read(buffer)?;
            if read > 0 || buffer.is_empty() {
                return Ok(read);
            }
            match self.pieces.next() {
                Some(piece) => self.present = io::Cursor::new(piece.into_bytes()),
                None => return Ok(0),
            }
        }
    }
}

/// A folder for results that are written while they are computed. They appear when all are complete; if the
/// program is killed, nothing of them remains.
#[derive(Debug)]
pub(crate) struct OutputFolder {
    folder: PathBuf,
    writer: WritePolicy,
    /// Folder of the unnamed temporary files until they are complete: the output folder or, if that does not
    /// exist yet, its nearest existing parent.
    temporary_folder: PathBuf,
}

impl OutputFolder {
    /// Checks, before the results are computed, that `folder` exists or can be created, that it is writable,
    /// and that the files `names` may replace what it contains. This is checked again when the files are
    /// written.
    pub(crate) fn check(folder: &Path, writer: &WritePolicy, names: &[&str]) -> Outcome<Self> {
        let near = Self::find_writable_ancestor(folder)?;
        names.iter().chain([&MARKER_FILE]).try_for_each(|name| check_path_free(&folder.join(name)))?;
        let guard = OutputGuard::new(folder, writer, names)?;
        names.iter().try_for_each(|name| guard.check_overwrite(name, None).map(|_| ()))?;
        Ok(Self { folder: folder.to_owned(), writer: writer.clone(), temporary_folder: near })
    }

    /// The nearest existing parent of a folder, checked to be writable.
    fn find_writable_ancestor(folder: &Path) -> Outcome<PathBuf> {
        let near = folder.ancestors().find(|path| path.exists() || path.is_symlink());
        let near = near.filter(|path| !path.as_os_str().is_empty()).unwrap_or(Path::new(".")).to_owned();
        if !near.is_dir() {
            let found = if near.exists() { "a file" } else { "a broken link" };
            return Err(Failure::at(
                near.display(),
                format!("is {found}, expected a folder for the results; choose another one"),
            ));
        }
        tempfile::tempfile_in(&near).map_err(|error| {
            Failure::at(
                folder.display(),
                format!(
                    "cannot be written: {error}; expected a folder for the results, so choose another one"
                ),
            )
        })?;
        Ok(near)
    }

    /// A file that is written while the results are computed; it gets its name when all files are complete
    /// ([`Self::commit`]).
    pub(crate) fn create_file(&self, name: &'static str) -> Outcome<PendingFile> {
        let path = self.folder.join(name);
        let file =
            tempfile::tempfile_in(&self.temporary_folder).map_err(|error| write_failure(&path, &error))?;
        Ok(PendingFile { name, path, to: BufWriter::new(file), failed: None })
    }

    /// Puts the pending files and the given other files into the folder, or none of them.
    pub(crate) fn commit(
        &self,
        files: Vec<PendingFile>,
        others: &[(impl AsRef<str>, Vec<u8>)],
    ) -> Outcome<()> {
        let files = files.into_iter().map(PendingFile::into_rewound_file).collect::<Result<Vec<_>, _>>()?;
        let grown = files.iter().map(|(name, _)| *name);
        let names: Vec<&str> = grown.chain(file_names(others)).collect();
        let mut staging = OutputStaging::new(&self.folder, &self.writer, &names)?;
        for (name, file) in files {
            staging.stage_file(name, file)?;
        }
        commit_files(staging, others)
    }
}

/// An unnamed temporary file for data that do not fit into memory. It is in `folder` or in the nearest
/// existing parent.
pub(crate) fn create_scratch_file(folder: &Path) -> Outcome<File> {
    let near = OutputFolder::find_writable_ancestor(folder)?;
    tempfile::tempfile_in(&near).map_err(|error| write_failure(&near, &error))
}

/// A file that is being written. After the first failure nothing more is written to it; the failure is
/// reported at the end.
#[derive(Debug)]
pub(crate) struct PendingFile {
    name: &'static str,
    path: PathBuf,
    to: BufWriter<File>,
    failed: Option<io::Error>,
}

impl PendingFile {
    pub(crate) fn write_text(&mut self, text: &str) {
        if self.failed.is_none() {
            self.failed = self.to.write_all(text.as_bytes()).err();
        }
    }

    /// The complete file, rewound to its start.
    fn into_rewound_file(self) -> Outcome<(&'static str, File)> {
        let Self { name, path, to, failed } = self;
        let rewound = || {
            let mut file = to.into_inner().map_err(io::IntoInnerError::into_error)?;
            file.rewind()?;
            Ok(file)
        };
        let file = failed.map_or_else(rewound, Err).map_err(|error| write_failure(&path, &error))?;
        Ok((name, file))
    }
}

fn write_failure(path: &Path, error: &io::Error) -> Failure {
    Failure::Internal(format!("{}: cannot be written: {error}", path.display()))
}

#[derive(Debug, Args)]
pub(crate) struct FigureArgs {
    /// Draw figures into a folder, each as three files: one for a screen, and under paper/ one for a journal
    /// column and one for a page
    #[arg(long = "figures", value_name = "DIR")]
    pub folder: Option<PathBuf>,
}

impl FigureArgs {
    /// Checks, before the results are computed, that the figures with these names can be written.
    pub(crate) fn check_folder(&self, names: &[&str], overwrite: Overwrite) -> Outcome<()> {
        let Some(folder) = &self.folder else { return Ok(()) };
        let files = names.iter().flat_map(|name| figure_files(name, &Figure::default()));
        let names: Vec<String> = files.map(|(name, _)| name).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        OutputFolder::check(folder, &WritePolicy::new(OutputCommand::Figures, overwrite), &names).map(|_| ())
    }

    /// Writes the figures, if a folder is given.
    pub(crate) fn write_figures(
        &self,
        overwrite: Overwrite,
        quiet: bool,
        figures: impl FnOnce() -> Vec<(&'static str, Figure)>,
    ) -> Outcome<()> {
        let Some(folder) = &self.folder else { return Ok(()) };
        let figures = figures();
        let files: Vec<_> = figures.iter().flat_map(|(name, figure)| figure_files(name, figure)).collect();
        write_outputs(folder, &WritePolicy::new(OutputCommand::Figures, overwrite), &files)?;
        for (name, _) in figures.iter().filter(|_| !quiet) {
            print_line!("figure: {}", folder.join(format!("{name}.svg")).display());
        }
        Ok(())
    }
}

/// A table that is written row by row.
pub(crate) struct StreamedTable {
    pub file: PendingFile,
    row: String,
    /// First rows, kept in memory until the table has its minimum number of rows.
    held: String,
    /// Number of rows that the table still needs to reach its minimum number of rows.
    missing: usize,
    /// Time spent on formatting and writing, which does not count towards the time of the run.
    pub spent: Duration,
}

impl StreamedTable {
    pub(crate) fn new(mut file: PendingFile, header: &str, least_rows: usize) -> Self {
        file.write_text(header);
        file.write_text("\n");
        Self { file, row: String::new(), held: String::new(), missing: least_rows, spent: Duration::ZERO }
    }

    pub(crate) fn add_row(&mut self, push: impl FnOnce(&mut String)) {
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

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: &str = "time_s,name,x_m\n0.5,\"a, b\",-1.5e-3\n1,\"1;2\",\n2,friction.a,1e5\n";

    fn converted(dialect: CsvDialect) -> String {
        let mut found = Vec::new();
        dialect.convert_table(PLAIN.as_bytes(), &mut found).unwrap();
        String::from_utf8(found).unwrap()
    }

    #[test]
    fn numbers_get_decimal_commas_and_texts_stay() {
        let german = "\u{feff}time_s;name;x_m\r\n0,5;a, b;-1,5e-3\r\n1;\"1;2\";\r\n2;friction.a;1e5\r\n";
        assert_eq!(converted(CsvDialect::ExcelDe), german);
    }

    #[test]
    fn points_stay_points() {
        let american = "\u{feff}".to_owned() + &PLAIN.replace('\n', "\r\n").replace("\"1;2\"", "1;2");
        assert_eq!(converted(CsvDialect::ExcelUs), american);
    }
}
