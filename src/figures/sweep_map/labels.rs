//! Names, units and scales of the axes and maps of a study in figures.

use crate::blade::parameters::ModelParameter;
use crate::chart::AxisScale;
use crate::feature::FeatureUnit;
use crate::sweep::{AxisSpacing, SweepAxis, SweepMap};

pub(in crate::figures) fn axis_scale(axis: &SweepAxis) -> AxisScale {
    match axis.spacing {
        AxisSpacing::Linear => AxisScale::Linear,
        AxisSpacing::Log => AxisScale::Log,
    }
}

/// The colours or the y axis that a study asks for, in the unit of figures.
pub(in crate::figures) fn map_range(map: &SweepMap) -> Option<(f64, f64)> {
    let factor = map.reading.unit().factor;
    map.range.map(|(low, high)| (low * factor, high * factor))
}

/// Name and unit of a map.
pub(in crate::figures) fn map_label(map: &SweepMap) -> String {
    let FeatureUnit { shown, .. } = map.reading.unit();
    if shown.is_empty() { map.name.clone() } else { format!("{}, {shown}", map.name) }
}

/// Unit of a parameter in figures, and what its SI value is multiplied by.
pub(in crate::figures) fn display_unit(parameter: &ModelParameter) -> (&'static str, f64) {
    match parameter.unit {
        "m" => ("mm", 1e3),
        "kg" => ("g", 1e3),
        "N m/rad" => ("mN m/rad", 1e3),
        unit => (unit, 1.0),
    }
}

/// The name of a parameter in words: `drive.amplitude_m` is the "drive amplitude".
pub(in crate::figures) fn parameter_words(axis: &SweepAxis) -> String {
    let ModelParameter { name, symbol, unit, .. } = axis.parameter;
    let (table, key) = name.split_once('.').unwrap_or(("", name));
    let suffix = format!("_{}", unit.to_lowercase().replace('/', " per ").replace(' ', "_"));
    let key = key.strip_suffix(&suffix).unwrap_or(key).replace('_', " ");
    // (a key that is the symbol itself stands as the symbol)
    let key = if key.eq_ignore_ascii_case(symbol) { (*symbol).to_owned() } else { key };
    if table == "blade" { key } else { format!("{table} {key}") }
}

/// What an axis shows: `drive.amplitude_m` is the "drive amplitude a, mm".
pub(in crate::figures) fn axis_label(axis: &SweepAxis) -> String {
    let (words, symbol) = (parameter_words(axis), axis.parameter.symbol);
    let named = if words.ends_with(&format!(" {symbol}")) { words } else { format!("{words} {symbol}") };
    match display_unit(axis.parameter).0 {
        "1" => named,
        unit => format!("{named}, {unit}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blade::parameters::{PARAMETERS, find_parameter};

    fn axis(name: &str) -> SweepAxis {
        SweepAxis {
            parameter: find_parameter(name).unwrap(),
            values: vec![1.0, 2.0],
            spacing: AxisSpacing::Linear,
        }
    }

    #[test]
    fn axes_are_named_in_words_with_symbol_and_unit() {
        let label = |name: &str| axis_label(&axis(name));
        assert_eq!(label("friction.a"), "friction A");
        assert_eq!(label("friction.b_s_per_m"), "friction B, s/m");
        assert_eq!(label("drive.amplitude_m"), "drive amplitude a, mm");
        assert_eq!(label("blade.neck_stiffness_n_m_per_rad"), "neck stiffness k1, mN m/rad");
        assert_eq!(label("blade.preload_force_n"), "preload force k0 hd, N");
        assert_eq!(parameter_words(&axis("blade.preload_force_n")), "preload force");
        let longest = PARAMETERS.iter().map(|p| label(p.name).chars().count()).max().unwrap();
        assert!(longest <= 45, "{longest} letters do not fit next to an axis of a narrow figure");
    }
}
