//! From text to tracks on a frame grid, the same for every format: encoding, dialect, table, layout, timing.

pub(crate) mod calibration;
pub(crate) mod column;
pub(crate) mod companion;
pub(crate) mod cut_numbers;
pub(crate) mod delimiter;
pub(crate) mod dialect;
pub(crate) mod document;
pub(crate) mod encoding;
pub(crate) mod file_type;
pub(crate) mod findings;
pub(crate) mod grid;
pub(crate) mod instances;
pub(crate) mod layout;
pub(crate) mod number;
pub(crate) mod photron;
pub(crate) mod picked;
pub(crate) mod rounding;
pub(crate) mod rows;
pub(crate) mod several_clocks;
pub(crate) mod spreadsheet;
pub(crate) mod table;
pub(crate) mod timing;
pub(crate) mod track_choice;
pub(crate) mod track_file;
pub(crate) mod units;

pub(crate) use column::Column;
pub(crate) use document::Document;
pub(crate) use findings::new_finding;
pub(crate) use instances::{InstanceFields, PointFields, RowOrder, RowPosition, RowStamp, TrackCollector};
pub(crate) use layout::{LostRule, PointCells, TableLayout};
pub(crate) use number::{CellNumber, parse_number};
pub(crate) use rows::{RowView, TextRow};
pub(crate) use table::DelimitedTable;
pub(crate) use track_file::{Clock, Fact, Facts, Track, TrackFile};
pub(crate) use units::{CoordinateUnit, TimeUnit};
