//! Lines of the study and the table of them.

use crate::case::Case;
use std::fmt::Write;

/// What was found of one parameter in one fit.
pub struct Line {
    pub case: String,
    pub blade: u64,
    pub run: u64,
    pub parameter: String,
    pub truth: f64,
    pub estimate: f64,
    pub ends: [Option<f64>; 2],
    pub verdict: String,
    pub explained: bool,
}

impl Line {
    pub const HEAD: &str = "case,blade,run,parameter,truth,estimate,lower_95,upper_95,verdict,explained\n";

    pub fn is(&self, case: &str, blade: u64, run: u64) -> bool {
        (self.case.as_str(), self.blade, self.run) == (case, blade, run)
    }

    pub fn csv(&self) -> String {
        let [lower, upper] = self.ends.map(|end| end.map_or_else(String::new, |end| end.to_string()));
        let Self { case, blade, run, parameter, truth, estimate, verdict, explained, .. } = self;
        format!("{case},{blade},{run},{parameter},{truth},{estimate},{lower},{upper},{verdict},{explained}\n")
    }

    /// Lines of a file, whole ones alone.
    pub fn read(text: &str) -> Vec<Self> {
        text.lines().skip(1).filter_map(Self::parse).collect()
    }

    fn parse(line: &str) -> Option<Self> {
        let cells: Vec<&str> = line.split(',').collect();
        let [case, blade, run, parameter, truth, estimate, lower, upper, verdict, explained] =
            cells.as_slice()
        else {
            return None;
        };
        Some(Self {
            case: (*case).to_owned(),
            blade: blade.parse().ok()?,
            run: run.parse().ok()?,
            parameter: (*parameter).to_owned(),
            truth: truth.parse().ok()?,
            estimate: estimate.parse().ok()?,
            ends: [lower.parse().ok(), upper.parse().ok()],
            verdict: (*verdict).to_owned(),
            explained: explained.parse().ok()?,
        })
    }

    fn error(&self) -> f64 {
        100.0 * (self.estimate / self.truth).ln().abs()
    }

    fn inside(&self) -> bool {
        self.ends[0].is_none_or(|lower| lower <= self.truth)
            && self.ends[1].is_none_or(|upper| self.truth <= upper)
    }

    /// Standard deviation of the logarithm by the interval, where that is closed.
    fn sd(&self) -> Option<f64> {
        Some((self.ends[1]? / self.ends[0]?).ln() / 3.92)
    }
}

impl std::fmt::Display for Line {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { case, blade, run, parameter, truth, estimate, verdict, .. } = self;
        let error = 100.0 * (estimate / truth).ln();
        let said = if self.inside() { "" } else { " MISSED" };
        let misfit = if self.explained { "" } else { " (misfit)" };
        write!(
            f,
            "{case} {blade} {run} {parameter:<32} {estimate:>10.5} ({error:+7.3} %) {verdict}{misfit}{said}"
        )
    }
}

/// The study as a table in Markdown.
pub fn table(cases: &[Case], lines: &[Line]) -> String {
    let mut text = String::from(
        "Synthetic recordings: no camera took any of them.\n\n\
         | case | fits | all identified | misfit said | median (largest) error of A, % | B, % | C, % | neck, % | \
         shoulder, % | truth inside 95 %, of all | of those identified |\n\
         |---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for case in cases {
        let of: Vec<&Line> = lines.iter().filter(|line| line.case == case.name).collect();
        if !of.is_empty() {
            text += &row(case, &of);
        }
    }
    text
}

fn row(case: &Case, lines: &[&Line]) -> String {
    let fits: Vec<&[&Line]> = lines.chunks(5).collect();
    let whole = fits.iter().filter(|fit| fit.iter().all(|line| line.verdict == "identified")).count();
    let misfit = fits.iter().filter(|fit| !fit[0].explained).count();
    let mut text = format!("| {} | {} | {whole} | {misfit} |", case.words, fits.len());
    for at in 0..5 {
        let errors: Vec<f64> = fits.iter().filter_map(|fit| Some(fit.get(at)?.error())).collect();
        let largest = errors.iter().copied().fold(0.0, f64::max);
        let _ = write!(text, " {:.2} ({largest:.2}) |", median(&errors));
    }
    let known: Vec<&Line> = lines.iter().copied().filter(|line| line.verdict == "identified").collect();
    for of in [lines, &known] {
        let _ = write!(text, " {} |", coverage(of));
    }
    text.push('\n');
    if case.seeds > 1 || case.corners > 0 {
        let _ = writeln!(
            text,
            "| ... largest distance of two answers of a blade | | | | {:.3} deviations | | | | | | |",
            farthest(lines)
        );
    }
    text
}

/// How many intervals hold their truth, with the binomial 95 % interval of the share.
fn coverage(lines: &[&Line]) -> String {
    let (n, k) = (lines.len(), lines.iter().filter(|line| line.inside()).count());
    if n == 0 {
        return "none".to_owned();
    }
    // Wilson's interval of a share
    let (n_, share, z) = (n as f64, k as f64 / n as f64, 1.96_f64);
    let middle = (share + z * z / (2.0 * n_)) / (1.0 + z * z / n_);
    let half = z / (1.0 + z * z / n_) * (share * (1.0 - share) / n_ + z * z / (4.0 * n_ * n_)).sqrt();
    format!(
        "{k} of {n} ({:.1} %; {:.0} to {:.0})",
        100.0 * share,
        100.0 * (middle - half),
        100.0 * (middle + half)
    )
}

/// Largest distance of two answers for one parameter of one blade, in standard deviations.
fn farthest(lines: &[&Line]) -> f64 {
    let mut largest = 0.0_f64;
    for a in lines {
        for b in lines.iter().filter(|b| b.blade == a.blade && b.parameter == a.parameter) {
            if let Some(sd) = a.sd().filter(|_| a.verdict == "identified" && b.verdict == "identified") {
                largest = largest.max((a.estimate / b.estimate).ln().abs() / sd);
            }
        }
    }
    largest
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = |from_end: usize| sorted.get(from_end / 2).copied().unwrap_or(f64::NAN);
    0.5 * (middle(sorted.len().saturating_sub(1)) + middle(sorted.len()))
}
