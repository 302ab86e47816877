//! Residuals of the traces on standard output, before anything else is said.

use super::summary::shown;
use crate::fit::misfit::{ChannelMisfit, Misfit};
use crate::fit::result::NuisanceResult;
use crate::text;

/// Most segments of a channel that are named.
const MOST_SEGMENTS: usize = 3;

/// The first sentence, residuals against noise, and the misfit over the length of the segments.
pub fn print_misfit(misfit: &Misfit) {
    print_line!("{}", text::ascii(&misfit.sentence()));
    print_line!(
        "{:<24} {:<11} {:>12} {:>10} {:>9} {:>12}",
        "recording",
        "channel",
        "residual, um",
        "noise, um",
        "chi2/dof",
        "neighbours"
    );
    misfit.channels.iter().for_each(print_channel);
    print_line!("");
    print_line!("{:<24} {:>11} {:>12} {:>9}", "segments", "number", "bad ones", "chi2/dof");
    for stage in &misfit.stages {
        let length = format!("of {} ms", shown(1e3 * stage.segment_s));
        let (count, bad, chi2) = (stage.segments, stage.bad_segments, shown(stage.chi2_per_dof));
        print_line!("{length:<24} {count:>11} {bad:>12} {chi2:>9}");
    }
    misfit.channels.iter().for_each(print_worst);
    print_line!("");
}

fn print_channel(c: &ChannelMisfit) {
    print_line!(
        "{:<24} {:<11} {:>12} {:>10} {:>9} {:>12}",
        c.recording,
        c.channel,
        shown(1e6 * c.residual_rms_m),
        shown(1e6 * c.noise_m),
        shown(c.chi2_per_dof),
        c.autocorrelation_1.map_or_else(|| "-".to_owned(), |r| format!("{r:+.2}"))
    );
}

fn print_worst(c: &ChannelMisfit) {
    let segment = |w: &crate::fit::misfit::WorstSegment| {
        format!("{} to {} s (chi2/dof {})", shown(w.start_s), shown(w.end_s), shown(w.chi2_per_dof))
    };
    let named: Vec<String> = c.worst.iter().take(MOST_SEGMENTS).map(segment).collect();
    if !named.is_empty() {
        print_line!("worst in {}, {}: {}", c.recording, c.channel, named.join(", "));
    }
}

/// What was estimated besides the parameters.
pub fn print_nuisances(list: &[NuisanceResult]) {
    if list.is_empty() {
        return;
    }
    print_line!("");
    print_line!(
        "{:<36} {:>11}  {:<25} known beforehand",
        "camera and constants",
        "estimate",
        "95 % interval"
    );
    for n in list {
        let name = n.recording.as_ref().map_or_else(|| n.name.clone(), |of| format!("{of}: {}", n.name));
        let interval = text::interval(n.lower_95, n.upper_95, shown);
        let (prior, sd) = (shown(n.prior), shown(n.prior_sd));
        print_line!("{name:<36} {:>11}  {interval:<25} {prior} +- {sd}", shown(n.estimate));
    }
}
