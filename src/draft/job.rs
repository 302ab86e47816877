//! job.toml of a draft.

use super::commented::Commented;
use super::found::{Found, FoundComponent, Head};
use super::plan::{Role, plan};
use crate::fit::job::Job;
use crate::fit::targets;
use crate::recording::Recording;
use crate::text::{digits, listed, percent, rounded, speed};

/// Standard deviations of the camera that a first fit assumes: a tilt that nobody sees, a scale from a ruler
/// in the picture, markers that stand within two millimetres of what they are for.
const TILT_SD_DEG: f64 = 0.3;
const SCALE_SD: f64 = 0.005;
const OFFSET_SD_M: f64 = 0.002;
/// Of a clock that was set by the tip's own turn, and of an origin anywhere in a picture.
const CLOCK_SD_S: f64 = 0.005;
const ORIGIN_SD_M: f64 = 0.1;

/// A job for a recording; `paths` are those of recording and scene as seen from the job. Of the components,
/// those that a fit reads in the recording.
#[must_use]
pub fn job(found: &Found, measured: &Recording, paths: [&str; 2], shoulder: bool) -> String {
    let whole = |components: &[FoundComponent], release: bool| {
        features(
            traces(parameters(head(found, paths, shoulder), found, shoulder), found),
            found,
            components,
            release,
        )
        .end()
    };
    let readable = |components: &[FoundComponent], release: bool| {
        let job = Job::parse("job.toml", &whole(components, release));
        job.is_ok_and(|job| targets(&job, &[Some(measured.clone())]).is_ok())
    };
    let components = found.components.iter().filter(|c| readable(std::slice::from_ref(*c), false));
    let components: Vec<FoundComponent> = components.cloned().collect();
    whole(&components, found.shown.is_some() && readable(&[], true))
}

fn head(found: &Found, [recording, scene]: [&str; 2], shoulder: bool) -> Commented {
    let text = Commented::default()
        .comment(&format!("Fits the blade of scene.toml to the recording {}:", found.name))
        .comment("`wiperlab fit job.toml` in this folder, then `wiperlab report .`.")
        .comments(found.origin());
    let text = found
        .words()
        .iter()
        .fold(text.comment("Found in the recording:"), |text, words| text.comment(&format!("- {words}")));
    let text = text.line("format = 1").text("title", &format!("Fit to {}", found.name)).text("scene", scene);
    let text = text.comment("A whole number; the same one gives the same result.").line("seed = 1").gap();
    let constants = constants(text.comment(
        "What is known of the blade, and how well (standard deviations): the fit moves these numbers within it. \
         Make a deviation smaller where you know better, and add `shoulder` and `blade` keys of the scene that \
         you doubt.",
    ), shoulder);
    constants.gap().line("[[recording]]").text("path", recording)
}

fn constants(text: Commented, shoulder: bool) -> Commented {
    let line = |(name, role): (&str, Role)| match role {
        Role::Yours(Some(sd)) | Role::Guessed(sd) => {
            Some(format!("    {{ name = \"{name}\", sd = \"{}\" }},", percent(sd)))
        }
        _ => None,
    };
    let lines = plan(shoulder).filter_map(line);
    lines.fold(text.line("nuisance = ["), |text, line| text.line(&line)).line("]")
}

fn parameters(text: Commented, found: &Found, shoulder: bool) -> Commented {
    let slowness = 1.0 / found.greatest_speed_m_per_s;
    let mut text =
        text.gap().comment("What is looked for, between two bounds; the search starts in their middle.");
    for (name, role) in plan(shoulder) {
        let ([lower, upper], why) = match role {
            Role::Fitted(bounds) => (bounds, String::new()),
            Role::FittedOverSpeed([least, most]) => (
                [rounded(least * slowness, 2), rounded(most * slowness, 2)],
                format!(
                    "{} and {} over the greatest speed of the head, {}",
                    digits(least, 1),
                    digits(most, 2),
                    speed(found.greatest_speed_m_per_s)
                ),
            ),
            _ => continue,
        };
        text = text.gap();
        if !why.is_empty() {
            text = text.comment(&why);
        }
        text = text.line("[[parameter]]").text("name", name).number("lower", lower).number("upper", upper);
        text = text.text("scale", "log");
    }
    text
}

fn traces(text: Commented, found: &Found) -> Commented {
    let own_head = found.head == Head::Recorded;
    let channels: &[&str] = if found.drop { &["tip-x", "head-drop"] } else { &["tip-x"] };
    let quoted: Vec<String> = channels.iter().map(|name| format!("\"{name}\"")).collect();
    let named: Vec<String> = channels.iter().map(|name| name.replace('-', " ")).collect();
    let mut text = text
        .gap()
        .comment(&format!(
            "Every frame of {} is compared, in short segments; {} drives the model.",
            listed(&named),
            if own_head { "the head of the recording" } else { "the stroke of scene.toml" }
        ))
        .line("[[trace]]")
        .line(&format!("channels = [{}]", quoted.join(", ")));
    if !own_head {
        text = text.text("drive", "scene");
    }
    if let Some([from_s, to_s]) = found.fitted_s {
        text = text
            .comment(
                "A part of the recording, so that a first fit ends within minutes; delete it for all of it.",
            )
            .text("window", &format!("{from_s}..{to_s}"));
    }
    let text = text
        .gap()
        .comment(
            "The camera: scale, tilt, and how far a marker is from the point that it stands for, the edge of the \
             lip and the upper hinge of the neck.",
        )
        .line("[trace.camera]")
        .number("scale_sd", SCALE_SD);
    match found.head {
        Head::Recorded => text.number("tilt_sd_deg", TILT_SD_DEG).number("offset_sd_m", OFFSET_SD_M),
        Head::Cosine { origin_m, .. } => beside_a_stroke(text, origin_m),
    }
}

/// The camera beside a stroke that nobody filmed: its clock and its origin are its own.
fn beside_a_stroke(text: Commented, origin_m: f64) -> Commented {
    let text = text.comment("How far the clock of the camera is from that of the stroke.");
    let text = text.number("clock_sd_s", CLOCK_SD_S);
    if origin_m.abs() < OFFSET_SD_M {
        return text.number("offset_sd_m", OFFSET_SD_M);
    }
    text.comment("The origin of the picture is not where the stroke starts.")
        .number("offset_sd_m", ORIGIN_SD_M)
}

fn features(text: Commented, found: &Found, components: &[FoundComponent], release: bool) -> Commented {
    let mut text = text;
    if !components.is_empty() || release {
        text = text.gap().comment(
            "What the whole run of the fitted model is held against; the fit itself does not look at these.",
        );
    }
    for component in components {
        text = text
            .gap()
            .comment(&component.words())
            .line("[[component]]")
            .text("name", component.name)
            .text("channel", component.channel.name())
            .text("window", &component.window)
            .line(&format!("band_hz = [{:?}, {:?}]", component.band_hz[0], component.band_hz[1]));
    }
    if !release {
        return text;
    }
    let text = text
        .gap()
        .comment("How long after the head turns the tip slips again.")
        .line("[[feature]]")
        .text("name", "release")
        .text("kind", "release-after-reversal")
        .line("sd_relative = 0.01");
    match found.shown {
        Some(reversal) if reversal > 1 => text.line(&format!("reversal = {reversal}")),
        _ => text,
    }
}
