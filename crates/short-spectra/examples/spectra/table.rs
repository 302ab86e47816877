//! The table of hard records, beside what other methods read from the same ones.

use crate::counts::{Counts, Listed};
use crate::hard::{KINDS, Kind};
use crate::score::{deviation, rms};

/// A method: its name, and what it lists of a record with its frame rate, Hz.
pub type Method = (&'static str, fn(&[Option<f64>], f64) -> Vec<f64>);

/// Frames of a record up to which other methods are tried.
const LONGEST: usize = 2000;

fn of_method(kind: &Kind, seeds: u64, (_, list): &Method) -> Counts {
    let named = |hz: f64| Listed { hz, sd_hz: f64::INFINITY, clear: false };
    Counts::over(kind, seeds, |made| list(&made.samples, made.rate_hz).into_iter().map(named).collect())
}

/// Prints the table of the kinds whose group or name holds `only`.
pub fn print(seeds: u64, only: Option<&str>, methods: &[Method]) {
    println!("\n## Hard records\n");
    let names: Vec<&str> = std::iter::once("wiperlab").chain(methods.iter().map(|(name, _)| *name)).collect();
    println!(
        "Records per row: {seeds}. Numbers with slashes: {}. Missed: oscillations sought but not listed. Others: listed components that are not in the record. rms/CRB: rms error of the frequencies found, each error divided by the bound for that component alone. Wrong: records with a false component that wiperlab calls clear. Scaled: standard deviation of the errors of wiperlab, each divided by its stated standard deviation.\n",
        names.join(" / ")
    );
    println!("| record | sought | missed | others | rms/CRB | wrong | scaled |");
    println!("|---|{}", "---:|".repeat(6));
    let chosen = |kind: &&Kind| only.is_none_or(|only| kind.group == only || kind.name.contains(only));
    for kind in KINDS.iter().filter(chosen) {
        let ours = Counts::of(kind, seeds);
        // what takes a covariance of so many frames is not made for them
        let short = kind.made(0).samples.len() <= LONGEST;
        let theirs: Vec<Option<Counts>> =
            methods.iter().map(|method| short.then(|| of_method(kind, seeds, method))).collect();
        let cells = |of: &dyn Fn(&Counts) -> String| {
            std::iter::once(of(&ours)).chain(theirs.iter().flatten().map(of)).collect::<Vec<_>>().join(" / ")
        };
        let number = |values: &[f64], of: fn(&[f64]) -> f64| {
            if values.is_empty() { "-".to_owned() } else { format!("{:.2}", of(values)) }
        };
        let over_bound =
            if ours.sought == 0 { "-".to_owned() } else { cells(&|c| number(&c.over_bound, rms)) };
        println!(
            "| {} | {} | {} | {} | {over_bound} | {} | {} |",
            kind.name,
            ours.sought,
            if ours.sought == 0 { "-".to_owned() } else { cells(&|c| c.missed.to_string()) },
            cells(&|c| c.others.to_string()),
            ours.wrong,
            number(&ours.scaled, deviation)
        );
    }
}
