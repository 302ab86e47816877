//! What is read from hard records, beside what other methods read.

use crate::hard::{KINDS, Kind, Made, Truth};
use crate::score::{deviation, rms};
use rayon::prelude::*;
use wiperlab::spectrum::{Analysis, Component, Record, Settings, Verdict};

/// What a method says of a record.
pub struct Listed {
    pub hz: f64,
    pub sd_hz: f64,
    pub clear: bool,
    pub range_hz: Option<(f64, f64)>,
}

/// Counts over the records of a kind.
#[derive(Default)]
struct Counts {
    missed: usize,
    sought: usize,
    /// Records with a component called clear that is none.
    wrong: usize,
    /// Components listed that are none, whatever is said of them.
    others: usize,
    over_bound: Vec<f64>,
    scaled: Vec<f64>,
    left_out: usize,
}

/// Within so many hertz a component is this oscillation.
fn near_hz(truth: &Truth, made: &Made) -> f64 {
    let frames = made.samples.len();
    let resolution_hz = made.rate_hz / frames as f64;
    let width_hz = truth.decay_per_s / std::f64::consts::TAU;
    (0.35 * resolution_hz).max(0.5 * width_hz).max(5.0 * truth.bound_hz(frames, made.rate_hz, made.noise_m))
}

pub fn hard(seeds: u64, only: Option<&str>) {
    println!("\n## Hard records\n");
    println!("| {:<42} | missed | of | wrong | others | rms/CRB | scaled | cut |", "record");
    println!("|{}|-------:|---:|------:|-------:|--------:|-------:|----:|", "-".repeat(44));
    for kind in
        KINDS.iter().filter(|kind| only.is_none_or(|only| kind.group == only || kind.name.contains(only)))
    {
        let c = counts(kind, seeds);
        println!(
            "| {:<42} | {:>6} | {:>2} | {:>5} | {:>6} | {:>7.2} | {:>6.2} | {:>3} |",
            kind.name,
            c.missed,
            c.sought,
            c.wrong,
            c.others,
            rms(&c.over_bound),
            deviation(&c.scaled),
            c.left_out
        );
    }
}

fn counts(kind: &Kind, seeds: u64) -> Counts {
    let one = |seed: u64| {
        let made = kind.made(seed);
        let record = Record { samples: &made.samples, frame_rate_hz: made.rate_hz, exposure_s: None };
        let analysis = Analysis::of(&record, &Settings::default()).ok();
        let left_out = analysis.as_ref().map_or(0, |a| a.left_out);
        let listed: Vec<Listed> = analysis.iter().flat_map(|a| &a.spectrum.components).map(listed).collect();
        if std::env::var_os("SHOW").is_some() {
            eprintln!(
                "{} {seed} cut {left_out} {}",
                kind.name,
                analysis.as_ref().map_or(String::new(), |a| a.removed.to_string())
            );
            for truth in &made.truths {
                eprintln!("   true {:.2} Hz {:.1}/s from {:.4}", truth.hz, truth.decay_per_s, truth.from_s);
            }
            if let Some(r) = analysis.as_ref().and_then(|a| a.ridge.as_ref()) {
                let mut left: Vec<f64> = r.points.iter().map(|p| p.left).collect();
                left.sort_by(f64::total_cmp);
                let mut amp: Vec<f64> = r.points.iter().map(|p| p.amplitude_m).collect();
                amp.sort_by(f64::total_cmp);
                if !left.is_empty() {
                    eprintln!(
                        "   LEFT {} median {:.3} max {:.3} amp {:.2}..{:.2} of median n {}",
                        analysis.as_ref().unwrap().spectrum.components.iter().any(|c| c.range_hz.is_some()),
                        left[left.len() / 2],
                        left[left.len() - 1],
                        amp[0] / amp[amp.len() / 2],
                        amp[amp.len() - 1] / amp[amp.len() / 2],
                        amp.len()
                    );
                }
            }
            for c in analysis.iter().flat_map(|a| &a.spectrum.components) {
                eprintln!(
                    "   {:.3} +- {:.3} Hz {:.2e} m zeta {:?} {:?} {:?} {:?}",
                    c.frequency_hz,
                    c.frequency_sd_hz,
                    c.amplitude_m,
                    c.damping_ratio,
                    c.range_hz,
                    c.verdict,
                    c.reasons.iter().map(|r| &r.words).collect::<Vec<_>>()
                );
            }
        }
        (made, listed, left_out)
    };
    let read: Vec<_> = (0..seeds).into_par_iter().map(one).collect();
    let mut counts = Counts::default();
    for (made, listed, left_out) in &read {
        counts.left_out += usize::from(*left_out > 0);
        count(&mut counts, made, listed);
    }
    counts
}

fn listed(c: &Component) -> Listed {
    Listed {
        hz: c.frequency_hz,
        sd_hz: c.frequency_sd_hz,
        clear: c.verdict == Verdict::Clear,
        range_hz: c.range_hz.map(|range| (range.low_hz, range.high_hz)),
    }
}

fn count(counts: &mut Counts, made: &Made, listed: &[Listed]) {
    let mut taken = vec![false; listed.len()];
    for truth in &made.truths {
        let nearest = (0..listed.len())
            .filter(|k| !taken[*k] && listed[*k].range_hz.is_none())
            .min_by(|a, b| (listed[*a].hz - truth.hz).abs().total_cmp(&(listed[*b].hz - truth.hz).abs()))
            .filter(|k| (listed[*k].hz - truth.hz).abs() < near_hz(truth, made));
        counts.sought += usize::from(truth.sought);
        let Some(k) = nearest else {
            counts.missed += usize::from(truth.sought);
            continue;
        };
        taken[k] = true;
        let error_hz = listed[k].hz - truth.hz;
        if truth.sought {
            counts.over_bound.push(error_hz / truth.bound_hz(made.samples.len(), made.rate_hz, made.noise_m));
            counts.scaled.push(error_hz / listed[k].sd_hz);
        }
        if !truth.own && listed[k].clear {
            taken[k] = false;
        }
    }
    let none: Vec<&Listed> =
        listed.iter().zip(&taken).filter(|(_, taken)| !**taken).map(|(l, _)| l).collect();
    counts.others += none.len();
    counts.wrong += usize::from(none.iter().any(|l| l.clear));
}
