//! TrackMate's XML: simple tracks, `<Tracks><particle><detection t x y z/>` with `t` in frames, and projects
//! with spots, the edges that link them, and the tracks that passed the filters.

use super::TrackMateSpots;
use super::xml::{XmlElement, XmlReader};
use crate::import::error::{ImportError, ImportResult};
use crate::import::reader::{Document, RowStamp};
use std::collections::HashMap;

/// Root elements of simple tracks and of projects.
pub(super) const ROOTS: [&str; 2] = ["Tracks", "TrackMate"];
const SAVE_AGAIN: &str = "save the project again in TrackMate";

/// A position in one frame.
type Spot = (RowStamp, [Option<f64>; 2]);

/// A track of a project, with the identifiers of its spots.
#[derive(Default)]
struct ProjectTrack {
    id: String,
    name: String,
    spots: Vec<String>,
}

/// Reads a file of simple tracks or a project. The elements of these two kinds of files have different names.
pub(super) fn read_xml<'a>(document: &'a Document<'a>) -> ImportResult<TrackMateSpots<'a>> {
    let mut xml = XmlReader::new(document);
    let mut file = TrackMateSpots::new(None, 0);
    let (mut particles, mut interval): (usize, Option<f64>) = (0, None);
    let (mut spots, mut tracks): (HashMap<String, Spot>, Vec<ProjectTrack>) = (HashMap::new(), vec![]);
    let mut kept: Option<Vec<String>> = None;
    while let Some(element) = xml.next_element()? {
        match element.name() {
            "Tracks" => {
                read_units(&xml, &element, ["spaceUnits", "timeUnits"], &mut file)?;
                let text = xml.attribute(&element, "frameInterval")?;
                interval = text.and_then(|text| text.trim().parse().ok()).filter(|interval| *interval > 0.0);
            }
            "particle" => particles += 1,
            "detection" if particles > 0 => {
                let (mut stamp, position) = read_spot(&xml, &element, ["t", "x", "y"])?;
                let time = stamp.frame.zip(interval).map(|(frame, interval)| frame * interval);
                stamp.time = time.filter(|time| time.is_finite());
                file.add_spot((&particles.to_string(), &format!("track{particles}")), stamp, position);
            }
            "Model" => read_units(&xml, &element, ["spatialunits", "timeunits"], &mut file)?,
            "Spot" => {
                let id = xml.required_attribute(&element, "ID")?;
                let (mut stamp, position) = read_spot(&xml, &element, ["FRAME", "POSITION_X", "POSITION_Y"])?;
                if xml.attribute(&element, "POSITION_T")?.is_some() {
                    stamp.time = xml.number_attribute(&element, "POSITION_T")?;
                }
                if let Some((first, _)) = spots.insert(id.clone(), (stamp, position)) {
                    let found = format!("the spot {id} a second time (first in line {})", first.line);
                    let place = xml.element_location(&element);
                    return Err(ImportError::wrong_table(place, found, "every spot once", SAVE_AGAIN));
                }
            }
            "Track" => {
                let id = xml.required_attribute(&element, "TRACK_ID")?;
                let name = xml.attribute(&element, "name")?.filter(|name| !name.trim().is_empty());
                let name = name.unwrap_or_else(|| id.clone());
                tracks.push(ProjectTrack { id, name, spots: vec![] });
            }
            "Edge" => {
                for end in ["SPOT_SOURCE_ID", "SPOT_TARGET_ID"] {
                    let id = xml.required_attribute(&element, end)?;
                    if !spots.contains_key(&id) {
                        let found = format!("an edge to the spot {id}, which the file does not have");
                        let (place, expected) =
                            (xml.element_location(&element), "every spot under <AllSpots>");
                        return Err(ImportError::wrong_table(place, found, expected, SAVE_AGAIN));
                    }
                    tracks.last_mut().into_iter().for_each(|track| track.spots.push(id.clone()));
                }
            }
            "FilteredTracks" => {
                kept.get_or_insert_default();
            }
            "TrackID" => kept.get_or_insert_default().push(xml.required_attribute(&element, "TRACK_ID")?),
            _ => {}
        }
    }
    if particles > 0 {
        file.notes.push(
            "simple tracks have no names: they are called track1, track2, ... in their order".to_owned(),
        );
    }
    let all = tracks.len();
    tracks.retain(|track| kept.as_ref().is_none_or(|kept| kept.contains(&track.id)));
    if tracks.len() < all {
        let left_out = all - tracks.len();
        file.notes
            .push(format!("{left_out} of {all} tracks do not pass the project's filters and are left out"));
    }
    for mut track in tracks {
        // (most spots are at the end of one edge and the start of the next)
        track.spots.sort_unstable();
        track.spots.dedup();
        for (stamp, position) in track.spots.iter().filter_map(|id| spots.get(id)) {
            file.add_spot((&track.id, &track.name), *stamp, *position);
        }
    }
    Ok(file)
}

fn read_units(
    xml: &XmlReader,
    element: &XmlElement,
    [length, time]: [&str; 2],
    file: &mut TrackMateSpots,
) -> ImportResult<()> {
    let unit = xml.attribute(element, length)?;
    file.length_unit = unit.map(|unit| (unit, format!("the attribute {length}")));
    file.time_unit = xml.attribute(element, time)?.unwrap_or_default();
    Ok(())
}

fn read_spot(xml: &XmlReader, element: &XmlElement, [frame, x, y]: [&str; 3]) -> ImportResult<Spot> {
    let stamp = RowStamp { line: element.line, frame: xml.number_attribute(element, frame)?, time: None };
    Ok((stamp, [xml.number_attribute(element, x)?, xml.number_attribute(element, y)?]))
}
