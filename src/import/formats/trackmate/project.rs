//! Reads a project of TrackMate: spots, the edges that link them, and the tracks that passed the filters.

use super::{EXPORT_ADVICE, Spot, TrackMateFile, Trajectory};
use crate::import::error::{ImportError, ImportResult};
use crate::import::formats::trackmate::xml::{XmlElement, XmlReader, XmlTag};
use crate::import::reader::Document;
use std::collections::{HashMap, HashSet};

pub(super) const PROJECT_ROOT: &str = "TrackMate";
const SAVE_AGAIN: &str = "save the project again in TrackMate";

/// Contents of the XML elements of a project, before the spots are assigned to tracks.
#[derive(Default)]
struct ProjectElements {
    space_unit: Option<String>,
    time_unit: Option<String>,
    spots: HashMap<String, Spot>,
    tracks: Vec<ProjectTrack>,
    /// Identifiers of the tracks that passed the filters; `None` if the project does not list them.
    kept: Option<HashSet<String>>,
    has_quality: bool,
}

struct ProjectTrack {
    id: String,
    name: String,
    /// Identifiers of the spots of the track, in the order in which its edges name them.
    spots: Vec<String>,
    seen: HashSet<String>,
}

pub(crate) fn read_project<'a>(document: &'a Document<'a>) -> ImportResult<TrackMateFile<'a>> {
    let mut xml = XmlReader::new(document);
    let mut parts = ProjectElements::default();
    let mut current: Option<ProjectTrack> = None;
    while let Some(node) = xml.next_tag()? {
        match node {
            XmlTag::Open(element) if element.has_name("Track") => current = Some(read_track(&xml, &element)?),
            XmlTag::Open(element) if element.has_name("Edge") => {
                if let Some(track) = &mut current {
                    track.add_edge(&xml, &element, &parts.spots)?;
                }
            }
            XmlTag::Open(element) => parts.take_element(&xml, &element)?,
            node if node.closes("Track") => parts.tracks.extend(current.take()),
            XmlTag::Close(_) => {}
        }
    }
    parts.into_file(document)
}

fn read_track(xml: &XmlReader, element: &XmlElement) -> ImportResult<ProjectTrack> {
    let id = xml.required_attribute(element, "TRACK_ID")?;
    let name = xml.attribute(element, "name")?.filter(|name| !name.trim().is_empty());
    let name = name.unwrap_or_else(|| id.clone());
    Ok(ProjectTrack { id, name, spots: vec![], seen: HashSet::new() })
}

impl ProjectTrack {
    /// Adds the spots at the two ends of an edge to the track, if it does not have them yet.
    fn add_edge(
        &mut self,
        xml: &XmlReader,
        element: &XmlElement,
        spots: &HashMap<String, Spot>,
    ) -> ImportResult<()> {
        for end in ["SPOT_SOURCE_ID", "SPOT_TARGET_ID"] {
            let id = xml.required_attribute(element, end)?;
            if !spots.contains_key(&id) {
                let name = &self.name;
                let found =
                    format!("an edge of track `{name}` to the spot {id}, which the file does not have");
                let (place, expected) =
                    (xml.element_location(element), "every spot of a track under <AllSpots>");
                return Err(ImportError::wrong_table(place, found, expected, SAVE_AGAIN));
            }
            if self.seen.insert(id.clone()) {
                self.spots.push(id);
            }
        }
        Ok(())
    }
}

impl ProjectElements {
    /// Reads an XML element that is neither a track nor an edge.
    fn take_element(&mut self, xml: &XmlReader, element: &XmlElement) -> ImportResult<()> {
        if element.has_name("Model") {
            self.space_unit = xml.attribute(element, "spatialunits")?;
            self.time_unit = xml.attribute(element, "timeunits")?;
        } else if element.has_name("Spot") {
            self.has_quality = self.has_quality || xml.attribute(element, "QUALITY")?.is_some();
            self.add_spot(xml, element)?;
        } else if element.has_name("FilteredTracks") {
            self.kept.get_or_insert_default();
        } else if element.has_name("TrackID") {
            self.kept.get_or_insert_default().insert(xml.required_attribute(element, "TRACK_ID")?);
        }
        Ok(())
    }

    fn add_spot(&mut self, xml: &XmlReader, element: &XmlElement) -> ImportResult<()> {
        let id = xml.required_attribute(element, "ID")?;
        let timed = xml.attribute(element, "POSITION_T")?.is_some();
        let time = if timed { xml.number_attribute(element, "POSITION_T")? } else { None };
        let spot = Spot {
            line: element.line,
            frame: xml.number_attribute(element, "FRAME")?,
            time,
            x: xml.number_attribute(element, "POSITION_X")?,
            y: xml.number_attribute(element, "POSITION_Y")?,
        };
        let Some(first) = self.spots.insert(id.clone(), spot) else { return Ok(()) };
        let found = format!("the spot {id} a second time (first in line {})", first.line);
        Err(ImportError::wrong_table(xml.element_location(element), found, "every spot once", SAVE_AGAIN))
    }

    fn into_file<'a>(self, document: &Document) -> ImportResult<TrackMateFile<'a>> {
        let all = self.tracks.len();
        let kept = |track: &ProjectTrack| self.kept.as_ref().is_none_or(|kept| kept.contains(&track.id));
        let trajectory = |track: ProjectTrack| Trajectory {
            name: track.name,
            spots: track.spots.iter().filter_map(|id| self.spots.get(id).copied()).collect(),
        };
        let trajectories: Vec<Trajectory> = self.tracks.into_iter().filter(kept).map(trajectory).collect();
        if trajectories.is_empty() {
            let spots = self.spots.len();
            let found = format!(
                "a TrackMate project of {spots} spots with {all} tracks, none of which passes its filters"
            );
            let advice = format!(
                "run the tracking, loosen the filters of the tracks and save again; or {EXPORT_ADVICE}"
            );
            return Err(ImportError::wrong_table(document.file, found, "at least one track", advice));
        }
        let mut notes = vec![];
        let left_out = all - trajectories.len();
        if left_out > 0 {
            notes.push(format!(
                "{left_out} of {all} tracks do not pass the project's filters and are left out"
            ));
        }
        let space_unit =
            self.space_unit.map(|unit| (unit, "the attribute spatialunits of <Model>".to_owned()));
        Ok(TrackMateFile {
            trajectories,
            space_unit,
            time_unit: self.time_unit,
            has_quality: self.has_quality,
            notes,
            ..TrackMateFile::default()
        })
    }
}
