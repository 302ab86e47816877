//! Simple tracks: `<Tracks><particle><detection t x y z/>`, where `t` counts frames.

use crate::import::error::ImportError;
use crate::import::formats::trackmate::tracks::{Found, Spot, Trajectory};
use crate::import::formats::trackmate::xml::{Element, Node, Xml};
use crate::import::reader::Document;

/// The root element.
pub(crate) const ROOT: &str = "Tracks";
const TRACK: &str = "particle";
const SPOT: &str = "detection";

pub(crate) fn read<'a>(document: &'a Document<'a>) -> Result<Found<'a>, ImportError> {
    let mut xml = Xml::new(document);
    let mut found = Found::default();
    let mut interval = None;
    let mut track: Option<Vec<Spot>> = None;
    while let Some(node) = xml.next()? {
        match node {
            Node::Open(element) if element.is(ROOT) => {
                found.space_unit = xml
                    .text(&element, "spaceUnits")?
                    .map(|unit| (unit, "its attribute spaceUnits".to_owned()));
                found.time_unit = xml.text(&element, "timeUnits")?;
                interval = xml
                    .text(&element, "frameInterval")?
                    .and_then(|text| text.trim().parse::<f64>().ok())
                    .filter(|interval| *interval > 0.0);
            }
            Node::Open(element) if element.is(TRACK) => track = Some(vec![]),
            Node::Open(element) if element.is(SPOT) => {
                if let Some(spots) = &mut track {
                    spots.push(spot(&xml, &element, interval)?);
                }
            }
            Node::Close(end) if end.is(TRACK) => {
                let name = format!("track{}", found.trajectories.len() + 1);
                found.trajectories.push(Trajectory { name, spots: track.take().unwrap_or_default() });
            }
            Node::Open(_) | Node::Close(_) => {}
        }
    }
    found.notes.push(format!(
        "simple tracks have no names: they are called track1 to track{} in the order of the file",
        found.trajectories.len()
    ));
    Ok(found)
}

fn spot(xml: &Xml, element: &Element, interval: Option<f64>) -> Result<Spot, ImportError> {
    let frame = xml.number(element, "t")?;
    let time = frame.zip(interval).map(|(frame, interval)| frame * interval).filter(|time| time.is_finite());
    Ok(Spot { line: element.line, frame, time, x: xml.number(element, "x")?, y: xml.number(element, "y")? })
}
