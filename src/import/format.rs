//! What a format of a tracking program must be able to do.

use crate::import::error::ImportResult;
use crate::import::options::ImportOptions;
use crate::import::reader::Document;
use crate::import::reader::track_file::TrackFile;

/// A file format; every file in `formats/` has one.
pub(crate) trait FileFormat: Sync {
    /// Name on the command line.
    fn name(&self) -> &'static str;
    /// What in the content shows the format, if anything does. Tables of the same program without positions
    /// are recognised too, and refused by [`FileFormat::read`].
    fn recognises(&self, document: &Document) -> Option<String>;
    /// Reads the clocks and tracks, in the file's own units.
    fn read<'a>(&self, document: &'a Document<'a>, options: &ImportOptions) -> ImportResult<TrackFile<'a>>;
}
