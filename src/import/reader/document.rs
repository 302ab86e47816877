//! A decoded file, with its table and the texts of its companions.

use crate::import::error::ImportError;
use crate::import::reader::encoding::DecodedText;
use crate::import::reader::table::DelimitedTable;
use crate::import::reader::{encoding, file_type};
use crate::import::source::{ImportSource, base_name};

/// A decoded file as the formats see it.
pub(crate) struct Document<'a> {
    /// File as named by the user.
    pub file: &'a str,
    /// Its name without folders and extension.
    pub stem: &'a str,
    /// Its text, without a byte-order mark.
    pub text: &'a str,
    /// The text as a table, or why it is not one.
    pub table: Result<DelimitedTable<'a>, ImportError>,
    /// The texts of the companions, with their names.
    pub companions: Vec<(&'a str, String)>,
}

impl<'a> Document<'a> {
    pub(crate) fn new(source: &'a ImportSource, decoded: &'a DecodedText) -> Self {
        let base = base_name(&source.name);
        let stem = base.rsplit_once('.').map_or(base, |(stem, _)| stem);
        let companions = source.companions.iter().filter_map(|file| {
            Some((
                file.name.as_str(),
                encoding::decode_text(&file.name, &file.bytes, None).ok()?.text.into_owned(),
            ))
        });
        let table = file_type::refuse_text(&source.name, &decoded.text)
            .map_or_else(|| DelimitedTable::parse(&source.name, &decoded.text), Err);
        Self { file: &source.name, stem, text: &decoded.text, table, companions: companions.collect() }
    }

    pub(crate) fn table(&self) -> Result<&DelimitedTable<'_>, ImportError> {
        self.table.as_ref().map_err(Clone::clone)
    }

    /// Its encoding, delimiter and decimal mark, for the report.
    pub(crate) fn encoding_note(&self, decoded: &DecodedText) -> String {
        let dialect = self.table.as_ref().map_or_else(|_| String::new(), |table| table.dialect.describe());
        format!("{}: {}{dialect}", self.file, decoded.encoding)
    }
}
