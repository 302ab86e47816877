//! Simple tracks: `<Tracks><particle><detection t x y z/>`, where `t` counts frames.

use crate::import::error::ImportError;
use crate::import::formats::trackmate::tracks::{Spot, TrackMateFile, Trajectory};
use crate::import::formats::trackmate::xml::{XmlElement, XmlReader, XmlTag};
use crate::import::reader::Document;

/// The root element.
pub(crate) const SIMPLE_ROOT: &str = "Tracks";
const SIMPLE_TRACK: &str = "particle";
const SIMPLE_SPOT: &str = "detection";

pub(crate) fn read_simple_tracks<'a>(document: &'a Document<'a>) -> Result<TrackMateFile<'a>, ImportError> {
    let mut xml = XmlReader::new(document);
    let mut found = TrackMateFile::default();
    let mut interval = None;
    let mut track: Option<Vec<Spot>> = None;
    while let Some(node) = xml.next_tag()? {
        match node {
            XmlTag::Open(element) if element.has_name(SIMPLE_ROOT) => {
                found.space_unit = xml
                    .attribute(&element, "spaceUnits")?
                    .map(|unit| (unit, "its attribute spaceUnits".to_owned()));
                found.time_unit = xml.attribute(&element, "timeUnits")?;
                interval = xml
                    .attribute(&element, "frameInterval")?
                    .and_then(|text| text.trim().parse::<f64>().ok())
                    .filter(|interval| *interval > 0.0);
            }
            XmlTag::Open(element) if element.has_name(SIMPLE_TRACK) => track = Some(vec![]),
            XmlTag::Open(element) if element.has_name(SIMPLE_SPOT) => {
                if let Some(spots) = &mut track {
                    spots.push(read_simple_spot(&xml, &element, interval)?);
                }
            }
            XmlTag::Close(end) if end.has_name(SIMPLE_TRACK) => {
                let name = format!("track{}", found.trajectories.len() + 1);
                found.trajectories.push(Trajectory { name, spots: track.take().unwrap_or_default() });
            }
            XmlTag::Open(_) | XmlTag::Close(_) => {}
        }
    }
    found.notes.push(format!(
        "simple tracks have no names: they are called track1 to track{} in the order of the file",
        found.trajectories.len()
    ));
    Ok(found)
}

fn read_simple_spot(
    xml: &XmlReader,
    element: &XmlElement,
    interval: Option<f64>,
) -> Result<Spot, ImportError> {
    let frame = xml.number_attribute(element, "t")?;
    let time = frame.zip(interval).map(|(frame, interval)| frame * interval).filter(|time| time.is_finite());
    Ok(Spot {
        line: element.line,
        frame,
        time,
        x: xml.number_attribute(element, "x")?,
        y: xml.number_attribute(element, "y")?,
    })
}
