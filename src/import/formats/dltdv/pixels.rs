//! What all tables of DLTdv and Argus share: pixels, cameras, and who counts y from where.

use crate::import::reader::{CoordinateUnit, Fact, Facts};
use crate::recording::files::YAxis;

/// What decides the direction of y where the table does not.
pub(crate) const Y_AXIS_QUESTION: &str = "DLTdv 8 counts pixels from the top of the picture (down), DLTdv 5 to 7 and \
    Argus from its bottom (up), and this table does not tell which of them wrote it";
pub(crate) const FIRST_PIXEL: &str =
    "the first pixel of a picture is number 1 as in MATLAB; the coordinates are kept as they are";
pub(crate) const SEVERAL_CAMERAS: &str = "several cameras: tip and head have to come from one of them; rows \
    are frames of the first camera, from which the others may be offset";

/// Pixels, with y as it is said or, where nothing says it, as the user has to.
pub(crate) fn pixel_facts(y_axis: Fact<YAxis>) -> Facts {
    let y_axis_open = y_axis.is_none().then_some(Y_AXIS_QUESTION);
    Facts {
        y_axis,
        y_axis_open,
        unit: Some((CoordinateUnit::Pixel, "DLTdv and Argus write pixels".to_owned())),
        ..Facts::default()
    }
}

/// A point's name; with its camera where there are several.
pub(crate) fn camera_track_name(point: &str, camera: &str, several: bool) -> String {
    if several { format!("{point}_cam{camera}") } else { point.to_owned() }
}
