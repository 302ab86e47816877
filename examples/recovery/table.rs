//! Lines of the study, and the tables made of them.

use std::collections::BTreeMap;
use std::fmt::Write;

/// Result of one fit for one parameter.
#[derive(Default)]
pub struct Line {
    pub case: String,
    pub blade: u64,
    pub maker: String,
    pub fault: String,
    pub parameter: String,
    pub truth: f64,
    pub estimate: f64,
    pub ends: [Option<f64>; 2],
    pub verdict: String,
    pub explained: bool,
    pub seconds: f64,
    /// Cramér-Rao standard deviation of the logarithm, with the priors.
    pub bound: Option<f64>,
    /// Cost of the fit minus that of a descent from the true values. From each cost its number of degrees of
    /// freedom is subtracted first.
    pub above_truth: Option<f64>,
    /// Fall of the cost if the mean of the prior of the wrong constant is its true value; `None` for other
    /// faults, or if a descent fails.
    pub visible: Option<f64>,
    /// Verdict on the true law of friction: `preferred`, `undecided`, `lost` if another law is preferred, or
    /// `none` without a comparison or if no law explains the film.
    pub law: String,
    pub reasons: String,
}

/// Fall of the cost above which a wrong constant counts as visible in the recording. By chance, chi2 with one
/// degree of freedom exceeds it once in a thousand times.
const VISIBLE: f64 = 10.8;

impl Line {
    pub const HEAD: &str = "case,blade,maker,fault,parameter,truth,estimate,lower_95,upper_95,verdict,explained,\
                            seconds,cramer_rao,cost_above_truth,cost_of_fault,law,reasons\n";

    pub fn csv(&self) -> String {
        let Self { case, blade, maker, fault, parameter, truth, estimate, verdict, explained, .. } = self;
        let Self { seconds, law, reasons, .. } = self;
        let written = |number: Option<f64>| number.map_or_else(String::new, |number| number.to_string());
        let [lower, upper] = self.ends.map(written);
        let [bound, above, visible] = [self.bound, self.above_truth, self.visible].map(written);
        format!(
            "{case},{blade},{maker},{fault},{parameter},{truth},{estimate},{lower},{upper},{verdict},{explained},\
             {seconds:.1},{bound},{above},{visible},{law},{reasons}\n"
        )
    }

    /// Lines of a file without its header; incomplete lines are left out.
    pub fn read_all(text: &str) -> Vec<Self> {
        text.lines().skip(1).filter_map(Self::parse).collect()
    }

    fn parse(line: &str) -> Option<Self> {
        let cells: [&str; 17] = line.split(',').collect::<Vec<_>>().try_into().ok()?;
        let word = |at: usize| cells[at].to_owned();
        let number = |at: usize| cells[at].parse::<f64>().ok();
        Some(Self {
            case: word(0),
            blade: cells[1].parse().ok()?,
            maker: word(2),
            fault: word(3),
            parameter: word(4),
            truth: number(5)?,
            estimate: number(6)?,
            ends: [number(7), number(8)],
            verdict: word(9),
            explained: cells[10].parse().ok()?,
            seconds: number(11)?,
            bound: number(12),
            above_truth: number(13),
            visible: number(14),
            law: word(15),
            reasons: word(16),
        })
    }

    fn is_inside(&self) -> bool {
        self.ends[0].is_none_or(|lower| lower <= self.truth)
            && self.ends[1].is_none_or(|upper| self.truth <= upper)
    }

    fn is_identified(&self) -> bool {
        self.verdict == "identified"
    }

    /// Half width of the interval in the logarithm; `None` if an end is missing.
    fn half_width(&self) -> Option<f64> {
        Some(0.5 * (self.ends[1]? / self.ends[0]?).ln())
    }

    /// Whether the parameter is called identified although its interval lacks an end, or the estimate is more
    /// than four of its standard deviations from the true value.
    fn is_wrong(&self) -> bool {
        let off = (self.estimate / self.truth).ln().abs();
        self.is_identified() && self.half_width().is_none_or(|half| off > 4.0 * half / 1.96)
    }

    /// Distance of the estimate from the true value, in standard deviations of its interval.
    fn deviations_off(&self) -> Option<f64> {
        Some((self.estimate / self.truth).ln() / (self.half_width()? / 1.96))
    }

    /// Half width of the interval over 1.96 Cramér-Rao standard deviations.
    fn width_ratio(&self) -> Option<f64> {
        Some(self.half_width()? / (1.96 * self.bound?))
    }
}

/// Tables of the study in Markdown: one for each case, with a column for each maker and each fault.
pub fn write_table(lines: &[Line]) -> String {
    let mut text = String::from("Synthetic recordings: no camera took any of them.\n");
    for case in ["right", "faults"] {
        let of_case: Vec<&Line> = lines.iter().filter(|line| line.case == case).collect();
        if of_case.is_empty() {
            continue;
        }
        let mut groups = vec![("all".to_owned(), of_case.clone())];
        for group in of_case.iter().flat_map(|line| [&line.maker, &line.fault]) {
            if group != "none" && !groups.iter().any(|(name, _)| name == group) {
                let has = |line: &&&Line| [&line.maker, &line.fault].contains(&group);
                groups.push((group.clone(), of_case.iter().filter(has).copied().collect()));
            }
        }
        let rows = if case == "right" { right_rows } else { fault_rows };
        let columns: Vec<_> = groups.iter().map(|(_, lines)| rows(lines)).collect();
        let names: String = groups.iter().map(|(name, _)| format!(" {name} |")).collect();
        let _ = write!(text, "\n| {case} |{names}\n|---|{}\n", "---|".repeat(groups.len()));
        for (i, (words, _)) in columns[0].iter().enumerate() {
            let cells: String = columns.iter().map(|column| format!(" {} |", column[i].1)).collect();
            let _ = writeln!(text, "| {words} |{cells}");
        }
    }
    text
}

type Rows = Vec<(&'static str, String)>;

fn right_rows(lines: &[&Line]) -> Rows {
    let fits = split_fits(lines);
    let answered = fits.iter().filter(|fit| fit[0].verdict != "error").count();
    let sharp: Vec<&&Line> =
        lines.iter().filter(|line| line.bound.is_some_and(|bound| bound < 0.05)).collect();
    let known: Vec<&&&Line> = sharp.iter().filter(|line| line.is_identified()).collect();
    let mut ratios: Vec<f64> = known.iter().filter_map(|line| line.width_ratio()).collect();
    ratios.sort_by(f64::total_cmp);
    let narrow = ratios.iter().filter(|ratio| **ratio <= 1.5).count();
    let identified: Vec<&Line> = lines.iter().copied().filter(|line| line.is_identified()).collect();
    let off = lines.iter().filter(|line| line.explained).filter_map(|line| line.deviations_off());
    let mut squares: Vec<f64> = off.map(|off| off * off).collect();
    squares.sort_by(f64::total_cmp);
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    // (the median of the square of a normal variable is 0.455)
    let scatter = format!("{:.2}, {:.2}", mean.sqrt(), (middle(&squares) / 0.455).sqrt());
    let of_law = |law: &str| fits.iter().filter(|fit| fit[0].law == law).count();
    let laws = format!("{}, {}, {}", of_law("preferred"), of_law("undecided"), of_law("lost"));
    let unexplained = fits.iter().filter(|fit| !fit[0].explained).count();
    let mut rows = vec![
        ("blades", fits.len().to_string()),
        ("fits that end with an answer", count_of(answered, fits.len())),
        ("intervals that hold the truth; 95 % interval with blades as units", find_coverage(&fits)),
        ("of those identified", find_coverage(&split_fits(&identified))),
        (
            "identified, but over four deviations off",
            lines.iter().filter(|l| l.is_wrong()).count().to_string(),
        ),
        (
            "identified, of parameters with a Cramér-Rao deviation below 5 %",
            count_of(known.len(), sharp.len()),
        ),
        ("half width against 1.96 such deviations: median", format!("{:.2}", middle(&ratios))),
        ("at most 1.5", count_of(narrow, ratios.len())),
        ("errors in stated standard deviations: root mean square, and from the median", scatter),
        ("true law of friction preferred, undecided, lost", laws),
        ("called unexplained", count_of(unexplained, fits.len())),
    ];
    rows.extend(time_rows(&fits));
    rows
}

fn fault_rows(lines: &[&Line]) -> Rows {
    let fits = split_fits(lines);
    // a marker that is 5 mm off, a lost contact and a tip that is tracked wrongly count as visible without a
    // test
    let visible: Vec<&Vec<&Line>> =
        fits.iter().filter(|fit| fit[0].visible.is_none_or(|fall| fall > VISIBLE)).collect();
    let said = visible.iter().filter(|fit| !fit[0].explained).count();
    let silent = fits.iter().filter(|fit| !fit.iter().any(|line| line.is_identified())).count();
    let mut rows = vec![
        ("blades", fits.len().to_string()),
        ("faults that the recording shows", count_of(visible.len(), fits.len())),
        ("called unexplained, of these", count_of(said, visible.len())),
        ("nothing identified", count_of(silent, fits.len())),
        (
            "identified, but over four deviations off",
            lines.iter().filter(|l| l.is_wrong()).count().to_string(),
        ),
    ];
    rows.extend(time_rows(&fits));
    rows
}

fn time_rows(fits: &[Vec<&Line>]) -> Rows {
    let mut seconds: Vec<f64> = fits.iter().map(|fit| fit[0].seconds).collect();
    seconds.sort_by(f64::total_cmp);
    let longest = seconds.last().copied().unwrap_or(f64::NAN);
    vec![("seconds a fit: median, longest", format!("{:.0}, {longest:.0}", middle(&seconds)))]
}

fn split_fits<'a>(lines: &[&'a Line]) -> Vec<Vec<&'a Line>> {
    let mut fits = BTreeMap::<u64, Vec<&Line>>::new();
    lines.iter().for_each(|line| fits.entry(line.blade).or_default().push(line));
    fits.into_values().collect()
}

/// Fraction of the intervals that contain the true value, averaged over the blades, and its 95 % interval by
/// Wilson's formula. The intervals of one blade are not independent. So the formula gets the number of
/// independent intervals whose fraction would scatter as much as the average over the blades.
fn find_coverage(fits: &[Vec<&Line>]) -> String {
    let shares: Vec<f64> = fits
        .iter()
        .filter(|fit| fit[0].verdict != "error")
        .map(|fit| fit.iter().filter(|line| line.is_inside()).count() as f64 / fit.len() as f64)
        .collect();
    let blades = shares.len() as f64;
    let share = shares.iter().sum::<f64>() / blades;
    let scatter = shares.iter().map(|one| (one - share).powi(2)).sum::<f64>() / (blades - 1.0);
    let units = if scatter > 0.0 { share * (1.0 - share) * blades / scatter } else { blades };
    let z = 1.96_f64;
    let centre = (share + z * z / (2.0 * units)) / (1.0 + z * z / units);
    let half =
        z / (1.0 + z * z / units) * (share * (1.0 - share) / units + z * z / (4.0 * units * units)).sqrt();
    let [share, low, high] = [share, centre - half, centre + half].map(|share| 100.0 * share);
    format!("{share:.1} %; {low:.1} to {high:.1} %")
}

fn count_of(part: usize, all: usize) -> String {
    format!("{part} of {all}")
}

/// The median of sorted values.
fn middle(sorted: &[f64]) -> f64 {
    let at = |from_end: usize| sorted.get(from_end / 2).copied().unwrap_or(f64::NAN);
    0.5 * (at(sorted.len().saturating_sub(1)) + at(sorted.len()))
}
