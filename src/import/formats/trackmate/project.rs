//! A whole project: spots, the edges that link them, and the tracks that passed the filters.

use crate::import::error::ImportError;
use crate::import::formats::trackmate::tracks::{Found, REMEDY, Spot, Trajectory};
use crate::import::formats::trackmate::xml::{Element, Node, Xml};
use crate::import::reader::Document;
use std::collections::{HashMap, HashSet};

/// The root element.
pub(crate) const ROOT: &str = "TrackMate";

/// What the elements say, before spots and edges are put together.
#[derive(Default)]
struct Parts {
    space_unit: Option<String>,
    time_unit: Option<String>,
    spots: HashMap<String, Spot>,
    tracks: Vec<Track>,
    /// Tracks that passed the filters, where the project lists them.
    kept: Option<HashSet<String>>,
    has_quality: bool,
}

struct Track {
    id: String,
    name: String,
    /// Spots in the order of their first edge.
    spots: Vec<String>,
    seen: HashSet<String>,
}

pub(crate) fn read<'a>(document: &'a Document<'a>) -> Result<Found<'a>, ImportError> {
    let mut xml = Xml::new(document);
    let mut parts = Parts::default();
    let mut current: Option<Track> = None;
    while let Some(node) = xml.next()? {
        match node {
            Node::Open(element) if element.is("Track") => current = Some(track(&xml, &element)?),
            Node::Open(element) if element.is("Edge") => {
                if let Some(track) = &mut current {
                    track.link(&xml, &element, &parts.spots)?;
                }
            }
            Node::Open(element) => parts.take(&xml, &element)?,
            Node::Close(end) if end.is("Track") => parts.tracks.extend(current.take()),
            Node::Close(_) => {}
        }
    }
    parts.found(document)
}

fn track(xml: &Xml, element: &Element) -> Result<Track, ImportError> {
    let id = xml.needed(element, "TRACK_ID")?;
    let name =
        xml.text(element, "name")?.filter(|name| !name.trim().is_empty()).unwrap_or_else(|| id.clone());
    Ok(Track { id, name, spots: vec![], seen: HashSet::new() })
}

impl Track {
    /// Adds the two ends of an edge.
    fn link(
        &mut self,
        xml: &Xml,
        element: &Element,
        spots: &HashMap<String, Spot>,
    ) -> Result<(), ImportError> {
        for end in ["SPOT_SOURCE_ID", "SPOT_TARGET_ID"] {
            let id = xml.needed(element, end)?;
            if !spots.contains_key(&id) {
                return Err(ImportError::wrong_table(
                    xml.place_of(element),
                    format!(
                        "an edge of track `{}` to the spot {id}, which the file does not have",
                        self.name
                    ),
                    "every spot of a track under <AllSpots>",
                    "save the project again in TrackMate",
                ));
            }
            if self.seen.insert(id.clone()) {
                self.spots.push(id);
            }
        }
        Ok(())
    }
}

impl Parts {
    /// Takes in an element that is no track.
    fn take(&mut self, xml: &Xml, element: &Element) -> Result<(), ImportError> {
        if element.is("Model") {
            self.space_unit = xml.text(element, "spatialunits")?;
            self.time_unit = xml.text(element, "timeunits")?;
        } else if element.is("Spot") {
            self.has_quality = self.has_quality || xml.text(element, "QUALITY")?.is_some();
            self.spot(xml, element)?;
        } else if element.is("FilteredTracks") {
            self.kept.get_or_insert_default();
        } else if element.is("TrackID") {
            self.kept.get_or_insert_default().insert(xml.needed(element, "TRACK_ID")?);
        }
        Ok(())
    }

    fn spot(&mut self, xml: &Xml, element: &Element) -> Result<(), ImportError> {
        let id = xml.needed(element, "ID")?;
        let time = if xml.text(element, "POSITION_T")?.is_some() {
            xml.number(element, "POSITION_T")?
        } else {
            None
        };
        let spot = Spot {
            line: element.line,
            frame: xml.number(element, "FRAME")?,
            time,
            x: xml.number(element, "POSITION_X")?,
            y: xml.number(element, "POSITION_Y")?,
        };
        match self.spots.insert(id.clone(), spot) {
            None => Ok(()),
            Some(first) => Err(ImportError::wrong_table(
                xml.place_of(element),
                format!("the spot {id} a second time (first in line {})", first.line),
                "every spot once",
                "save the project again in TrackMate",
            )),
        }
    }

    fn found<'a>(self, document: &Document) -> Result<Found<'a>, ImportError> {
        let all = self.tracks.len();
        let kept = |track: &Track| self.kept.as_ref().is_none_or(|kept| kept.contains(&track.id));
        let trajectory = |track: Track| Trajectory {
            name: track.name,
            spots: track.spots.iter().filter_map(|id| self.spots.get(id).copied()).collect(),
        };
        let trajectories: Vec<Trajectory> = self.tracks.into_iter().filter(kept).map(trajectory).collect();
        if trajectories.is_empty() {
            return Err(ImportError::wrong_table(
                document.file,
                format!(
                    "a TrackMate project of {} spots with {all} tracks, none of which passes its filters",
                    self.spots.len()
                ),
                "at least one track",
                format!("run the tracking, loosen the filters of the tracks and save again; or {REMEDY}"),
            ));
        }
        let mut notes = vec![];
        if trajectories.len() < all {
            notes.push(format!(
                "{} of {all} tracks do not pass the project's filters and are left out",
                all - trajectories.len()
            ));
        }
        let space_unit =
            self.space_unit.map(|unit| (unit, "the attribute spatialunits of <Model>".to_owned()));
        Ok(Found {
            trajectories,
            space_unit,
            time_unit: self.time_unit,
            has_quality: self.has_quality,
            notes,
            ..Found::default()
        })
    }
}
