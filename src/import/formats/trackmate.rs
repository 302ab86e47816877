//! TrackMate (Fiji): tables of spots as CSV, simple tracks as XML, and whole projects.

mod project;
mod simple;
mod spots;
mod tracks;
mod xml;

use crate::import::error::ImportError;
use crate::import::format::Format;
use crate::import::options::Options;
use crate::import::reader::{Document, TrackFile};

/// TrackMate's tables and files.
pub(crate) struct TrackMate;

impl Format for TrackMate {
    fn name(&self) -> &'static str {
        "trackmate"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        match root(document) {
            Some(root) => Some(format!("the root element is <{root}>")),
            None => spots::recognises(document.table.as_ref().ok()?),
        }
    }

    fn read<'a>(&self, document: &'a Document<'a>, options: &Options) -> Result<TrackFile<'a>, ImportError> {
        let found = match root(document) {
            Some(simple::ROOT) => simple::read(document)?,
            Some(_) => project::read(document)?,
            None => spots::read(document)?,
        };
        found.export(document, options)
    }
}

/// The name of the root element, where it is one of TrackMate's.
fn root(document: &Document) -> Option<&'static str> {
    let element = xml::Xml::root(document)?;
    [simple::ROOT, project::ROOT].into_iter().find(|known| element == *known)
}
