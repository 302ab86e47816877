//! What separates the parameters: sensitivities of the features to them, and correlations of their
//! estimates, as tables in colours.

use super::symbol::symbol;
use crate::fit::job::Job;
use crate::fit::result::FitResult;
use crate::report::chart::{
    Axis, COLUMN_WIDTH_MM, Colour, Colours, FULL_WIDTH_MM, Figure, Heat, Panel, Text,
};
use crate::report::{Drawing, FigureBlock, about, subtitle};
use crate::text::{self, or_dash, short};
use std::collections::BTreeMap;

/// What the figure shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sensitivities {
    /// Heading.
    pub title: String,
    /// Whether the data are synthetic.
    pub synthetic: bool,
    /// Symbols of the parameters.
    pub symbols: Vec<String>,
    /// Names of the features.
    pub features: Vec<String>,
    /// Deviations of its target by which one per cent of a parameter moves a feature, a row a feature and a
    /// column a parameter; `None` where there is none.
    pub sensitivities: Vec<Vec<Option<f64>>>,
    /// Correlations of the estimates, a row and a column a parameter; `None` for a parameter that is not
    /// determined.
    pub correlations: Vec<Vec<Option<f64>>>,
}

/// Height of a row, mm.
const ROW_MM: f64 = 5.6;
/// Letters of a name for which there is always room next to the cells.
const LETTERS: usize = 12;
/// Letters of a name in the heading.
const TITLED: usize = 24;
/// Parameters up to which a cell has room for two decimals.
const TWO_DECIMALS: usize = 6;
/// Change of a parameter that is looked at, as a share: one per cent.
const CHANGE: f64 = 0.01;
/// Value of the last colours: a deviation of the target for a per cent, and estimates that cannot be
/// separated.
const FULL: f64 = 1.0;
/// What the two tables are.
const SENSITIVITIES: &str = "Deviations of its target by which one per cent of each parameter moves each feature, as numbers over colours.";
const CORRELATIONS: &str = "Correlation of each pair of estimates, as numbers over colours.";
/// Correlation from which on two estimates move almost as one.
const STRONG: f64 = 0.9;

impl Sensitivities {
    /// Those of a fit at its estimates.
    #[must_use]
    pub fn of(job: &Job, result: &FitResult) -> Self {
        let names: Vec<&String> = job.parameters.iter().map(|p| &p.name).collect();
        let aims = job.aims.iter().filter_map(|aim| {
            let name = &aim.feature.name;
            Some((name, (result.sensitivities.get(name)?, deviations(result, name))))
        });
        let (features, rows): (Vec<&String>, Vec<_>) = aims.unzip();
        let cells = |(row, deviations): (&BTreeMap<String, Option<f64>>, Option<f64>)| {
            let cell = |name: &&String| Some(row.get(*name).copied().flatten()? * deviations? * CHANGE);
            names.iter().map(cell).collect()
        };
        let correlation =
            |a: &String, b: &String| result.correlations.get(a).and_then(|row| row.get(b)).copied();
        Self {
            title: job.title.clone(),
            synthetic: result.synthetic,
            symbols: names.iter().map(|name| symbol(name)).collect(),
            features: features.into_iter().cloned().collect(),
            sensitivities: rows.into_iter().map(cells).collect(),
            correlations: names.iter().map(|a| names.iter().map(|b| correlation(a, b)).collect()).collect(),
        }
    }

    /// The figure with its caption; nothing where there is neither.
    #[must_use]
    pub fn block(&self) -> Option<FigureBlock> {
        let figure = figure(self);
        (!figure.panels.is_empty()).then(|| FigureBlock {
            condition: None,
            file: "sensitivities.svg".to_owned(),
            caption: caption(self),
            details: details(self),
            drawing: Drawing::Chart(figure),
        })
    }
}

/// The model's value of a feature in deviations of its target: what its whole size counts in the fit.
fn deviations(result: &FitResult, name: &str) -> Option<f64> {
    let component =
        || result.components.iter().find(|c| c.name == name).map(|c| (c.model_hz, c.target_sd_hz));
    let feature = || {
        result
            .features
            .iter()
            .chain(&result.held_out)
            .find(|f| f.name == name)
            .map(|f| (f.model, f.target_sd))
    };
    let (model, sd) = component().or_else(feature)?;
    Some(model? / sd).filter(|deviations| deviations.is_finite())
}

/// The figure; one without panels where there is neither.
#[must_use]
pub fn figure(shown: &Sensitivities) -> Figure {
    let sensitivities = (!shown.features.is_empty()).then(|| {
        table(
            ["deviations for one per cent", "parameter"],
            &distinguished(&shown.features),
            shown,
            &shown.sensitivities,
        )
    });
    let correlations =
        correlated(shown).then(|| table(["correlation", ""], &shown.symbols, shown, &shown.correlations));
    let description = match (&sensitivities, &correlations) {
        (None, _) => CORRELATIONS.to_owned(),
        (Some(_), None) => SENSITIVITIES.to_owned(),
        (Some(_), Some(_)) => format!("{SENSITIVITIES} {CORRELATIONS}"),
    };
    Figure {
        title: claim(shown),
        subtitle: about(&shown.title, &subtitle(shown.synthetic, "")),
        synthetic: shown.synthetic,
        description,
        width_mm: if sensitivities.is_some() { FULL_WIDTH_MM } else { COLUMN_WIDTH_MM },
        columns: 2,
        panels: sensitivities.into_iter().chain(correlations).collect(),
    }
}

/// The names; those that begin alike from the word on in which they differ.
fn distinguished(names: &[String]) -> Vec<String> {
    let first = |name: &str| name.chars().take(LETTERS - 1).collect::<String>();
    let short_form = |name: &String| {
        let alike: Vec<&String> =
            names.iter().filter(|other| *other != name && first(other) == first(name)).collect();
        let common = |other: &&String| name.chars().zip(other.chars()).take_while(|(a, b)| a == b).count();
        let Some(common) = alike.iter().map(common).min().filter(|_| name.chars().count() > LETTERS) else {
            return name.clone();
        };
        let start: String = name.chars().take(common).collect();
        let word = start.rfind(' ').map_or(start.len(), |space| space + 1);
        let from = if start.len() - word > LETTERS / 2 { start.len() } else { word };
        format!("\u{2026}{}", name.get(from..).unwrap_or_default())
    };
    names.iter().map(short_form).collect()
}

/// Whether two estimates have a correlation.
fn correlated(shown: &Sensitivities) -> bool {
    strongest(shown).is_some()
}

/// Numbers in coloured cells, the first row on top.
fn table(
    [title, across]: [&str; 2],
    rows: &[String],
    shown: &Sensitivities,
    cells: &[Vec<Option<f64>>],
) -> Panel {
    let (columns, count) = (shown.symbols.len(), rows.len());
    let decimals = if columns <= TWO_DECIMALS { 2 } else { 1 };
    let height = |row: usize| (count - 1 - row) as f64;
    let value = |row: usize, column: usize| cells.get(row).and_then(|cells| cells.get(column)).copied();
    let places = (0..count).flat_map(|row| (0..columns).map(move |column| (row, column)));
    let text = |(row, column): (usize, usize)| {
        let value = value(row, column)?;
        Some(Text {
            text: or_dash(value, |v| number(v, decimals)),
            colour: Colour::Black,
            at: (column as f64, height(row)),
        })
    };
    let heat = Heat {
        label: title.to_owned(),
        x: (0..columns).map(|column| column as f64).collect(),
        y: (0..count).map(|row| row as f64).collect(),
        values: (0..columns)
            .map(|column| (0..count).rev().map(|row| value(row, column).flatten()).collect())
            .collect(),
        range: Some((-FULL, FULL)),
        map: Colours::Diverging,
        without_bar: true, // the numbers are in the cells
        contours: false,
    };
    Panel {
        title: title.to_owned(),
        x: Axis::named(across, shown.symbols.iter().cloned()),
        y: Axis::named("", rows.iter().rev().cloned()),
        height_mm: ROW_MM * count as f64,
        heat: Some(heat),
        texts: places.filter_map(text).collect(),
        ..Panel::default()
    }
}

/// A number of few characters with a true minus sign.
fn number(value: f64, decimals: usize) -> String {
    /// Values from here on have no decimals: there is no room.
    const LARGE: f64 = 10.0;
    text::decimals(value, if value.abs() >= LARGE { 0 } else { decimals })
}

/// The pair of estimates that move most as one: its symbols and its correlation.
fn strongest(shown: &Sensitivities) -> Option<(&str, &str, f64)> {
    let pairs = shown.correlations.iter().enumerate().flat_map(|(row, cells)| {
        cells.iter().take(row).enumerate().map(move |(column, r)| (row, column, *r))
    });
    let (row, column, r) = pairs
        .filter_map(|(row, column, r)| Some((row, column, r?)))
        .max_by(|a, b| a.2.abs().total_cmp(&b.2.abs()))?;
    Some((shown.symbols.get(column)?, shown.symbols.get(row)?, r))
}

/// The claim with its number: the strongest correlation, else the strongest sensitivity.
fn claim(shown: &Sensitivities) -> String {
    if let Some((a, b, r)) = strongest(shown) {
        let strong = if r.abs() >= STRONG { "hardly told apart" } else { "told apart" };
        return format!("{a} and {b} are {strong}: correlation {}", text::decimals(r, 2));
    }
    let rows = shown.sensitivities.iter().zip(&shown.features);
    let cells = rows.flat_map(|(cells, feature)| {
        cells.iter().zip(&shown.symbols).filter_map(move |(value, symbol)| Some(((*value)?, symbol, feature)))
    });
    match cells.max_by(|a, b| a.0.abs().total_cmp(&b.0.abs())) {
        Some((value, symbol, feature)) => format!(
            "1 % of {symbol} moves \u{201c}{}\u{201d} most, by {} deviations",
            text::shortened(feature, TITLED),
            number(value, 2)
        ),
        None => "No feature moves with a parameter".to_owned(),
    }
}

/// For one parameter, the feature that tells most of it: the one that it moves by most deviations.
fn leading(shown: &Sensitivities, column: usize) -> Option<String> {
    let of = shown
        .sensitivities
        .iter()
        .zip(&shown.features)
        .filter_map(|(cells, name)| Some((name, (*cells.get(column)?)?)));
    let (name, value) = of.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    Some(format!("{} on {name} ({})", shown.symbols.get(column)?, number(value, 2)))
}

/// What the figure shows, with its number.
#[must_use]
pub fn caption(shown: &Sensitivities) -> String {
    let (shows, data) = match shown.features.is_empty() {
        true => ("Correlations of the estimates", "frames"),
        false => ("Sensitivities of the features to the parameters at the estimates", "features"),
    };
    let correlations = match strongest(shown) {
        Some((a, b, r)) => {
            let strong =
                if r.abs() >= STRONG { format!(": the {data} hardly separate them") } else { String::new() };
            format!("the strongest correlation of estimates, {}, is between {a} and {b}{strong}", short(r))
        }
        None => "the linear model determines no two estimates, so there are no correlations".to_owned(),
    };
    format!("{shows}; {correlations}.")
}

/// How to read the figure, and which feature each parameter acts on most.
#[must_use]
pub fn details(shown: &Sensitivities) -> String {
    if shown.features.is_empty() {
        return String::new();
    }
    let leading: Vec<String> = (0..shown.symbols.len()).filter_map(|column| leading(shown, column)).collect();
    let long = shown.features.iter().any(|name| name.chars().count() > LETTERS);
    let sentences = [
        Some(
            "Each number is a change of the model's feature, in standard deviations of its target, when the \
             parameter grows by one per cent: what the fit feels. \u{2212}1 is blue, 1 vermilion, a dash for none."
                .to_owned(),
        ),
        (!leading.is_empty()).then(|| format!("By deviations each parameter acts most: {}.", leading.join("; "))),
        long.then(|| "Names that are cut short stand in full in the table of features.".to_owned()),
        strongest(shown).map(|_| "Correlations are those of the linear model.".to_owned()),
    ];
    sentences.into_iter().flatten().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::chart::Medium;

    fn shown() -> Sensitivities {
        let names = |list: &[&str]| list.iter().map(|name| (*name).to_owned()).collect();
        Sensitivities {
            title: "t".to_owned(),
            symbols: names(&["A", "C", "k1"]),
            features: names(&["low", "a feature with a rather long name"]),
            sensitivities: vec![vec![Some(-0.5), Some(0.25), None], vec![Some(0.1), Some(-12.3), Some(0.3)]],
            correlations: vec![
                vec![Some(1.0), Some(-0.95), None],
                vec![Some(-0.95), Some(1.0), None],
                vec![None, None, None],
            ],
            ..Sensitivities::default()
        }
    }

    #[test]
    fn every_cell_has_its_number_and_the_first_row_is_on_top() {
        let panel = &figure(&shown()).panels[0];
        let at = |x: f64, y: f64| panel.texts.iter().find(|t| t.at == (x, y)).unwrap().text.as_str();
        assert_eq!([at(0.0, 1.0), at(2.0, 1.0), at(1.0, 0.0)], ["\u{2212}0.50", "\u{2013}", "\u{2212}12"]);
        assert_eq!(panel.y.names[1].1, "low");
        assert_eq!(panel.heat.as_ref().unwrap().values[1], [Some(-12.3), Some(0.25)]);
    }

    #[test]
    fn correlations_stand_beside_and_are_left_out_where_there_are_none() {
        let both = figure(&shown());
        let texts: Vec<&str> = both.panels[1].texts.iter().map(|t| t.text.as_str()).collect();
        let dash = "\u{2013}";
        assert_eq!(texts, ["1.00", "\u{2212}0.95", dash, "\u{2212}0.95", "1.00", dash, dash, dash, dash]);
        let none = Sensitivities { correlations: vec![vec![None; 3]; 3], ..shown() };
        assert_eq!(figure(&none).panels.len(), 1);
        assert!(caption(&none).contains("no correlations"));
    }

    #[test]
    fn correlations_alone_take_a_column_and_their_own_title() {
        let alone = Sensitivities { features: Vec::new(), sensitivities: Vec::new(), ..shown() };
        let drawn = figure(&alone);
        assert_eq!(
            (drawn.title.as_str(), drawn.panels.len()),
            ("A and C are hardly told apart: correlation \u{2212}0.95", 1)
        );
        assert!(drawn.width_mm < figure(&shown()).width_mm);
        assert!(caption(&alone).starts_with("Correlations of the estimates; "), "{}", caption(&alone));
        assert!(caption(&alone).ends_with("the frames hardly separate them."), "{}", caption(&alone));
    }

    #[test]
    fn features_are_ranked_by_deviations_and_not_by_shares() {
        let job = include_str!("../../../fits/published-experiment/job.toml");
        let result = include_str!("../../../fits/published-experiment/result.json");
        let (job, result) =
            (Job::parse("job.toml", job).unwrap(), FitResult::parse("result.json", result).unwrap());
        let shown = Sensitivities::of(&job, &result);
        let row = |name: &str| shown.features.iter().position(|f| f == name).unwrap();
        let column = job.parameters.iter().position(|p| p.name == "shoulder.stiffness_ratio").unwrap();
        // 0.437 of 900 +- 29 Hz, and 0.073 of 78.4 +- 0.4 Hz, for a share of 0.01
        let cell = |name: &str| shown.sensitivities[row(name)][column].unwrap();
        assert!((cell("high") - 0.1357).abs() < 1e-3 && (cell("low") - 0.1423).abs() < 1e-3);
        assert!(leading(&shown, column).unwrap().contains(" on low ("), "{:?}", leading(&shown, column));
    }

    #[test]
    fn rows_whose_names_begin_alike_are_distinguished() {
        let features: Vec<String> =
            ["deflection at 0.08 m/s", "deflection at 0.16 m/s", "a name of its own that is long"]
                .map(str::to_owned)
                .to_vec();
        let panel =
            figure(&Sensitivities { features, sensitivities: vec![vec![Some(0.1); 3]; 3], ..shown() })
                .panels
                .remove(0);
        let rows: Vec<&str> = panel.y.names.iter().map(|(_, name)| name.as_str()).collect();
        assert_eq!(rows, ["a name of its own that is long", "\u{2026}0.16 m/s", "\u{2026}0.08 m/s"]);
    }

    #[test]
    fn a_rounded_zero_has_no_sign() {
        assert_eq!([number(-0.001, 2), number(-0.01, 2), number(-0.04, 1)], ["0.00", "\u{2212}0.01", "0.0"]);
    }

    #[test]
    fn caption_and_details_name_what_is_largest() {
        let text = [caption(&shown()), details(&shown())].concat();
        for expected in [
            "A on low (\u{2212}0.50)",
            "C on a feature with a rather long name (\u{2212}12)",
            "the strongest correlation of estimates, \u{2212}0.95, is between A and C",
            "hardly separate",
        ] {
            assert!(text.contains(expected), "{text}");
        }
    }

    #[test]
    fn many_features_and_parameters_can_be_drawn_in_one_column() {
        let names = |count: usize| (0..count).map(|i| format!("quantity number {i} <b>")).collect::<Vec<_>>();
        let many = Sensitivities {
            symbols: names(8),
            features: names(20),
            sensitivities: vec![vec![Some(0.123); 8]; 20],
            correlations: vec![vec![Some(0.5); 8]; 8],
            ..shown()
        };
        let svg = figure(&many).svg(Medium::Column);
        assert!(svg.contains(">\n0.1\n<") || svg.contains("0.1"), "{}", &svg[..300]);
        assert!(!svg.contains("<b>"));
    }
}
