//! The interface of all file formats of tracking programs, and the names that the files in `formats` use.

pub(crate) use crate::import::error::{ImportError, ImportResult, TextLocation};
pub(crate) use crate::import::options::ImportOptions;
pub(crate) use crate::import::reader::*;
pub(crate) use crate::recording::files::YAxis;
pub(crate) use crate::recording::quality::{Check, QualityFinding, Severity};

/// A file format of a tracking program: a [`FormatParser`], or a row of a table.
pub(crate) trait FileFormat: Sync {
    /// Name of the format on the command line.
    fn name(&self) -> &'static str;
    /// Text on the feature of the document that identifies this format; `None` if the document is not in this
    /// format. A table of the same program without positions is recognised too, so that [`FileFormat::read`]
    /// can refuse it with advice.
    fn recognises(&self, document: &Document) -> Option<String>;
    /// Reads the clocks (frame numbers and times of the rows) and the tracks (positions of points), in the
    /// units of the file.
    fn read<'a>(&self, document: &'a Document<'a>, options: &ImportOptions) -> ImportResult<TrackFile<'a>>;
}

/// A format with functions of its own.
pub(crate) struct FormatParser {
    pub name: &'static str,
    pub recognises: fn(&Document) -> Option<String>,
    pub read: for<'a> fn(&'a Document<'a>, &ImportOptions) -> ImportResult<TrackFile<'a>>,
}

impl FileFormat for FormatParser {
    fn name(&self) -> &'static str {
        self.name
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        (self.recognises)(document)
    }

    fn read<'a>(&self, document: &'a Document<'a>, options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
        (self.read)(document, options)
    }
}
