//! Panels so low that a figure fits on a page.

use super::elements::Panel;
use super::figure::Figure;
use super::layout::{FigureLayout, PanelColumns};

/// Height below which axes are not shrunk, mm: two labelled ticks, at the least distance of such ticks, with
/// as much again beyond either.
const MIN_AXES_HEIGHT_MM: f64 = 16.0;
/// The same for each of the names along a y axis, mm: a line of letters and the gap to the next.
const MIN_CATEGORY_HEIGHT_MM: f64 = 3.0;
/// Rounds after which nothing moves any more: in lower panels labels take more lines, and those take room.
const MAX_HEIGHT_ROUNDS: usize = 4;

/// The figure with its panels lowered, all by the same share of what they can spare, until it is no higher
/// than that, mm. Letters keep their size, so that a figure of very many panels or words stays higher.
pub(super) fn limit_height(mut figure: Figure, most_mm: f64) -> Figure {
    for _ in 0..MAX_HEIGHT_ROUNDS {
        let over_mm = FigureLayout::new(&figure).height - most_mm;
        let rows = figure.panels.chunks(PanelColumns::new(&figure).count);
        let spare: f64 = rows.map(|row| row.iter().map(spare_height_mm).fold(0.0, f64::max)).sum();
        if over_mm <= 0.0 || spare <= 0.0 {
            break;
        }
        let share = (over_mm / spare).min(1.0);
        figure.panels.iter_mut().for_each(|panel| panel.height_mm -= share * spare_height_mm(panel));
    }
    figure
}

/// By how much a panel can be lowered, mm.
fn spare_height_mm(panel: &Panel) -> f64 {
    let least_mm = MIN_AXES_HEIGHT_MM.max(panel.y.categories.len() as f64 * MIN_CATEGORY_HEIGHT_MM);
    (panel.height_mm - least_mm).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::{COLUMN_WIDTH_MM, ChartAxis};

    fn figure(heights_mm: &[f64]) -> Figure {
        let panel =
            |height_mm: &f64| Panel { y: ChartAxis::linear("y"), height_mm: *height_mm, ..Panel::default() };
        Figure {
            width_mm: COLUMN_WIDTH_MM,
            panels: heights_mm.iter().map(panel).collect(),
            ..Figure::default()
        }
    }

    fn lowered(figure: &Figure, most_mm: f64) -> Vec<f64> {
        limit_height(figure.clone(), most_mm).panels.iter().map(|p| p.height_mm).collect()
    }

    #[test]
    fn a_figure_that_fits_stays_as_it_is() {
        let fits = figure(&[60.0, 40.0]);
        assert_eq!(limit_height(fits.clone(), FigureLayout::new(&fits).height), fits);
    }

    #[test]
    fn panels_give_what_they_can_spare_and_no_more() {
        let high = figure(&[56.0, 56.0, 36.0, 13.0]);
        // 40 + 40 + 20 + 0 mm to spare, of which a half goes
        let most_mm = FigureLayout::new(&high).height - 50.0;
        assert_eq!(lowered(&high, most_mm), [36.0, 36.0, 26.0, 13.0]);
        assert_eq!(FigureLayout::new(&limit_height(high.clone(), most_mm)).height, most_mm);
        assert_eq!(lowered(&high, 10.0), [MIN_AXES_HEIGHT_MM, MIN_AXES_HEIGHT_MM, MIN_AXES_HEIGHT_MM, 13.0]);
    }

    #[test]
    fn rows_of_names_keep_room_for_their_letters() {
        let mut high = figure(&[90.0]);
        high.panels[0].y = ChartAxis::categorical("", (0..12).map(|i| i.to_string()));
        assert_eq!(lowered(&high, 10.0), [12.0 * MIN_CATEGORY_HEIGHT_MM]);
    }
}
