//! Lengths that every figure has in common: mm, and units of the canvas.

/// Canvas units for a millimetre: four for a pixel of 1/96 inch.
pub(super) const UNITS_PER_MM: f64 = 15.0;
/// Width of a figure over two columns of a journal, mm.
pub(crate) const FULL_WIDTH_MM: f64 = 170.0;
/// Width of a figure in one column, mm.
pub(crate) const COLUMN_WIDTH_MM: f64 = 85.0;
/// Most height of a figure in print, mm: Springer's journals, among the strictest, take figures up to 234 mm
/// high, about the text of an A4 page.
pub const MAX_HEIGHT_MM: f64 = 230.0;
/// Size of labels, mm (7.5 pt, readable at print size).
pub(super) const TEXT_MM: f64 = 2.6;
pub(super) const TITLE_MM: f64 = 3.2;
pub(super) const SMALL_MM: f64 = 2.3;
pub(super) const LINE_MM: f64 = 4.0;
pub(super) const EDGE_MM: f64 = 2.0;
pub(super) const TICK_MM: f64 = 1.0;
/// Least distance of labelled ticks, mm.
pub(super) const X_TICKS_MM: f64 = 18.0;
pub(super) const Y_TICKS_MM: f64 = 5.5;
/// The same on a logarithmic axis, where every one is asked for that has room.
pub(super) const X_LOG_TICKS_MM: f64 = 7.0;
pub(super) const Y_LOG_TICKS_MM: f64 = 3.6;
/// Opacity of shaded surfaces: pale enough for lines and grid to stay readable.
pub(super) const SHADING_OPACITY: f64 = 0.22;
