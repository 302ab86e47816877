//! The numbers of one column, with its missing cells.

/// Numbers of a column; a missing one is kept as NaN inside and is `None` outside.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Column(Vec<f64>);

impl Column {
    pub(crate) fn push(&mut self, value: Option<f64>) {
        self.0.push(value.unwrap_or(f64::NAN));
    }

    pub(crate) fn get(&self, row: usize) -> Option<f64> {
        self.0.get(row).copied().filter(|value| !value.is_nan())
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = Option<f64>> {
        self.0.iter().map(|value| Some(*value).filter(|value| !value.is_nan()))
    }

    pub(crate) fn scale(&mut self, factor: f64) {
        self.0.iter_mut().for_each(|value| *value *= factor);
    }

    pub(crate) fn divide(&mut self, divisor: f64) {
        self.0.iter_mut().for_each(|value| *value /= divisor);
    }

    pub(crate) fn has_values(&self) -> bool {
        self.0.iter().any(|value| !value.is_nan())
    }

    /// The rows in the order of `order`.
    pub(crate) fn reorder(&self, order: &[usize]) -> Self {
        Self(order.iter().filter_map(|row| self.0.get(*row).copied()).collect())
    }
}

impl FromIterator<Option<f64>> for Column {
    fn from_iter<I: IntoIterator<Item = Option<f64>>>(values: I) -> Self {
        Self(values.into_iter().map(|value| value.unwrap_or(f64::NAN)).collect())
    }
}
