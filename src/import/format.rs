//! Interface of the file formats of tracking programs.

use crate::import::error::ImportResult;
use crate::import::options::ImportOptions;
use crate::import::reader::Document;
use crate::import::reader::track_file::TrackFile;

/// A file format; each format in `formats` implements it.
pub(crate) trait FileFormat: Sync {
    /// Name of the format on the command line.
    fn name(&self) -> &'static str;
    /// Feature of the contents that identifies the format; `None` if the format is not recognised. Tables of
    /// the same program without positions are also recognised, so that [`FileFormat::read`] can refuse them.
    fn recognises(&self, document: &Document) -> Option<String>;
    /// Reads the clocks and tracks, in the units of the file.
    fn read<'a>(&self, document: &'a Document<'a>, options: &ImportOptions) -> ImportResult<TrackFile<'a>>;
}
