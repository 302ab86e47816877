//! Compares the components that methods list of random records with the oscillations in these records, in one
//! table.
//!
//! A component matches an oscillation if its frequency differs from the oscillation's mean frequency by at
//! most the largest of these distances: one resolution (`1/T`); four stated deviations, but at most two
//! resolutions; four Cramér-Rao bounds; for combs the width that their jitter gives the line. Its range must
//! overlap that of the oscillation, widened by this distance. Each oscillation gets at most one component,
//! and the nearest pairs come first. Multiples of a comb and sidebands of a modulated cycle are neither
//! sought nor false.
//!
//! - missed: oscillations above 15 dB that match no component and lie in no interval of a component with a
//!   doubt. The interval is frequency ± deviation, where the deviation counts as at most one resolution.
//! - false: components that match no oscillation and are no multiple or sideband of one.
//! - wrong clear: `clear` components without an oscillation, multiple or sideband within four deviations (or
//!   the width from jitter).
//! - clear kept: of the oscillations above 20 dB, the fraction with a `clear` component within four
//!   deviations.
//! - error/deviation, error/CRB: errors of the clear components that match, over the stated deviation and
//!   over the Cramér-Rao bound: rms, and in brackets the median of the absolute values over 0.6745.
//! - apart: oscillations with fewer than three cycles or within one resolution of another are left out of the
//!   columns above. The last columns count those of them above 15 dB, those missed, and the wrong clear
//!   components that match one of them.

use crate::mixtures::{Mixture, Oscillation};
use crate::rivals;
use crate::score::{Reading, read_record, rms};
use short_spectra::{Component, ComponentVerdict, SampledRecord, SpectrumSettings};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// A method: its name, the function that lists the components of samples with their rate in Hz, and whether
/// it gives deviations and verdicts.
type Method = (&'static str, fn(&[Option<f64>], f64) -> Reading, bool);

const METHODS: [Method; 3] = [
    ("wiperlab", read_completely, true),
    ("ESPRIT", |samples, rate_hz| list_frequencies(rivals::esprit(samples, rate_hz)), false),
    ("Lomb-Scargle", |samples, rate_hz| list_frequencies(rivals::lomb_scargle(samples, rate_hz)), false),
];

/// The complete analysis. A frequency above the fold counts at the frequency at which it appears, so no
/// component is suspected of folding.
fn read_completely(samples: &[Option<f64>], rate_hz: f64) -> Reading {
    let settings = SpectrumSettings { fastest_hz: 0.0, ..SpectrumSettings::default() };
    read_record(&SampledRecord { samples, frame_rate_hz: rate_hz, exposure_s: None }, &settings)
}

/// Frequencies without deviations and verdicts.
fn list_frequencies(list: Vec<f64>) -> Reading {
    let component = |frequency_hz| Component { frequency_hz, ..Component::default() };
    Reading { components: list.into_iter().map(component).collect(), from_s: 0.0 }
}

/// Signal-to-noise ratio, dB, above which an oscillation is sought: weaker ones are often hidden in the
/// noise.
const SOUGHT_DB: f64 = 15.0;
/// Signal-to-noise ratio, dB, above which an oscillation should be clear.
const STRONG_DB: f64 = 20.0;
/// Number of stated deviations beyond which a component is wrong: a normal error exceeds it in one of 16,000
/// cases.
const FALSE_DEVIATIONS: f64 = 4.0;
/// Smallest number of records with a pair of kinds for which the table has a row: fewer say little.
const PAIR_RECORDS: usize = 20;

/// How a method lists an oscillation.
struct Fate {
    kind: &'static str,
    snr_db: f64,
    apart: bool,
    /// Whether a component matches it.
    listed: bool,
    /// Whether it lies in the interval of a component with a doubt.
    covered: bool,
    /// Whether a clear component matches it within four deviations.
    kept: bool,
    /// Error over the deviation and over the bound, if the component is clear.
    scaled: Option<(f64, Option<f64>)>,
}

/// Counts of what a method lists of a record.
struct Outcome {
    fates: Vec<Fate>,
    /// False components by verdict.
    others: BTreeMap<ComponentVerdict, usize>,
    clear: usize,
    wrong: usize,
    wrong_apart: usize,
    ms: f64,
}

/// A record and what each method lists of it.
struct Judged {
    seed: u64,
    families: Vec<String>,
    truth: String,
    outcomes: Vec<Outcome>,
    found: Vec<String>,
}

fn judge_reading(mixture: &Mixture, reading: &Reading, ms: f64) -> Outcome {
    let (list, resolution_hz) = (&mixture.oscillations, mixture.resolution_hz());
    let mean_hz = |o: &Oscillation| o.mean_hz(reading.from_s);
    let stated_hz = |c: &Component| FALSE_DEVIATIONS * c.frequency_sd_hz;
    let near_hz = |c: &Component| stated_hz(c).min(2.0 * resolution_hz).max(resolution_hz);
    let distance = |o: &Oscillation, c: &Component| {
        let within_hz = near_hz(c).max(FALSE_DEVIATIONS * o.bound_hz.unwrap_or(0.0)).max(o.width_hz(1));
        let (low, high) =
            c.range_hz.map_or((c.frequency_hz, c.frequency_hz), |range| (range.low_hz, range.high_hz));
        let (least, most) = o.range_hz();
        let off = (c.frequency_hz - mean_hz(o)).abs() / within_hz;
        (off <= 1.0 && low <= most + within_hz && high >= least - within_hz).then_some(off)
    };
    let components = &reading.components;
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (k, o) in list.iter().enumerate() {
        pairs.extend(components.iter().enumerate().filter_map(|(j, c)| Some((distance(o, c)?, k, j))));
    }
    portable_math::sort_by_number(&mut pairs, |a| a.0);
    let (mut of, mut taken) = (vec![None; list.len()], vec![false; components.len()]);
    for (_, k, j) in pairs {
        if of[k].is_none() && !taken[j] {
            (of[k], taken[j]) = (Some(j), true);
        }
    }
    let is_part = |c: &Component, within_hz: &dyn Fn(&Component) -> f64| {
        let parts = list.iter().flat_map(|o| o.parts_hz(reading.from_s));
        parts.into_iter().any(|(hz, width_hz)| (c.frequency_hz - hz).abs() <= within_hz(c).max(width_hz))
    };
    let is_right = |o: &Oscillation, c: &Component| {
        (c.frequency_hz - mean_hz(o)).abs() <= stated_hz(c).max(o.width_hz(1))
    };
    let is_clear = |c: &Component| c.verdict == ComponentVerdict::Clear;
    let fate = |(o, found): (&Oscillation, &Option<usize>)| {
        let found = found.map(|j| &components[j]);
        let clear = found.filter(|c| is_clear(c));
        let off_hz = |c: &Component| c.frequency_hz - mean_hz(o);
        Fate {
            kind: o.kind,
            snr_db: o.snr_db,
            apart: o.apart,
            listed: found.is_some(),
            covered: components.iter().any(|c| {
                is_doubt(c) && (c.frequency_hz - mean_hz(o)).abs() <= c.frequency_sd_hz.min(resolution_hz)
            }),
            kept: clear.is_some_and(|c| is_right(o, c)),
            scaled: clear
                .map(|c| (off_hz(c) / c.frequency_sd_hz, o.bound_hz.map(|bound_hz| off_hz(c) / bound_hz))),
        }
    };
    let fates = list.iter().zip(&of).map(fate).collect();
    let mut others = BTreeMap::new();
    for (c, _) in components.iter().zip(&taken).filter(|(c, taken)| !**taken && !is_part(c, &near_hz)) {
        *others.entry(c.verdict).or_insert(0) += 1;
    }
    let clear = || components.iter().filter(|c| is_clear(c));
    let wrong = || clear().filter(|c| !is_part(c, &stated_hz) && !list.iter().any(|o| is_right(o, c)));
    let wrong_apart = wrong().filter(|c| list.iter().any(|o| o.apart && distance(o, c).is_some())).count();
    Outcome { fates, others, clear: clear().count(), wrong: wrong().count() - wrong_apart, wrong_apart, ms }
}

/// Whether the verdict is a doubt about the frequency.
fn is_doubt(c: &Component) -> bool {
    use ComponentVerdict::{Attenuated, Clear, Harmonic, Mains, Sideband, Subharmonic};
    ![Attenuated, Clear, Harmonic, Mains, Sideband, Subharmonic].contains(&c.verdict)
}

impl Fate {
    fn is_missed(&self) -> bool {
        self.snr_db > SOUGHT_DB && !self.listed && !self.covered
    }
}

/// Sums over outcomes.
#[derive(Default)]
struct Tally {
    records: usize,
    sought: usize,
    missed: usize,
    others: BTreeMap<ComponentVerdict, usize>,
    clear: usize,
    wrong: usize,
    strong: usize,
    kept: usize,
    scaled: Vec<f64>,
    over_bound: Vec<f64>,
    ms: Vec<f64>,
    /// Numbers of sought, missed and wrong clear ones among those apart.
    apart: [usize; 3],
    /// Number of records in which every oscillation is listed or covered, whatever its signal-to-noise ratio,
    /// and the number of these with a false component of each verdict.
    open: usize,
    needless: BTreeMap<ComponentVerdict, usize>,
}

impl Tally {
    /// Adds a record. If a kind is given, only oscillations of this kind count; components count in any case.
    fn add(&mut self, outcome: &Outcome, kind: Option<&str>) {
        self.records += 1;
        for fate in outcome.fates.iter().filter(|fate| kind.is_none_or(|kind| fate.kind == kind)) {
            if fate.apart {
                self.apart[0] += usize::from(fate.snr_db > SOUGHT_DB);
                self.apart[1] += usize::from(fate.is_missed());
                continue;
            }
            self.sought += usize::from(fate.snr_db > SOUGHT_DB);
            self.missed += usize::from(fate.is_missed());
            self.strong += usize::from(fate.snr_db > STRONG_DB);
            self.kept += usize::from(fate.snr_db > STRONG_DB && fate.kept);
            self.scaled.extend(fate.scaled.map(|scaled| scaled.0));
            self.over_bound.extend(fate.scaled.and_then(|scaled| scaled.1));
        }
        self.clear += outcome.clear;
        self.wrong += outcome.wrong;
        self.apart[2] += outcome.wrong_apart;
        self.ms.push(outcome.ms);
        let open = !outcome.fates.iter().any(|fate| !fate.listed && !fate.covered);
        self.open += usize::from(open);
        for (verdict, count) in &outcome.others {
            *self.others.entry(*verdict).or_insert(0) += count;
            *self.needless.entry(*verdict).or_insert(0) += usize::from(open);
        }
    }

    fn cells(&self, verdicts: bool) -> [String; 8] {
        let said = |cell: String| if verdicts { cell } else { "-".to_owned() };
        let mut ms = self.ms.clone();
        ms.sort_by(f64::total_cmp);
        [
            self.missed.to_string(),
            self.others.values().sum::<usize>().to_string(),
            said(self.clear.to_string()),
            said(format!("{} ({})", self.wrong, format_percent(self.wrong, self.clear))),
            said(format_percent(self.kept, self.strong)),
            said(format_spread(&self.scaled)),
            format_spread(&self.over_bound),
            format!("{:.1}, {:.0}", ms[ms.len() / 2], ms[ms.len() - 1]),
        ]
    }
}

fn format_percent(part: usize, of: usize) -> String {
    if of == 0 { "-".to_owned() } else { format!("{:.1} %", 100.0 * part as f64 / of as f64) }
}

/// Rms, and in brackets the standard deviation that follows from the median of the absolute values.
fn format_spread(values: &[f64]) -> String {
    let mut sizes: Vec<f64> = values.iter().map(|value| value.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    sizes
        .get(sizes.len() / 2)
        .map_or_else(|| "-".to_owned(), |m| format!("{:.2} ({:.2})", rms(values), m / 0.6745))
}

/// Processor time of this thread since its start, ms, to a few milliseconds; `None` on systems without it.
fn thread_ms() -> Option<f64> {
    let said = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    said.split(' ').next()?.parse::<f64>().ok().map(|ns| ns / 1e6)
}

/// The result of a call and the time that it takes, ms: wall time of short calls, processor time of long
/// ones.
fn run_timed<T>(call: impl FnOnce() -> T) -> (T, f64) {
    /// Wall time, ms, up to which a call is short: processor time is too coarse for it.
    const SHORT_MS: f64 = 20.0;
    let (started, before_ms) = (Instant::now(), thread_ms());
    let result = call();
    let wall_ms = started.elapsed().as_secs_f64() * 1e3;
    let used_ms = before_ms.zip(thread_ms()).map(|(before, after)| after - before);
    (result, used_ms.filter(|used| wall_ms > SHORT_MS && *used > 0.0).unwrap_or(wall_ms))
}

fn judge_seed(seed: u64, filter: &[&str], methods: &[Method]) -> Option<Judged> {
    let mixture = Mixture::from_seed(seed);
    let mut families = mixture.families.clone();
    let kinds: BTreeSet<&str> = mixture.oscillations.iter().map(|o| o.kind).collect();
    families.extend(kinds.iter().map(|kind| format!("kind: {kind}")));
    let pairs = kinds.iter().flat_map(|a| kinds.range(*a..).skip(1).map(move |b| format!("pair: {a} + {b}")));
    families.extend(pairs);
    families.extend(kinds.is_empty().then(|| "kind: none".to_owned()));
    if !filter.iter().all(|word| families.iter().any(|family| family.contains(word))) {
        return None;
    }
    let truth = |o: &Oscillation| {
        let (low, high) = o.range_hz();
        let bound = o.bound_hz.map_or("-".to_owned(), |bound_hz| format!("{bound_hz:.3}"));
        let apart = if o.apart { ", apart" } else { "" };
        format!(
            "{} {:.2} Hz ({low:.1} to {high:.1}, {:.1} dB, bound {bound}{apart})",
            o.kind,
            o.mean_hz(0.0),
            o.snr_db
        )
    };
    let truth: Vec<String> = mixture.oscillations.iter().map(truth).collect();
    let said = |c: &Component| {
        let range = c.range_hz.map_or(String::new(), |r| format!(" ({:.1} to {:.1})", r.low_hz, r.high_hz));
        format!("{} {:.2} ± {:.3} Hz{range}", c.verdict.name(), c.frequency_hz, c.frequency_sd_hz)
    };
    let (mut outcomes, mut found) = (Vec::new(), Vec::new());
    for (_, read, _) in methods {
        let (reading, ms) = run_timed(|| read(&mixture.samples, mixture.rate_hz));
        outcomes.push(judge_reading(&mixture, &reading, ms));
        found.push(reading.components.iter().map(said).collect::<Vec<_>>().join("; "));
    }
    let truth = format!("{} frames, {} Hz: {}", mixture.samples.len(), mixture.rate_hz, truth.join("; "));
    Some(Judged { seed, families, truth, outcomes, found })
}

/// Judges the records of seeds in parallel, each on one thread, so that the time of a record is that of its
/// thread.
fn judge_seeds(seeds: std::ops::Range<u64>, filter: &[&str], methods: &[Method]) -> Vec<Judged> {
    let (next, all) = (AtomicU64::new(seeds.start), Mutex::new(BTreeMap::new()));
    let work = || {
        let seed = || Some(next.fetch_add(1, Ordering::Relaxed)).filter(|seed| *seed < seeds.end);
        while let Some(seed) = seed() {
            if let Some(judged) = judge_seed(seed, filter, methods) {
                all.lock().expect("no thread fails").insert(seed, judged);
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, Into::into) {
            let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread starts");
            scope.spawn(move || alone.install(work));
        }
    });
    all.into_inner().expect("no thread fails").into_values().collect()
}

/// Prints the result of `mixtures COUNT [FIRST_SEED] [WORD..]`: the table; with `list` the records with a
/// missed oscillation or a wrong clear component; with `dump` the samples of the first record. The name of a
/// method selects this method. Any other word selects the records with a family whose name contains it.
pub fn print_scores(arguments: &[String]) {
    let mut numbers = arguments.iter().filter_map(|word| word.parse::<u64>().ok());
    let (count, first) = (numbers.next().unwrap_or(2000), numbers.next().unwrap_or(1));
    let words: Vec<&str> =
        arguments.iter().map(String::as_str).filter(|word| word.parse::<u64>().is_err()).collect();
    let named: Vec<Method> = METHODS.into_iter().filter(|method| words.contains(&method.0)).collect();
    let methods = if named.is_empty() { METHODS.to_vec() } else { named };
    let is_filter = |word: &&&str| !["list", "dump"].contains(*word) && METHODS.iter().all(|m| m.0 != **word);
    let filter: Vec<&str> = words.iter().filter(is_filter).copied().collect();
    if words.contains(&"dump") {
        let mixture = Mixture::from_seed(first);
        println!("time_s,x");
        for (i, sample) in mixture.samples.iter().enumerate() {
            let value = sample.map_or(String::new(), |value| value.to_string());
            println!("{},{value}", i as f64 / mixture.rate_hz);
        }
        return;
    }
    let judged = judge_seeds(first..first + count, &filter, &methods);
    if words.contains(&"list") {
        return print_failures(&judged, &methods);
    }
    print_tables(&judged, &methods);
}

fn print_failures(judged: &[Judged], methods: &[Method]) {
    for record in judged {
        for (k, (name, _, _)) in methods.iter().enumerate().filter(|(_, method)| method.2) {
            let outcome = &record.outcomes[k];
            let missed: Vec<&str> = outcome
                .fates
                .iter()
                .filter(|fate| !fate.apart && fate.is_missed())
                .map(|fate| fate.kind)
                .collect();
            if missed.is_empty() && outcome.wrong == 0 {
                continue;
            }
            println!(
                "{} {name}: missed [{}], {} wrong clear | {} | {} | found: {}",
                record.seed,
                missed.join(", "),
                outcome.wrong,
                record.families.join(", "),
                record.truth,
                record.found[k]
            );
        }
    }
}

fn print_tables(judged: &[Judged], methods: &[Method]) {
    let tally = |k: usize, holds: &dyn Fn(&Judged) -> bool, kind: Option<&str>| {
        let mut tally = Tally::default();
        judged.iter().filter(|record| holds(record)).for_each(|record| tally.add(&record.outcomes[k], kind));
        tally
    };
    println!("| method | verdict | false | records without a miss that have one |\n|---|---|---:|---:|");
    for (k, (name, _, verdicts)) in methods.iter().enumerate() {
        let all = tally(k, &|_| true, None);
        for (verdict, count) in &all.others {
            let needless = all.needless[verdict];
            let often = if needless * 20 > all.open { ", more than 5 %" } else { "" };
            let word = if *verdicts { verdict.name() } else { "-" };
            println!("| {name} | {word} | {count} | {}{often} |", format_percent(needless, all.open));
        }
    }
    let names: Vec<&str> = methods.iter().map(|method| method.0).collect();
    println!("\nNumbers with slashes: {}.\n", names.join(" / "));
    println!(
        "| family | records | sought | missed | false | clear | wrong clear | clear kept | error/deviation | error/CRB | ms: median, largest | apart: sought | missed | wrong clear |"
    );
    println!("|---|{}", "---:|".repeat(13));
    let families: BTreeSet<&str> =
        judged.iter().flat_map(|record| &record.families).map(String::as_str).collect();
    for family in std::iter::once("all").chain(families) {
        let holds = |record: &Judged| family == "all" || record.families.iter().any(|of| of == family);
        let tallies: Vec<Tally> =
            (0..methods.len()).map(|k| tally(k, &holds, family.strip_prefix("kind: "))).collect();
        let Some(one) = tallies.first().filter(|t| t.records > 0) else { continue };
        if family.starts_with("pair: ") && one.records < PAIR_RECORDS {
            continue;
        }
        let cells: Vec<[String; 8]> =
            tallies.iter().zip(methods).map(|(t, method)| t.cells(method.2)).collect();
        let join = |of: &dyn Fn(usize) -> String| (0..methods.len()).map(of).collect::<Vec<_>>().join(" / ");
        let columns: Vec<String> = (0..8).map(|column| join(&|k| cells[k][column].clone())).collect();
        let apart = |column: usize| join(&|k| tallies[k].apart[column].to_string());
        println!(
            "| {family} | {} | {} | {} | {} | {} | {} |",
            one.records,
            one.sought,
            columns.join(" | "),
            one.apart[0],
            apart(1),
            apart(2)
        );
    }
}
