//! A part of the unit box that is searched as if it were the whole.

/// Part of the unit box in which one coordinate is held within a range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slab {
    /// Number of the parameter.
    pub axis: usize,
    /// Least coordinate.
    pub lower: f64,
    /// Largest coordinate.
    pub upper: f64,
}

impl Slab {
    /// Whether a point lies in it.
    #[must_use]
    pub fn contains(&self, unit: &[f64]) -> bool {
        unit.get(self.axis).is_some_and(|u| (self.lower..=self.upper).contains(u))
    }

    /// The same without what lies within `margin` of its ends that are not ends of the box.
    #[must_use]
    pub fn shrink_by(self, margin: f64) -> Self {
        let lower = if self.lower > 0.0 { self.lower + margin } else { self.lower };
        let upper = if self.upper < 1.0 { self.upper - margin } else { self.upper };
        Self { lower, upper, ..self }
    }

    /// A point of the unit box as one of the slab.
    pub(super) fn map_into(&self, mut unit: Vec<f64>) -> Vec<f64> {
        if let Some(u) = unit.get_mut(self.axis) {
            *u = self.lower + (self.upper - self.lower) * *u;
        }
        unit
    }
}
