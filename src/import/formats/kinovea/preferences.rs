//! What Kinovea's files leave to its preferences, and the export that has everything.

use crate::import::reader::{Facts, TimeUnit};

/// The export that has everything.
pub(crate) const EXPORT_MENU: &str = "in Kinovea use File > Export and there the CSV of the trajectories";

/// What Kinovea's preferences decide and none of its tables says.
pub(crate) const PREFERENCES_NOTE: &str = "Kinovea writes times in the unit of its preferences, and positions \
    with y up in the calibrated unit or, if its preferences say so, in image pixels with y down; the file \
    does not say which";

pub(crate) fn kinovea_facts() -> Facts {
    Facts { time: TimeUnit::Unknown, ..Facts::default() }
}
