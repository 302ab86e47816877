//! Writes the `job.toml` of a draft.

use super::CommentedToml;
use super::findings::{DraftComponent, DraftFindings, DraftHead};
use super::{ParameterRole, plan_parameters};
use crate::fit::job::Job;
use crate::fit::measure_targets;
use crate::fit::nuisance_parameters::default_prior_sd;
use crate::model::parameters::find_parameter;
use crate::recording::Recording;
use crate::text::{format_digits, format_percent, format_speed, join_with_and, round_to_digits};

/// Standard deviation of the prior for the tilt of the camera in a first fit, degrees; a tilt of this size is
/// hardly visible.
const TILT_SD_DEG: f64 = 0.3;
/// Relative standard deviation of the prior for the scale, if it was taken from a ruler in the picture.
const SCALE_SD: f64 = 0.005;
/// Standard deviation, m, of the distance between a tracked marker and the point of the blade that it marks.
const OFFSET_SD_M: f64 = 0.002;
/// Standard deviation, s, of the offset between the clocks of the camera and of the stroke, if the head was
/// not tracked.
const CLOCK_SD_S: f64 = 0.005;
/// Writes a job for a recording; `paths` are the paths of recording and scene, relative to the job. The job
/// contains only components that can be measured on the recording.
pub(crate) fn write_job(
    found: &DraftFindings,
    measured: &Recording,
    paths: [&str; 2],
    shoulder: bool,
) -> String {
    let whole = |components: &[DraftComponent], release: bool| {
        let head = add_parameters(write_head(found, paths, shoulder), found, shoulder);
        add_features(add_traces(head, found), found, components, release).into_text()
    };
    let readable = |components: &[DraftComponent], release: bool| {
        let job = Job::parse("job.toml", &whole(components, release));
        job.is_ok_and(|job| measure_targets(&job, &[Some(measured.clone())]).is_ok())
    };
    let components = found.components.iter().filter(|c| readable(std::slice::from_ref(*c), false));
    let components: Vec<DraftComponent> = components.cloned().collect();
    whole(&components, found.shown.is_some() && readable(&[], true))
}

fn write_head(found: &DraftFindings, [recording, scene]: [&str; 2], shoulder: bool) -> CommentedToml {
    let text = CommentedToml::default()
        .add_comment(&format!("Fits the blade of scene.toml to the recording {}:", found.name))
        .add_comment("`wiperlab fit job.toml` in this folder, then `wiperlab report .`.")
        .add_comments(found.synthetic_note());
    let text = found.describe().iter().fold(text.add_comment("Found in the recording:"), |text, words| {
        text.add_comment(&format!("- {words}"))
    });
    let text = text
        .add_line("format = 1")
        .add_text("title", &format!("Fit to {}", found.name))
        .add_text("scene", scene)
        .add_comment("A whole number; the same one gives the same result.")
        .add_line("seed = 1")
        .add_empty_line();
    let constants = add_nuisances(text.add_comment(
        "What is known of the blade, and how well (standard deviations): the fit moves these numbers within it. \
         Make a deviation smaller where you know better, and add `shoulder` and `blade` keys of the scene that \
         you doubt.",
    ), shoulder);
    constants.add_empty_line().add_line("[[recording]]").add_text("path", recording)
}

fn add_nuisances(text: CommentedToml, shoulder: bool) -> CommentedToml {
    let line = |(name, role): (&str, ParameterRole)| match role {
        ParameterRole::Yours | ParameterRole::Guessed => {
            let sd = find_parameter(name).and_then(default_prior_sd)?;
            Some(format!("    {{ name = \"{name}\", sd = \"{}\" }},", format_percent(sd)))
        }
        _ => None,
    };
    let lines = plan_parameters(shoulder).filter_map(line);
    lines.fold(text.add_line("nuisance = ["), |text, line| text.add_line(&line)).add_line("]")
}

fn add_parameters(text: CommentedToml, found: &DraftFindings, shoulder: bool) -> CommentedToml {
    let slowness = 1.0 / found.greatest_speed_m_per_s;
    let mut text = text
        .add_empty_line()
        .add_comment("What is looked for, between two bounds; the search starts in their middle.");
    for (name, role) in plan_parameters(shoulder) {
        let ([lower, upper], why) = match role {
            ParameterRole::Fitted(bounds) => (bounds, None),
            ParameterRole::FittedOverSpeed(bounds) => {
                let (least, most) = (format_digits(bounds[0], 1), format_digits(bounds[1], 2));
                let speed = format_speed(found.greatest_speed_m_per_s);
                let why = format!("{least} and {most} over the greatest speed of the head, {speed}");
                (bounds.map(|bound| round_to_digits(bound * slowness, 2)), Some(why))
            }
            _ => continue,
        };
        text = text
            .add_empty_line()
            .add_comments(why)
            .add_line("[[parameter]]")
            .add_text("name", name)
            .add_numbers(&[("lower", lower), ("upper", upper)])
            .add_text("scale", "log");
    }
    text
}

fn add_traces(text: CommentedToml, found: &DraftFindings) -> CommentedToml {
    let own_head = found.head == DraftHead::Recorded;
    let channels: &[&str] = if found.drop { &["tip-x", "head-drop"] } else { &["tip-x"] };
    let quoted: Vec<String> = channels.iter().map(|name| format!("\"{name}\"")).collect();
    let named: Vec<String> = channels.iter().map(|name| name.replace('-', " ")).collect();
    let mut text = text
        .add_empty_line()
        .add_comment(&format!(
            "Every frame of {} is compared, in short segments; {} drives the model.",
            join_with_and(&named),
            if own_head { "the head of the recording" } else { "the stroke of scene.toml" }
        ))
        .add_line("[[trace]]")
        .add_line(&format!("channels = [{}]", quoted.join(", ")));
    if !own_head {
        text = text.add_text("drive", "scene");
    }
    if let Some([from_s, to_s]) = found.fitted_s {
        text = text
            .add_comment(
                "A part of the recording, so that a first fit ends within minutes; delete it for all of it.",
            )
            .add_text("window", &format!("{from_s}..{to_s}"));
    }
    let text = text
        .add_empty_line()
        .add_comment(
            "The camera: scale, tilt, and how far a marker is from the point that it stands for, the edge of the \
             lip and the upper hinge of the neck.",
        )
        .add_line("[trace.camera]")
        .add_number("scale_sd", SCALE_SD);
    match found.head {
        DraftHead::Recorded => {
            text.add_numbers(&[("tilt_sd_deg", TILT_SD_DEG), ("offset_sd_m", OFFSET_SD_M)])
        }
        DraftHead::Cosine { .. } => text
            .add_comment("How far the clock of the camera is from that of the stroke.")
            .add_numbers(&[("clock_sd_s", CLOCK_SD_S), ("offset_sd_m", OFFSET_SD_M)]),
    }
}

fn add_features(
    mut text: CommentedToml,
    found: &DraftFindings,
    components: &[DraftComponent],
    release: bool,
) -> CommentedToml {
    if !components.is_empty() || release {
        text = text.add_empty_line().add_comment(
            "What the whole run of the fitted model is held against; the fit itself does not look at these.",
        );
    }
    for component in components {
        text = text
            .add_empty_line()
            .add_comment(&component.describe())
            .add_line("[[component]]")
            .add_text("name", component.name)
            .add_text("channel", component.channel.name())
            .add_text("window", &component.window)
            .add_line(&format!("band_hz = [{:?}, {:?}]", component.band_hz[0], component.band_hz[1]));
    }
    if !release {
        return text;
    }
    let text = text
        .add_empty_line()
        .add_comment("How long after the head turns the tip slips again.")
        .add_line("[[feature]]")
        .add_text("name", "release")
        .add_text("kind", "release-after-reversal")
        .add_line("sd_relative = 0.01");
    match found.shown {
        Some(reversal) if reversal > 1 => text.add_line(&format!("reversal = {reversal}")),
        _ => text,
    }
}
