//! scene.toml of a draft.

use super::commented::CommentedToml;
use super::found::{DraftFindings, DraftHead};
use super::plan::{ParameterRole, plan_parameters};
use super::stroke::Stroke;
use crate::blade::measuring::SAME_LENGTH_ADVICE;
use crate::blade::parameters;
use crate::simulate::scene::{Scene, SceneError};
use crate::text::{capitalise, format_percent};

/// The blade of every draft.
const EXAMPLE_SCENE: &str = include_str!("../../data/scenes/actual-blade.toml");
/// How a number is marked that only the user knows.
pub const YOURS_MARK: &str = "YOURS";
/// Frames a second of the output of a run where no camera gives a rate, 1/s.
const SAMPLE_RATE_HZ: f64 = 10_000.0;
/// The stroke of a scene alone: a head that moves half a metre a second at most, and its first reversal.
const DEFAULT_STROKE: Stroke = Stroke { amplitude_m: 0.1, frequency_hz: 0.8, delay_s: 0.0 };
const DEFAULT_RUN_S: [f64; 2] = [0.4, 1.0];

/// A scene for a recording; `recording` is its path as seen from the scene.
///
/// # Errors
/// [`SceneError`] if the bundled example cannot be read.
pub fn write_scene(found: &DraftFindings, recording: &str, shoulder: bool) -> Result<String, SceneError> {
    let head = CommentedToml::default()
        .add_comment(&format!(
            "The blade of the recording {}, for `wiperlab simulate` and for job.toml.",
            found.name
        ))
        .add_comments(found.synthetic_note());
    let example = write_blade(head, shoulder)?.add_empty_line();
    let drive = match found.head {
        DraftHead::Recorded => example
            .add_comment("The head moves as in the recording. Any other scene may use it too.")
            .add_line("[drive]")
            .add_text("recording", recording),
        DraftHead::Cosine { stroke, .. } => add_cosine_drive(example, stroke),
    };
    let rate_hz = found.frame_rate_hz.max(SAMPLE_RATE_HZ);
    Ok(add_run(drive, found.run_s, rate_hz).into_text())
}

/// A scene without any recording.
///
/// # Errors
/// [`SceneError`] if the bundled example cannot be read.
pub fn write_scene_alone(shoulder: bool) -> Result<String, SceneError> {
    let head =
        CommentedToml::default().add_comment("A blade, its friction and its drive, for `wiperlab simulate`.");
    let drive = add_cosine_drive(write_blade(head, shoulder)?.add_empty_line(), DEFAULT_STROKE);
    Ok(add_run(drive, DEFAULT_RUN_S, SAMPLE_RATE_HZ).into_text())
}

/// Title, blade, shoulder and friction.
fn write_blade(head: CommentedToml, shoulder: bool) -> Result<CommentedToml, SceneError> {
    let example = Scene::parse("the bundled example", EXAMPLE_SCENE)?;
    let mut text = head
        .add_comment(&format!(
            "All numbers of the blade are those of an example, which is no measured blade. Replace those marked \
             {YOURS_MARK}; the others are found by the fit, or freed within what is said."
        ))
        .add_comment(SAME_LENGTH_ADVICE)
        .add_line("format = 1")
        .add_text("title", "My blade");
    let mut table = "";
    for (name, role) in plan_parameters(shoulder) {
        let (Some((of, key)), Some(row)) = (name.split_once('.'), parameters::find_parameter(name)) else {
            continue;
        };
        if of != table {
            table = of;
            text = text.add_empty_line();
            text = match of {
                "shoulder" => text.add_comment(
                    "The neck meets a shoulder beyond an angle and is stiffer from there on. (For a blade without \
                     one: `wiperlab init --no-shoulder`.)",
                ),
                "friction" => text.add_comment("Between lip and glass: mu = a exp(-b |speed|) + c."),
                _ => text,
            };
            text = text.add_line(&format!("[{of}]"));
        }
        let unit = if row.unit == "1" { String::new() } else { format!(", {}", row.unit) };
        let how = capitalise(row.quantity.measurement_method());
        text = text.add_comment(&format!(
            "{}{}{unit}. {how}. {}.",
            role_marker(role),
            capitalise(row.meaning),
            describe_role(role)
        ));
        text = text.add_number(key, example.value(name).unwrap_or_default());
    }
    Ok(text)
}

fn role_marker(role: ParameterRole) -> String {
    if let ParameterRole::Yours(_) = role { format!("{YOURS_MARK}: ") } else { String::new() }
}

fn describe_role(role: ParameterRole) -> String {
    match role {
        ParameterRole::Yours(None) => "The fit holds it".to_owned(),
        ParameterRole::Yours(Some(sd)) => format!("The fit takes it as good to {}", format_percent(sd)),
        ParameterRole::Guessed(sd) => {
            format!("The fit takes it as good to {}, as nobody knows it well", format_percent(sd))
        }
        ParameterRole::Fitted(_) | ParameterRole::FittedOverSpeed(_) => {
            "The fit finds it between wide bounds".to_owned()
        }
    }
}

fn add_cosine_drive(text: CommentedToml, stroke: Stroke) -> CommentedToml {
    let text = text
        .add_comment(&format!(
            "{YOURS_MARK}: the head moves as amplitude_m (1 - cos(2 pi frequency_hz (time - delay_s))): it turns at \
             delay_s and after every half period. A fit needs the numbers of the rig."
        ))
        .add_line("[drive]")
        .add_number("amplitude_m", stroke.amplitude_m)
        .add_number("frequency_hz", stroke.frequency_hz);
    if stroke.delay_s == 0.0 { text } else { text.add_number("delay_s", stroke.delay_s) }
}

fn add_run(text: CommentedToml, [start_s, stop_s]: [f64; 2], rate_hz: f64) -> CommentedToml {
    text.add_empty_line()
        .add_comment("The run starts where the tip slides evenly, in the equilibrium of that speed.")
        .add_line("[start]")
        .add_number("time_s", start_s)
        .add_text("kind", "steady-slide")
        .add_empty_line()
        .add_line("[run]")
        .add_number("stop_s", stop_s)
        .add_number("sample_rate_hz", rate_hz)
        .add_number("relative_tolerance", 1e-8)
        .add_line("outputs = [\"trace\", \"events\"]")
}
