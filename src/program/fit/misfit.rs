//! Residuals of the traces on standard output, before anything else is said.

use super::summary::format_value;
use crate::fit::misfit::{ChannelMisfit, TraceMisfit};
use crate::fit::result::NuisanceResult;
use crate::text;

/// Most segments of a channel that are named.
const MOST_SEGMENTS: usize = 3;

/// The first sentence, residuals against noise, and the misfit over the length of the segments.
pub fn print_misfit(misfit: &TraceMisfit) {
    print_line!("{}", text::to_ascii(&misfit.headline()));
    print_line!(
        "{:<24} {:<11} {:>12} {:>10} {:>9} {:>12}",
        "recording",
        "channel",
        "residual, um",
        "noise, um",
        "chi2/dof",
        "neighbours"
    );
    misfit.channels.iter().for_each(print_channel_misfit);
    print_line!("");
    print_line!("{:<24} {:>11} {:>12} {:>9}", "segments", "number", "bad ones", "chi2/dof");
    for stage in &misfit.stages {
        let length = format!("of {} ms", format_value(1e3 * stage.segment_s));
        let (count, bad, chi2) = (stage.segments, stage.bad_segments, format_value(stage.chi2_per_dof));
        print_line!("{length:<24} {count:>11} {bad:>12} {chi2:>9}");
    }
    misfit.channels.iter().for_each(print_worst_segments);
    print_line!("");
}

fn print_channel_misfit(c: &ChannelMisfit) {
    print_line!(
        "{:<24} {:<11} {:>12} {:>10} {:>9} {:>12}",
        c.recording,
        c.channel,
        format_value(1e6 * c.residual_rms_m),
        format_value(1e6 * c.noise_m),
        format_value(c.chi2_per_dof),
        c.autocorrelation_1.map_or_else(|| "-".to_owned(), |r| format!("{r:+.2}"))
    );
}

fn print_worst_segments(c: &ChannelMisfit) {
    let segment = |w: &crate::fit::misfit::WorstSegment| {
        format!(
            "{} to {} s (chi2/dof {})",
            format_value(w.start_s),
            format_value(w.end_s),
            format_value(w.chi2_per_dof)
        )
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
        let interval = text::format_interval(n.lower_95, n.upper_95, format_value);
        let (prior, sd) = (format_value(n.prior), format_value(n.prior_sd));
        print_line!("{name:<36} {:>11}  {interval:<25} {prior} +- {sd}", format_value(n.estimate));
    }
}
