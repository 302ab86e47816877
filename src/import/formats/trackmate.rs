//! TrackMate (Fiji): tables of spots as CSV, simple tracks as XML, and whole projects.

mod project;
mod simple;
mod spots;
mod tracks;
mod xml;

use crate::import::error::ImportError;
use crate::import::format::FileFormat;
use crate::import::options::ImportOptions;
use crate::import::reader::{Document, TrackFile};

/// TrackMate's tables and files.
pub(crate) struct TrackMate;

impl FileFormat for TrackMate {
    fn name(&self) -> &'static str {
        "trackmate"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        match root_element(document) {
            Some(root) => Some(format!("the root element is <{root}>")),
            None => spots::recognise_spots(document.table.as_ref().ok()?),
        }
    }

    fn read<'a>(
        &self,
        document: &'a Document<'a>,
        options: &ImportOptions,
    ) -> Result<TrackFile<'a>, ImportError> {
        let found = match root_element(document) {
            Some(simple::SIMPLE_ROOT) => simple::read_simple_tracks(document)?,
            Some(_) => project::read_project(document)?,
            None => spots::read_spot_table(document)?,
        };
        found.into_track_file(document, options)
    }
}

/// The name of the root element, where it is one of TrackMate's.
fn root_element(document: &Document) -> Option<&'static str> {
    let element = xml::XmlReader::root_name(document)?;
    [simple::SIMPLE_ROOT, project::PROJECT_ROOT].into_iter().find(|known| element == *known)
}
