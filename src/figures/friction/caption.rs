//! The friction law of the fitted model, with the speeds at which the tip moved and what is known of it.

use super::{FrictionLine, Law, figure};
use crate::blade::friction::Friction;
use crate::compare::fitted_law::{COEFFICIENTS, Coefficient, half_95, is_free};
use crate::compare::{Case, FrictionPoint, MeasuredFriction};
use crate::figures::{FigureBlock, Words};
use crate::simulate::Sample;
use crate::simulate::mode::Mode;
use crate::text::{digits, listed, percent, speed};

/// Points of the curve, bins of speed.
const POINTS: usize = 200;
const BINS: usize = 30;
/// The curve goes on this far beyond the greatest speed.
const BEYOND: f64 = 1.15;

/// The figure; none for a model that never slips.
pub(crate) fn block(case: &Case) -> Option<FigureBlock> {
    let law = case.model.scene.linkage.friction;
    let slips = slips(case);
    let (Some(slowest), Some(fastest)) = (slips.first(), slips.last()) else { return None };
    let (visited, top) = ((slowest.0, fastest.0), BEYOND * fastest.0);
    let speeds: Vec<f64> = (0..=POINTS).map(|i| top * i as f64 / POINTS as f64).collect();
    let half = half_95(case.job, case.result, &law);
    let measured = MeasuredFriction::of(case);
    let points = |of: &[FrictionPoint]| of.iter().map(|p| (p.speed_m_per_s, p.coefficient)).collect();
    let shown = Law {
        title: claim(&law, fastest.0),
        note: case.note("model at the estimates"),
        synthetic: case.synthetic(),
        curve: speeds.iter().map(|v| (*v, law.dynamic(*v))).collect(),
        visited: Some(visited),
        interval_95: half.as_ref().map_or_else(Vec::new, |half| {
            speeds.iter().map(|v| (*v, law.dynamic(*v) - half(*v), law.dynamic(*v) + half(*v))).collect()
        }),
        truth: truth(case)
            .map_or_else(Vec::new, |law| speeds.iter().map(|v| (*v, law.dynamic(*v))).collect()),
        even: points(&measured.even),
        over_cycles: points(&measured.over_cycles),
        of_model: points(&measured.of_model),
        shares: shares(&slips, top),
        head: Some(head_speed(case)),
    };
    let words = words(case, &law, &slips, half.as_deref(), &measured);
    Some(case.block("friction", words, figure(&shown)))
}

/// The claim with its numbers.
fn claim(law: &Friction, fastest: f64) -> String {
    let (rest, moving) = (law.at_rest(), law.dynamic(fastest));
    let how = if moving < rest { "falls" } else { "goes" };
    format!("Friction {how} from {} at rest to {} at {}", digits(rest, 3), digits(moving, 3), speed(fastest))
}

/// The law of a synthetic blade; `None` where the recording does not say it.
fn truth(case: &Case) -> Option<Friction> {
    let twin = case.measured.and_then(|m| m.file).and_then(|file| file.twin.as_ref())?;
    let known = twin.get("truth").and_then(toml::Value::as_table)?;
    let [a, b_s_per_m, c] = COEFFICIENTS.map(|c| known.get(c.name).and_then(toml::Value::as_float));
    Some(Friction { a: a?, b_s_per_m: b_s_per_m?, c: c? })
}

/// Speeds of the tip where it slips, with the coefficients there, the slowest first.
fn slips(case: &Case) -> Vec<(f64, f64)> {
    let samples = case.model.motion.samples.iter().filter(|s| is_slip(s));
    let mut slips: Vec<(f64, f64)> =
        samples.map(|s| (s.tip_velocity_m_per_s.abs(), coefficient(s))).collect();
    slips.sort_by(|a, b| a.0.total_cmp(&b.0));
    slips
}

/// Friction at rest and at the greatest speed of the tip.
pub(crate) fn lines(case: &Case) -> Vec<FrictionLine> {
    let law = case.model.scene.linkage.friction;
    let half = half_95(case.job, case.result, &law);
    let speeds = std::iter::once(0.0).chain(slips(case).last().map(|(fastest, _)| *fastest));
    let line = |speed_m_per_s: f64| FrictionLine {
        speed_m_per_s,
        coefficient: law.dynamic(speed_m_per_s),
        half_95: half.as_ref().map(|half| half(speed_m_per_s)),
    };
    speeds.map(line).collect()
}

fn is_slip(sample: &Sample) -> bool {
    matches!(sample.mode, Mode::SlipForward | Mode::SlipBackward) && sample.normal_n > 0.0
}

fn coefficient(sample: &Sample) -> f64 {
    sample.friction_n.abs() / sample.normal_n
}

/// Share of the time of slip in each bin; the states are equally far apart in time.
fn shares(slips: &[(f64, f64)], top: f64) -> Vec<(f64, f64, f64)> {
    let below = |v: f64| slips.partition_point(|s| s.0 < v) as f64;
    let edge = |i: usize| top * i as f64 / BINS as f64;
    (0..BINS)
        .map(|i| (edge(i), edge(i + 1), (below(edge(i + 1)) - below(edge(i))) / slips.len() as f64))
        .collect()
}

/// Mean of `|v|` of the head over the run, m/s.
fn head_speed(case: &Case) -> f64 {
    let samples = &case.model.motion.samples;
    samples.iter().map(|s| case.model.scene.drive.at(s.time_s).velocity_m_per_s.abs()).sum::<f64>()
        / samples.len().max(1) as f64
}

fn words(
    case: &Case,
    law: &Friction,
    slips: &[(f64, f64)],
    half: Option<&(dyn Fn(f64) -> f64 + '_)>,
    measured: &MeasuredFriction,
) -> Words {
    let fastest = slips.last().map_or(0.0, |s| s.0);
    let (median, head) = (slips.get(slips.len() / 2).map_or(0.0, |s| s.0), head_speed(case));
    let slower = slips.partition_point(|s| s.0 < head) as f64 / slips.len().max(1) as f64;
    let mut said = vec![format!(
        "Friction law of the model at the estimates, \u{b5} = A exp(\u{2212}B|v|) + C with A = {}, B = {} \
         s/m, C = {}: from {} at rest to {} at {}, the greatest \
         speed of the tip.",
        digits(law.a, 3),
        digits(law.b_s_per_m, 3),
        digits(law.c, 3),
        digits(law.at_rest(), 3),
        digits(law.dynamic(fastest), 3),
        speed(fastest),
    )];
    said.extend(points_in_words(case, law, measured));
    said.push(format!(
        "Below: the time of slip at each speed; half of it is slower than {}, {} of it slower than the head \
         on average ({}).",
        speed(median),
        percent(slower),
        speed(head)
    ));
    said.push(known(case, median, half));
    let even = apart(law, &measured.even).map_or_else(String::new, |(count, off)| {
        format!("; {count} points measured where the tip slides evenly lie within {} of it", digits(off, 2))
    });
    let caption = format!("{} in the law of the fitted model{even}.", claim(law, fastest));
    Words { caption, details: said.join(" ") + &case.sharing() }
}

/// How many points there are, and by how much the one farthest from the law is off.
fn apart(law: &Friction, points: &[FrictionPoint]) -> Option<(usize, f64)> {
    let off = |p: &FrictionPoint| (p.coefficient - law.dynamic(p.speed_m_per_s)).abs();
    points.iter().map(off).reduce(f64::max).map(|most| (points.len(), most))
}

/// What the points are, and why some of them are not on the law.
fn points_in_words(case: &Case, law: &Friction, measured: &MeasuredFriction) -> Option<String> {
    case.recording()?;
    let even = apart(law, &measured.even).map_or_else(
        || "The recorded tip nowhere slides evenly.".to_owned(),
        |(count, off)| {
            format!(
                "Full circles ({count}): where the recorded tip slides evenly its deflection gives the friction, as \
                 the blade is in equilibrium there; stiffnesses and preload are the model's. The farthest is {} off \
                 the law.",
                digits(off, 2)
            )
        },
    );
    let cycles = if measured.over_cycles.is_empty() {
        ""
    } else {
        " Hollow circles: means over cycles of stick and slip, which lie off the law as sticking counts in them; \
         crosses are the model's, read in the same way."
    };
    Some(format!("{even}{cycles}"))
}

/// What the fit knows of the law.
fn known(case: &Case, at: f64, half: Option<&(dyn Fn(f64) -> f64 + '_)>) -> String {
    let (free, held): (Vec<_>, Vec<_>) = COEFFICIENTS.iter().partition(|c| is_free(case.job, c));
    let symbols = |of: &[&Coefficient]| listed(&of.iter().map(|c| c.symbol.to_owned()).collect::<Vec<_>>());
    let taken = if held.is_empty() {
        String::new()
    } else {
        format!(" {} taken as known.", is_or_are(&symbols(&held), held.len()))
    };
    match half {
        _ if free.is_empty() => "A, B and C were not fitted.".to_owned(),
        Some(half) => format!(
            "Shaded: 95 %, propagated from the intervals of {}{}, \u{b1}{} at rest and \u{b1}{} at {}.{taken}",
            symbols(&free),
            if free.len() > 1 { " with their correlations" } else { "" },
            digits(half(0.0), 2),
            digits(half(at), 2),
            speed(at)
        ),
        None => {
            let open: Vec<_> = free
                .iter()
                .filter(|c| case.result.parameters.get(c.name).is_none_or(|p| !p.has_interval()))
                .copied()
                .collect();
            // the linear model may know each of them, and yet not how they go together
            let which = if open.is_empty() { symbols(&free) } else { symbols(&open) };
            let separately = if open.is_empty() { "" } else { " separately" };
            format!(
                "The data do not fix {which}{separately}, so the law has no interval here: other values meet \
                 the same targets.{taken}"
            )
        }
    }
}

fn is_or_are(symbols: &str, count: usize) -> String {
    format!("{symbols} {}", if count == 1 { "is" } else { "are" })
}
