//! Panels so low that a figure fits on a page.

use super::elements::Panel;
use super::figure::Figure;
use super::layout::{Columns, Layout};

/// Height below which axes are not shrunk, mm: two labelled ticks, at the least distance of such ticks, with
/// as much again beyond either.
const LEAST_MM: f64 = 16.0;
/// The same for each of the names along a y axis, mm: a line of letters and the gap to the next.
const LEAST_ROW_MM: f64 = 3.0;
/// Rounds after which nothing moves any more: in lower panels labels take more lines, and those take room.
const ROUNDS: usize = 4;

/// The figure with its panels lowered, all by the same share of what they can spare, until it is no higher
/// than that, mm. Letters keep their size, so that a figure of very many panels or words stays higher.
pub(super) fn no_higher_than(mut figure: Figure, most_mm: f64) -> Figure {
    for _ in 0..ROUNDS {
        let over_mm = Layout::of(&figure).height - most_mm;
        let rows = figure.panels.chunks(Columns::of(&figure).count);
        let spare: f64 = rows.map(|row| row.iter().map(spare_mm).fold(0.0, f64::max)).sum();
        if over_mm <= 0.0 || spare <= 0.0 {
            break;
        }
        let share = (over_mm / spare).min(1.0);
        figure.panels.iter_mut().for_each(|panel| panel.height_mm -= share * spare_mm(panel));
    }
    figure
}

/// By how much a panel can be lowered, mm.
fn spare_mm(panel: &Panel) -> f64 {
    let least_mm = LEAST_MM.max(panel.y.names.len() as f64 * LEAST_ROW_MM);
    (panel.height_mm - least_mm).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::{Axis, COLUMN_WIDTH_MM};

    fn figure(heights_mm: &[f64]) -> Figure {
        let panel =
            |height_mm: &f64| Panel { y: Axis::linear("y"), height_mm: *height_mm, ..Panel::default() };
        Figure {
            width_mm: COLUMN_WIDTH_MM,
            panels: heights_mm.iter().map(panel).collect(),
            ..Figure::default()
        }
    }

    fn lowered(figure: &Figure, most_mm: f64) -> Vec<f64> {
        no_higher_than(figure.clone(), most_mm).panels.iter().map(|p| p.height_mm).collect()
    }

    #[test]
    fn a_figure_that_fits_stays_as_it_is() {
        let fits = figure(&[60.0, 40.0]);
        assert_eq!(no_higher_than(fits.clone(), Layout::of(&fits).height), fits);
    }

    #[test]
    fn panels_give_what_they_can_spare_and_no_more() {
        let high = figure(&[56.0, 56.0, 36.0, 13.0]);
        // 40 + 40 + 20 + 0 mm to spare, of which a half goes
        let most_mm = Layout::of(&high).height - 50.0;
        assert_eq!(lowered(&high, most_mm), [36.0, 36.0, 26.0, 13.0]);
        assert_eq!(Layout::of(&no_higher_than(high.clone(), most_mm)).height, most_mm);
        assert_eq!(lowered(&high, 10.0), [LEAST_MM, LEAST_MM, LEAST_MM, 13.0]);
    }

    #[test]
    fn rows_of_names_keep_room_for_their_letters() {
        let mut high = figure(&[90.0]);
        high.panels[0].y = Axis::named("", (0..12).map(|i| i.to_string()));
        assert_eq!(lowered(&high, 10.0), [12.0 * LEAST_ROW_MM]);
    }
}
