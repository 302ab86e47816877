//! Every number in a table of a page, and in its answer, is one of `report.json`, rounded as it stands there;
//! and those of `report.json` are those of `result.json`.

use crate::project::Project;
use serde_json::Value;

const FITS: [&str; 3] = ["actual-blade-twin", "published-experiment", "published-simulation"];
/// Units that the page uses for a number in SI units, and percent.
const FACTORS: [f64; 5] = [1.0, 1e2, 1e3, 1e6, 1e9];

fn read(project: &Project, path: &str) -> String {
    std::fs::read_to_string(project.path(path)).unwrap()
}

/// Every number of a JSON, in order of size.
fn numbers(json: &Value) -> Vec<f64> {
    fn collect(json: &Value, into: &mut Vec<f64>) {
        match json {
            Value::Number(n) => into.extend(n.as_f64()),
            Value::Array(list) => list.iter().for_each(|v| collect(v, into)),
            Value::Object(map) => {
                into.extend([map.len() as f64]);
                map.values().for_each(|v| collect(v, into));
            }
            // (a number in a sentence of the JSON)
            Value::String(text) => into.extend(tokens(text).into_iter().map(|(value, _)| value)),
            _ => {}
        }
    }
    let mut found = Vec::new();
    collect(json, &mut found);
    found.sort_by(f64::total_cmp);
    found
}

/// Numbers of a text, with the unit of their last digit.
fn tokens(text: &str) -> Vec<(f64, f64)> {
    let text = text.replace('\u{2212}', "-");
    let is_part = |c: char| c.is_ascii_digit() || c == '.';
    let mut found = Vec::new();
    let mut rest = text.as_str();
    while let Some(at) = rest.find(|c: char| c.is_ascii_digit()) {
        let before = rest[..at].chars().next_back();
        let end = rest[at..].find(|c| !is_part(c)).map_or(rest.len(), |length| at + length);
        let word = rest[at..end].trim_end_matches('.');
        let is_name = before.is_some_and(|c| c.is_alphanumeric() || matches!(c, '_' | '(' | '^'));
        let sign = if before == Some('-') { -1.0 } else { 1.0 };
        let of_ten = rest[end..].starts_with('\u{b7}') || before == Some('\u{b7}');
        if let (Ok(value), false, false) = (word.parse::<f64>(), is_name, of_ten) {
            let decimals = word.split_once('.').map_or(0, |(_, fraction)| fraction.len()) as i32;
            // the standard deviation of 690(10) ends in a zero, so the last digit of 690 is rounded too
            let deviation = rest[end..].strip_prefix('(').and_then(|sd| sd.split_once(')')).map(|(sd, _)| sd);
            let rounded = deviation.filter(|sd| sd.ends_with('0')).map_or(0, |sd| sd.len() as i32 - 1);
            found.push((sign * value, 10.0_f64.powi(rounded - decimals)));
        }
        rest = &rest[end..];
    }
    found
}

/// Whether a number, in any unit of the page and of either sign, is rounded to this one.
fn is_known(known: &[f64], (value, digit): (f64, f64)) -> bool {
    FACTORS.iter().any(|factor| {
        [value, -value].iter().any(|value| {
            let (low, high) = ((value - 0.5001 * digit) / factor, (value + 0.5001 * digit) / factor);
            known.get(known.partition_point(|k| *k < low)).is_some_and(|k| *k <= high)
        })
    })
}

/// Text of an HTML without its marks.
fn text_of(html: &str) -> String {
    let mut text = String::new();
    for part in html.split('<') {
        text.push_str(part.split_once('>').map_or(part, |(_, after)| after));
    }
    text
}

/// Cells of the tables, and the answer.
fn shown(page: &str) -> Vec<String> {
    let cells = page.split("<td role=\"cell\"").skip(1).map(|rest| {
        let cell = rest.split("</td>").next().unwrap();
        // (without the head of its column, and without hashes)
        let cell = cell.split_once("</i>").map_or("", |(_, cell)| cell);
        if cell.contains("class=\"hash\"") { String::new() } else { text_of(cell) }
    });
    let headline = page.split("class=\"headline").nth(1).unwrap();
    let headline = headline.split_once('>').unwrap().1;
    cells.chain([text_of(headline.split("</div>").next().unwrap())]).collect()
}

#[test]
fn the_numbers_of_a_page_are_those_of_its_json_and_of_the_result() {
    let project = Project::copied();
    for fit in FITS {
        project.run_to(&["report", &format!("fits/{fit}")], &[0]);
        let page = read(&project, &format!("reports/{fit}/index.html"));
        let report: Value =
            serde_json::from_str(&read(&project, &format!("reports/{fit}/report.json"))).unwrap();
        let result: Value =
            serde_json::from_str(&read(&project, &format!("fits/{fit}/result.json"))).unwrap();
        for line in report["parameters"].as_array().unwrap() {
            let found = &result["parameters"][line["name"].as_str().unwrap()];
            for key in ["estimate", "lower_95", "upper_95", "verdict"] {
                assert_eq!(line[key], found[key], "{fit}: {key} of {}", line["name"]);
            }
        }
        let (known, mut seen) = (numbers(&report), 0);
        for cell in shown(&page) {
            for token in tokens(&cell) {
                assert!(is_known(&known, token), "{fit}: {} in `{cell}`", token.0);
                seen += 1;
            }
        }
        assert!(seen > 50, "{fit}: {seen}");
        // and the test can fail
        let other = report["parameters"][0]["estimate"].as_f64().unwrap() * 1.000_37 + 123.0;
        assert!(!is_known(&known, (other, 1e-4)), "{other}");
    }
}

#[test]
fn numbers_are_read_with_sign_and_last_digit() {
    let found = tokens("\u{2212}0.05 % of 908(4), B2, 1.2\u{b7}10\u{207b}\u{2075}; 7 to 8.50.");
    assert_eq!(found, [(-0.05, 0.01), (908.0, 1.0), (7.0, 1.0), (8.5, 0.01)]);
    assert_eq!(tokens("690(10)"), [(690.0, 10.0)]);
}

/// The series of a page that have a given label and values in every frame: the unit of the last digit of
/// each, and its values.
fn sampled_series(page: &str, label: &str) -> Vec<(f64, Vec<Option<f64>>)> {
    let series = |part: &str| {
        let (grid, rest) = part.split_once("\" data-values=\"").unwrap();
        let decimals: i32 = grid.rsplit(' ').next().unwrap().parse().unwrap();
        let (digit, mut sum) = (10.0_f64.powi(-decimals), 0_i64);
        let value = |word: &str| {
            sum += word.parse::<i64>().ok()?;
            Some(sum as f64 * digit)
        };
        (digit, rest.split_once('"').unwrap().0.split(' ').map(value).collect())
    };
    page.split(&format!("data-label=\"{label}\" data-grid=\"")).skip(1).map(series).collect()
}

#[test]
fn the_cursor_shows_the_residuals_of_the_table() {
    let project = Project::copied();
    for fit in FITS {
        project.run_to(&["report", &format!("fits/{fit}")], &[0]);
        let of = |file: &str| read(&project, &format!("reports/{fit}/{file}"));
        let comparison: Value = serde_json::from_str(&of("comparison.json")).unwrap();
        let (page, table) = (of("index.html"), of("residuals.csv"));
        let column =
            table.lines().next().unwrap().split(',').position(|name| name == "deflection_m").unwrap();
        let cell = |line: &str| line.split(',').nth(column).unwrap().parse::<f64>().ok();
        let residual_m: Vec<Option<f64>> = table.lines().skip(1).map(cell).collect();
        let shown = sampled_series(&page, "measured \u{2212} model");
        let Some(noise_m) = comparison["single_run"]["deflection"]["noise_m"].as_f64() else {
            assert!(residual_m.is_empty() && shown.is_empty(), "{fit}");
            continue;
        };
        let equals = |digit: f64, shown: &Option<f64>, residual_m: &Option<f64>| match (shown, residual_m) {
            (Some(shown), Some(m)) => (shown - m / noise_m).abs() < 0.5001 * digit,
            (shown, m) => shown.is_none() && m.is_none(),
        };
        let same = |(digit, values): &&(f64, Vec<Option<f64>>)| {
            values.len() == residual_m.len()
                && values.iter().zip(&residual_m).all(|(v, m)| equals(*digit, v, m))
        };
        assert!(residual_m.iter().flatten().count() > 1000, "{fit}");
        assert!(shown.iter().any(|series| same(&series)), "{fit}: {} series", shown.len());
    }
}
