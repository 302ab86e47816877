//! Any plain table whose columns the user names or numbers.

use super::dialect::{Cell, Number, Row, Table};
use super::error::ImportError;
use super::options::{COLUMN_KEYS, ColumnName, Columns, Options};
use super::{Document, Export, Format, Stamp, Track};
use crate::toml_file::nearest;

/// Seconds in a millisecond.
const MILLI: f64 = 1e-3;
/// Columns that number or time the rows, in the order in which they are trusted.
const CLOCKS: [&str; 3] = ["frame", "time", "time-ms"];

/// A plain table with `--columns`.
pub struct Generic;

impl Format for Generic {
    fn name(&self) -> &'static str {
        "generic"
    }

    /// Never from the content: a plain table means nothing before its columns are named.
    fn recognises(&self, _document: &Document) -> Option<String> {
        None
    }

    fn read(&self, document: &Document, options: &Options) -> Result<Export, ImportError> {
        let table = document.table()?;
        let columns = options.columns.as_ref().ok_or_else(|| unnamed(table))?;
        let (layout, header) = Layout::find(table, columns)?;
        let start = layout.first_data_row(table, header)?;
        let mut export = layout.empty_export(document, header, start, table);
        let width = table.rows.get(start).map_or(0, |row| filled(row).max(layout.widest()));
        for row in table.rows.get(start..).unwrap_or_default() {
            if row.cells.len() < layout.widest() || filled(row) > width.max(header.map_or(0, |h| table.rows[h].cells.len())) {
                return Err(ImportError::Ragged { place: table.place(row.line, 1), found: row.cells.len(), expected: width });
            }
            layout.add(table, row, &mut export)?;
        }
        Ok(export)
    }
}

/// Cells up to the last one with anything in it.
fn filled(row: &Row) -> usize {
    row.cells.iter().rposition(|cell| !cell.text.is_empty()).map_or(0, |last| last + 1)
}

pub(super) fn unnamed(table: &Table) -> ImportError {
    let first: Vec<&str> = table.rows.first().map(|row| row.cells.iter().map(|cell| cell.text).collect()).unwrap_or_default();
    ImportError::Columns {
        file: table.file.to_owned(),
        line: table.rows.first().map_or(1, |row| row.line),
        problem: format!("found a plain table that starts with `{}`, expected --columns to say what its columns are", first.join(" | ")),
        advice: "name or number them (from 1), e.g. --columns time=1,tip-x=2,tip-y=3,head-x=4,head-y=5".to_owned(),
    }
}

/// 0-based positions of the columns that are used, with their keys.
struct Layout {
    columns: Vec<(&'static str, usize)>,
}

impl Layout {
    /// Finds the named columns in the header row, which is the first row that has all of them.
    fn find(table: &Table, columns: &Columns) -> Result<(Self, Option<usize>), ImportError> {
        let names: Vec<&str> =
            columns.0.iter().filter_map(|(_, column)| if let ColumnName::Name(name) = column { Some(name.as_str()) } else { None }).collect();
        let has = |row: &Row, name: &str| row.cells.iter().any(|cell| cell.text == name);
        let header = if names.is_empty() {
            None
        } else {
            Some(table.rows.iter().position(|row| names.iter().all(|name| has(row, name))).ok_or_else(|| no_such_column(table, &names))?)
        };
        let position = |column: &ColumnName| match column {
            ColumnName::Number(number) => Ok(number - 1),
            ColumnName::Name(name) => Self::named(table, header.unwrap_or(0), name),
        };
        let columns = columns.0.iter().map(|(key, column)| Ok((*key, position(column)?))).collect::<Result<Vec<_>, ImportError>>()?;
        let layout = Self { columns };
        layout.check_width(table)?;
        Ok((layout, header))
    }

    fn named(table: &Table, header: usize, name: &str) -> Result<usize, ImportError> {
        let row = &table.rows[header];
        let mut at = row.cells.iter().enumerate().filter(|(_, cell)| cell.text == name).map(|(index, _)| index);
        match (at.next(), at.next()) {
            (Some(first), None) => Ok(first),
            (Some(first), Some(second)) => Err(ImportError::Columns {
                file: table.file.to_owned(),
                line: row.line,
                problem: format!("found the column name `{name}` at {} and {}, expected it once", first + 1, second + 1),
                advice: "give the number of the column instead of its name".to_owned(),
            }),
            _ => Err(no_such_column(table, &[name])),
        }
    }

    fn widest(&self) -> usize {
        self.columns.iter().map(|(_, at)| at + 1).max().unwrap_or(0)
    }

    fn check_width(&self, table: &Table) -> Result<(), ImportError> {
        let cells = table.rows.iter().map(|row| row.cells.len()).max().unwrap_or(0);
        match self.columns.iter().find(|(_, at)| *at >= cells) {
            None => Ok(()),
            Some((key, at)) => Err(ImportError::Columns {
                file: table.file.to_owned(),
                line: table.rows.first().map_or(1, |row| row.line),
                problem: format!(
                    "--columns {key}={}: found a table of {cells} columns (delimiter: {}), expected at least {}",
                    at + 1,
                    table.delimiter.word(),
                    at + 1
                ),
                advice: "correct the column number; columns count from 1".to_owned(),
            }),
        }
    }

    fn at(&self, key: &str) -> Option<usize> {
        self.columns.iter().find(|(known, _)| *known == key).map(|(_, at)| *at)
    }

    fn clock(&self) -> usize {
        CLOCKS.iter().find_map(|key| self.at(key)).unwrap_or(0)
    }

    /// The first row below the header whose clock is a number; a row above it that holds positions is damage, not a header.
    fn first_data_row(&self, table: &Table, header: Option<usize>) -> Result<usize, ImportError> {
        let from = header.map_or(0, |header| header + 1);
        let number = |row: &Row, at: usize| row.cells.get(at).map_or(Number::Missing, |cell| table.number(cell));
        for (index, row) in table.rows.iter().enumerate().skip(from) {
            match number(row, self.clock()) {
                Number::Value(_) => return Ok(index),
                _ if self.columns.iter().any(|(_, at)| *at != self.clock() && matches!(number(row, *at), Number::Value(_))) => {
                    let cell = row.cells.get(self.clock()).copied().unwrap_or(Cell { text: "", column: 1 });
                    return Err(table.not_a_number(row.line, &cell, self.key_of(self.clock())));
                }
                _ => {}
            }
        }
        Err(ImportError::HeaderOnly { file: table.file.to_owned(), line: table.rows.last().map_or(1, |row| row.line) })
    }

    fn key_of(&self, at: usize) -> &'static str {
        self.columns.iter().find(|(_, known)| *known == at).map_or(COLUMN_KEYS[0], |(key, _)| key)
    }

    fn empty_export(&self, document: &Document, header: Option<usize>, start: usize, table: &Table) -> Export {
        let mut notes = vec![];
        if start > 0 {
            notes.push(format!(
                "the data start at line {}; header rows above: {start}{}",
                table.rows[start].line,
                header.map_or("", |_| ", with the named columns")
            ));
        }
        let confidence = |key| self.at(key).map(|_| vec![]);
        let points = [("tip", "tip-x", "tip-confidence"), ("head", "head-x", "head-confidence")];
        let present = points.into_iter().filter(|(_, x, _)| self.at(x).is_some());
        let tracks = present.map(|(name, _, key)| Track { name: name.to_owned(), x: vec![], y: vec![], confidence: confidence(key) });
        let texts = table.rows.iter().take(start).flat_map(|row| &row.cells).map(|cell| cell.text.to_owned());
        Export { file: document.file.to_owned(), stem: document.stem.to_owned(), stamps: vec![], tracks: tracks.collect(), notes, texts: texts.collect() }
    }

    fn add(&self, table: &Table, row: &Row, export: &mut Export) -> Result<(), ImportError> {
        let number = |key: &'static str| match self.at(key).and_then(|at| row.cells.get(at)) {
            Some(cell) => table.value(row.line, cell, key),
            None => Ok(None),
        };
        let time_s = if self.at("time").is_some() { number("time")? } else { number("time-ms")?.map(|ms| ms * MILLI) };
        let column = row.cells.get(self.clock()).map_or(1, |cell| cell.column);
        export.stamps.push(Stamp { line: row.line, column, frame: number("frame")?, time_s });
        for track in &mut export.tracks {
            let keys = if track.name == "tip" { ["tip-x", "tip-y", "tip-confidence"] } else { ["head-x", "head-y", "head-confidence"] };
            track.x.push(number(keys[0])?);
            track.y.push(number(keys[1])?);
            if let Some(confidence) = &mut track.confidence {
                confidence.push(number(keys[2])?);
            }
        }
        Ok(())
    }
}

/// The refusal of names that no row has together: the row that has most of them is taken for the header.
fn no_such_column(table: &Table, names: &[&str]) -> ImportError {
    let hits = |row: &Row| names.iter().filter(|name| row.cells.iter().any(|cell| cell.text == **name)).count();
    let best = table.rows.iter().take(50).enumerate().max_by_key(|(index, row)| (hits(row), usize::MAX - index)).map(|(_, row)| row);
    let header: Vec<&str> = best.map(|row| row.cells.iter().map(|cell| cell.text).filter(|text| !text.is_empty()).collect()).unwrap_or_default();
    let missing: Vec<&str> = names.iter().copied().filter(|name| !header.contains(name)).collect();
    ImportError::Columns {
        file: table.file.to_owned(),
        line: best.map_or(1, |row| row.line),
        problem: format!("found the columns {}, expected also `{}`", header.join(", "), missing.join("`, `")),
        advice: format!(
            "{} or give the number of the column",
            nearest(missing.first().unwrap_or(&""), &header).replace("known keys here", "name one of these")
        ),
    }
}
