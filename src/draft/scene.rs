//! scene.toml of a draft.

use super::commented::Commented;
use super::found::{Found, Head};
use super::plan::{Role, plan};
use super::stroke::Stroke;
use crate::blade::measuring::SAME_LENGTH;
use crate::blade::parameters;
use crate::simulate::scene::{Scene, SceneError};
use crate::text::{capitalised, percent};

/// The blade of every draft.
const EXAMPLE: &str = include_str!("../../data/scenes/actual-blade.toml");
/// How a number is marked that only the user knows.
pub const YOURS: &str = "YOURS";
/// Frames a second of the output of a run where no camera gives a rate, 1/s.
const SAMPLE_RATE_HZ: f64 = 10_000.0;
/// The stroke of a scene alone: a head that moves half a metre a second at most, and its first reversal.
const ALONE: Stroke = Stroke { amplitude_m: 0.1, frequency_hz: 0.8, delay_s: 0.0 };
const ALONE_S: [f64; 2] = [0.4, 1.0];

/// A scene for a recording; `recording` is its path as seen from the scene.
///
/// # Errors
/// [`SceneError`] if the bundled example cannot be read.
pub fn scene(found: &Found, recording: &str, shoulder: bool) -> Result<String, SceneError> {
    let head = Commented::default()
        .comment(&format!(
            "The blade of the recording {}, for `wiperlab simulate` and for job.toml.",
            found.name
        ))
        .comments(found.origin());
    let example = blade(head, shoulder)?.gap();
    let drive = match found.head {
        Head::Recorded => example
            .comment("The head moves as in the recording. Any other scene may use it too.")
            .line("[drive]")
            .text("recording", recording),
        Head::Cosine { stroke, .. } => cosine(example, stroke),
    };
    let rate_hz = found.frame_rate_hz.max(SAMPLE_RATE_HZ);
    Ok(run(drive, found.run_s, rate_hz).end())
}

/// A scene without any recording.
///
/// # Errors
/// [`SceneError`] if the bundled example cannot be read.
pub fn scene_alone(shoulder: bool) -> Result<String, SceneError> {
    let head = Commented::default().comment("A blade, its friction and its drive, for `wiperlab simulate`.");
    let drive = cosine(blade(head, shoulder)?.gap(), ALONE);
    Ok(run(drive, ALONE_S, SAMPLE_RATE_HZ).end())
}

/// Title, blade, shoulder and friction.
fn blade(head: Commented, shoulder: bool) -> Result<Commented, SceneError> {
    let example = Scene::parse("the bundled example", EXAMPLE)?;
    let mut text = head
        .comment(&format!(
            "All numbers of the blade are those of an example, which is no measured blade. Replace those marked \
             {YOURS}; the others are found by the fit, or freed within what is said."
        ))
        .comment(SAME_LENGTH)
        .line("format = 1")
        .text("title", "My blade");
    let mut table = "";
    for (name, role) in plan(shoulder) {
        let (Some((of, key)), Some(row)) = (name.split_once('.'), parameters::find(name)) else { continue };
        if of != table {
            table = of;
            text = text.gap();
            text = match of {
                "shoulder" => text.comment(
                    "The neck meets a shoulder beyond an angle and is stiffer from there on. (For a blade without \
                     one: `wiperlab init --no-shoulder`.)",
                ),
                "friction" => text.comment("Between lip and glass: mu = a exp(-b |speed|) + c."),
                _ => text,
            };
            text = text.line(&format!("[{of}]"));
        }
        let unit = if row.unit == "1" { String::new() } else { format!(", {}", row.unit) };
        let how = capitalised(row.quantity.how_measured());
        text = text.comment(&format!(
            "{}{}{unit}. {how}. {}.",
            marked(role),
            capitalised(row.meaning),
            of_role(role)
        ));
        text = text.number(key, example.value(name).unwrap_or_default());
    }
    Ok(text)
}

fn marked(role: Role) -> String {
    if let Role::Yours(_) = role { format!("{YOURS}: ") } else { String::new() }
}

fn of_role(role: Role) -> String {
    match role {
        Role::Yours(None) => "The fit holds it".to_owned(),
        Role::Yours(Some(sd)) => format!("The fit takes it as good to {}", percent(sd)),
        Role::Guessed(sd) => format!("The fit takes it as good to {}, as nobody knows it well", percent(sd)),
        Role::Fitted(_) | Role::FittedOverSpeed(_) => "The fit finds it between wide bounds".to_owned(),
    }
}

fn cosine(text: Commented, stroke: Stroke) -> Commented {
    let text = text
        .comment(&format!(
            "{YOURS}: the head moves as amplitude_m (1 - cos(2 pi frequency_hz (time - delay_s))): it turns at \
             delay_s and after every half period. A fit needs the numbers of the rig."
        ))
        .line("[drive]")
        .number("amplitude_m", stroke.amplitude_m)
        .number("frequency_hz", stroke.frequency_hz);
    if stroke.delay_s == 0.0 { text } else { text.number("delay_s", stroke.delay_s) }
}

fn run(text: Commented, [start_s, stop_s]: [f64; 2], rate_hz: f64) -> Commented {
    text.gap()
        .comment("The run starts where the tip slides evenly, in the equilibrium of that speed.")
        .line("[start]")
        .number("time_s", start_s)
        .text("kind", "steady-slide")
        .gap()
        .line("[run]")
        .number("stop_s", stop_s)
        .number("sample_rate_hz", rate_hz)
        .number("relative_tolerance", 1e-8)
        .line("outputs = [\"trace\", \"events\"]")
}
