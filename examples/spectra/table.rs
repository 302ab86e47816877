//! The table of hard records, beside what other methods read from the same ones.

use crate::counts::{Counts, Listed};
use crate::hard::{KINDS, Kind};
use crate::score::{deviation, rms};

/// A method: its name, and what it lists of a record with its frame rate, Hz.
pub type Method = (&'static str, fn(&[Option<f64>], f64) -> Vec<f64>);

/// Frames of a record up to which other methods are tried.
const LONGEST: usize = 2000;

fn of_method(kind: &Kind, seeds: u64, (_, list): &Method) -> Counts {
    let named = |hz: f64| Listed { hz, sd_hz: f64::INFINITY, clear: false, drifts: false };
    Counts::over(kind, seeds, |made| {
        (list(&made.samples, made.rate_hz).into_iter().map(named).collect(), false)
    })
}

/// Prints the table of the kinds whose group or name holds `only`.
pub fn print(seeds: u64, only: Option<&str>, methods: &[Method]) {
    println!("\n## Hard records\n");
    println!(
        "Records of a line: {seeds}. Missed: of the oscillations sought. Others: listed, but none. Wrong: records with one that is none and is called clear. rms/CRB: of the frequencies found, over the bound of each alone. Scaled: deviation of error over stated deviation. Cut: records of which a part was left out.\n"
    );
    let names = methods.iter().map(|(name, _)| *name);
    let heads = |what: &str| {
        std::iter::once(what.to_owned())
            .chain(names.clone().map(|name| format!("{what}, {name}")))
            .collect::<Vec<_>>()
            .join(" | ")
    };
    println!(
        "| record | sought | {} | {} | {} | wrong | scaled | cut |",
        heads("missed"),
        heads("others"),
        heads("rms/CRB")
    );
    println!("|---|{}", "---:|".repeat(4 + 3 * (methods.len() + 1)));
    let chosen = |kind: &&Kind| only.is_none_or(|only| kind.group == only || kind.name.contains(only));
    for kind in KINDS.iter().filter(chosen) {
        let ours = Counts::of(kind, seeds);
        // what takes a covariance of so many frames is not made for them
        let short = kind.made(0).samples.len() <= LONGEST;
        let theirs: Vec<Option<Counts>> =
            methods.iter().map(|method| short.then(|| of_method(kind, seeds, method))).collect();
        let cells = |of: &dyn Fn(&Counts) -> String| {
            std::iter::once(of(&ours))
                .chain(theirs.iter().map(|counts| counts.as_ref().map_or_else(|| "-".to_owned(), of)))
                .collect::<Vec<_>>()
                .join(" | ")
        };
        let over_bound = |c: &Counts| {
            if c.over_bound.is_empty() { "-".to_owned() } else { format!("{:.2}", rms(&c.over_bound)) }
        };
        let scaled =
            if ours.scaled.is_empty() { "-".to_owned() } else { format!("{:.2}", deviation(&ours.scaled)) };
        println!(
            "| {} | {} | {} | {} | {} | {} | {scaled} | {} |",
            kind.name,
            ours.sought,
            cells(&|c| c.missed.to_string()),
            cells(&|c| c.others.to_string()),
            cells(&over_bound),
            ours.wrong,
            ours.cut
        );
    }
}
