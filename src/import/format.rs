//! What a file format has to say: one implementation a file in `formats/`.

use crate::import::error::ImportError;
use crate::import::options::ImportOptions;
use crate::import::reader::document::Document;
use crate::import::reader::track_file::TrackFile;

/// One file format.
pub(crate) trait FileFormat: Sync {
    /// Its name on the command line.
    fn name(&self) -> &'static str;
    /// What in the content shows it, if anything does; also for tables of the same program that hold no
    /// positions, which [`FileFormat::read`] then refuses.
    fn recognises(&self, document: &Document) -> Option<String>;
    /// Its rows and tracks, in the file's own units.
    fn read<'a>(
        &self,
        document: &'a Document<'a>,
        options: &ImportOptions,
    ) -> Result<TrackFile<'a>, ImportError>;
}
