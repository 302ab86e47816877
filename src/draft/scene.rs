//! Writes the `scene.toml` of a draft.

use super::findings::{DraftFindings, DraftHead};
use super::stroke::Stroke;
use super::{CommentedToml, ParameterRole, plan_parameters};
use crate::fit::nuisance_parameters::default_prior_sd;
use crate::fit::result::{FitResult, NuisanceResult};
use crate::model::friction::FrictionShape;
use crate::model::parameters;
use crate::model::parameters::{ModelParameter, SAME_LENGTH_ADVICE};
use crate::simulate::drive::Drive;
use crate::simulate::scene::error::SceneError;
use crate::simulate::scene::{Scene, StartKind};
use crate::text::{capitalise, format_digits, format_interval, format_percent, make_printable};

/// The bundled scene whose blade every draft uses.
const EXAMPLE_SCENE: &str = include_str!("../../data/scenes/actual-blade.toml");
/// Marks a number that only the user knows.
pub(crate) const YOURS_MARK: &str = "YOURS";
/// Output rate of a run without a camera, 1/s.
const SAMPLE_RATE_HZ: f64 = 10_000.0;
/// Stroke of a scene without a recording: the head moves at up to 0.5 m/s, and reverses once within
/// `DEFAULT_RUN_S`.
const DEFAULT_STROKE: Stroke = Stroke { amplitude_m: 0.1, frequency_hz: 0.8, delay_s: 0.0 };
const DEFAULT_RUN_S: [f64; 2] = [0.4, 1.0];

/// Writes a scene for a recording; `recording` is its path relative to the scene.
///
/// # Errors
/// [`SceneError`] if the bundled example cannot be read.
pub(crate) fn write_scene(
    found: &DraftFindings,
    recording: &str,
    shoulder: bool,
) -> Result<String, SceneError> {
    let title =
        format!("The blade of the recording {}, for `wiperlab simulate` and for job.toml.", found.name);
    let head = CommentedToml::default().add_comment(&title).add_comments(found.synthetic_note());
    let example = write_blade(head, shoulder)?.add_empty_line();
    let drive = match found.head {
        DraftHead::Recorded => example
            .add_comment("The head moves as in the recording. Any other scene may use it too.")
            .add_line("[drive]")
            .add_text("recording", recording),
        DraftHead::Cosine { stroke, .. } => add_cosine_drive(example, stroke),
    };
    let rate_hz = found.frame_rate_hz.max(SAMPLE_RATE_HZ);
    Ok(add_run(drive, RECORDED_START, found.run_s, rate_hz).into_text())
}

/// Writes a scene without a recording.
///
/// # Errors
/// [`SceneError`] if the bundled example cannot be read.
pub(crate) fn write_scene_alone(shoulder: bool) -> Result<String, SceneError> {
    let head =
        CommentedToml::default().add_comment("A blade, its friction and its drive, for `wiperlab simulate`.");
    let drive = add_cosine_drive(write_blade(head, shoulder)?.add_empty_line(), DEFAULT_STROKE);
    Ok(add_run(drive, STEADY_START, DEFAULT_RUN_S, SAMPLE_RATE_HZ).into_text())
}

/// Adds the title, the blade, the shoulder and the friction.
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
        let (how, what) = (capitalise(row.quantity.measurement_method()), capitalise(row.meaning));
        let mark = if role == ParameterRole::Yours { format!("{YOURS_MARK}: ") } else { String::new() };
        text = text.add_comment(&format!("{mark}{what}{unit}. {how}. {}.", describe_role(row, role)));
        text = text.add_number(key, example.value(name).unwrap_or_default());
    }
    Ok(text)
}

fn describe_role(parameter: &ModelParameter, role: ParameterRole) -> String {
    let known = || format_percent(default_prior_sd(parameter).unwrap_or_default());
    match role {
        ParameterRole::Yours => format!("The fit takes it as good to {}", known()),
        ParameterRole::Guessed => {
            format!("The fit takes it as good to {}, as nobody knows it well", known())
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
        .add_numbers(&[("amplitude_m", stroke.amplitude_m), ("frequency_hz", stroke.frequency_hz)]);
    if stroke.delay_s == 0.0 { text } else { text.add_number("delay_s", stroke.delay_s) }
}

/// Comment and kind of the start in a scene with a recording. It is not steady, because a blade with the
/// user's numbers may be unable to slip steadily at the first frame.
const RECORDED_START: [&str; 2] =
    ["The run starts with the blade upright; a fit starts from the states in the recording.", "upright"];
/// Comment and kind of the start in a scene without a recording.
const STEADY_START: [&str; 2] =
    ["The run starts where the tip slides evenly, in the equilibrium of that speed.", "steady-slide"];

pub(super) fn add_run(
    text: CommentedToml,
    [comment, kind]: [&str; 2],
    [start_s, stop_s]: [f64; 2],
    rate_hz: f64,
) -> CommentedToml {
    text.add_empty_line()
        .add_comment(comment)
        .add_line("[start]")
        .add_number("time_s", start_s)
        .add_text("kind", kind)
        .add_table("run")
        .add_numbers(&[("stop_s", stop_s), ("sample_rate_hz", rate_hz), ("relative_tolerance", 1e-8)])
        .add_line("outputs = [\"trace\", \"events\"]")
}

// The scene of a fit, with the estimates of its parameters.

/// Names of the tables of numbers, in the order of a scene.
const TABLES: [&str; 4] = ["blade", "slider", "shoulder", "friction"];
/// Number of significant digits of a prior and of the ends of an interval.
const DIGITS: usize = 4;

/// A scene with the estimates of a fit, and its provenance.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FittedScene<'a> {
    /// The scene that the fit simulated.
    pub scene: &'a Scene,
    /// Name of the operating condition of the scene.
    pub condition: &'a str,
    /// Index of the condition, and thus of its recording, in the job.
    pub index: usize,
    /// Whether the recording of the condition is synthetic; `None` if there are only published numbers.
    pub synthetic: Option<bool>,
    /// Path of the recording that drives the scene, relative to the file of the scene; `None` if none drives
    /// it.
    pub recording: Option<&'a str>,
    /// The result with the estimates.
    pub result: &'a FitResult,
}

/// Writes the scene of a fit at its estimates, with their intervals as comments; `None` if a scene file
/// cannot express it, for example a start in the air.
pub(crate) fn write_fitted_scene(fitted: &FittedScene<'_>) -> Option<String> {
    let FittedScene { scene, condition, index, synthetic, recording, result } = *fitted;
    let of = match synthetic {
        Some(true) => "fitted to a synthetic recording, which no camera took",
        Some(false) => "fitted to a recording",
        None => "fitted to published numbers",
    };
    let mut head = CommentedToml::default().add_comment(&format!(
        "The scene of a fit at its estimates, {of}, for `wiperlab simulate` and for studies. The fit: {}; its \
         condition: {condition}. Written by `wiperlab fit`, and written anew by the next.",
        result.title
    ));
    if !result.explains_recordings() {
        head =
            head.add_comment("The model does not explain the recording: the numbers are those of no blade.");
    }
    let title = format!("{} ({condition})", make_printable(&result.title));
    write_scene_toml(head, &title, scene, recording, |name| describe_estimate(result, index, name))
}

/// Describes the estimate of a number in a condition with its interval.
fn describe_estimate(result: &FitResult, index: usize, name: &str) -> Option<String> {
    let ends = |lower, upper| format_interval(lower, upper, |end| format_digits(end, DIGITS));
    let is_own = |free: &str| parameters::name_if_in_recording(free, index) == Some(name);
    if let Some((_, found)) = result.parameters.iter().find(|(free, _)| is_own(free)) {
        let verdict = found.verdict.name();
        return Some(format!("fitted, {verdict}; 95 %: {}", ends(found.lower_95, found.upper_95)));
    }
    let of_scene = |nuisance: &&NuisanceResult| nuisance.recording.is_none() && nuisance.name == name;
    let constant = result.nuisances.iter().find(of_scene)?;
    let (prior, sd) = (format_digits(constant.prior?, DIGITS), format_digits(constant.prior_sd?, 2));
    Some(format!(
        "freed around {prior} with standard deviation {sd}; 95 %: {}",
        ends(constant.lower_95, constant.upper_95)
    ))
}

/// Writes a scene as a file that is read back unchanged; `None` if a file cannot express its drive or its
/// start.
fn write_scene_toml(
    head: CommentedToml,
    title: &str,
    scene: &Scene,
    recording: Option<&str>,
    note: impl Fn(&str) -> Option<String>,
) -> Option<String> {
    let mut text = head.add_line("format = 1").add_text("title", title);
    for table in TABLES {
        let of_table =
            scene.written_values().filter_map(|(name, value)| Some((name.split_once('.')?, name, value)));
        let rows: Vec<_> = of_table.filter(|((of, _), ..)| *of == table).collect();
        if !rows.is_empty() || table == "friction" {
            text = text.add_table(table);
        }
        if table == "friction" {
            text = add_law(text, &scene.linkage.friction.shape);
        }
        for ((_, key), name, value) in rows {
            text = text.add_comments(note(name)).add_number(key, value);
        }
    }
    text = add_drive(text.add_table("drive"), scene, recording, &note)?;
    if !scene.linkage.is_slider() {
        text = text.add_table("contact").add_word("loss", scene.loss).add_word("jam", scene.jam);
    }
    if let Some((_, restitution)) = scene.written_values().find(|(name, _)| *name == "contact.restitution") {
        text = text.add_number("restitution", restitution);
    }
    text = add_start(text.add_table("start").add_number("time_s", scene.start_s), scene)?;
    let run = &scene.run;
    text = text.add_table("run").add_numbers(&[
        ("stop_s", run.stop_s),
        ("sample_rate_hz", run.sample_rate_hz),
        ("relative_tolerance", run.relative_tolerance),
    ]);
    if let Some(most) = run.most_evaluations {
        text = text.add_line(&format!("most_evaluations = {most}"));
    }
    Some(text.add_word("outputs", &run.outputs).into_text())
}

/// Adds the name of the friction law, unless it is the default, and the points of a table.
fn add_law(text: CommentedToml, law: &FrictionShape) -> CommentedToml {
    let text = match law {
        FrictionShape::Exponential => return text,
        _ => text.add_text("law", law.name()),
    };
    let FrictionShape::Table(table) = law else { return text };
    let (speeds, coefficients): (Vec<f64>, Vec<f64>) = table.points().unzip();
    let text = text.add_line(&format!("speeds_m_per_s = {speeds:?}"));
    text.add_line(&format!("coefficients = {coefficients:?}"))
}

fn add_drive(
    text: CommentedToml,
    scene: &Scene,
    recording: Option<&str>,
    note: impl Fn(&str) -> Option<String>,
) -> Option<CommentedToml> {
    match &scene.drive {
        Drive::Recorded(_) => Some(text.add_text("recording", recording?)),
        Drive::Uniform { speed_m_per_s } => Some(text.add_number("speed_m_per_s", *speed_m_per_s)),
        Drive::Cosine { amplitude_m, frequency_hz, delay_s } => {
            let text = text
                .add_comments(note("drive.amplitude_m"))
                .add_number("amplitude_m", *amplitude_m)
                .add_comments(note("drive.frequency_hz"))
                .add_number("frequency_hz", *frequency_hz);
            Some(if *delay_s == 0.0 { text } else { text.add_number("delay_s", *delay_s) })
        }
    }
}

fn add_start(text: CommentedToml, scene: &Scene) -> Option<CommentedToml> {
    match scene.start {
        StartKind::Upright | StartKind::State(_) if scene.linkage.is_slider() => {
            add_slider_start(text, scene.slider_state()?)
        }
        StartKind::Upright => Some(text.add_text("kind", "upright")),
        StartKind::SteadySlide => Some(text.add_text("kind", "steady-slide")),
        StartKind::State(pose) => Some(text.add_text("kind", "state").add_numbers(&[
            ("neck_angle_rad", pose.theta),
            ("lip_angle_rad", pose.phi),
            ("neck_rate_rad_per_s", pose.theta_rate),
            ("lip_rate_rad_per_s", pose.phi_rate),
        ])),
        StartKind::Slider { deflection_m, tip_velocity_m_per_s } => {
            add_slider_start(text, [deflection_m, tip_velocity_m_per_s])
        }
        StartKind::Airborne(_) => None,
    }
}

/// Adds the deflection of a slider, m, and its velocity, m/s.
fn add_slider_start(
    text: CommentedToml,
    [deflection_m, velocity_m_per_s]: [f64; 2],
) -> Option<CommentedToml> {
    Some(
        text.add_text("kind", "state")
            .add_numbers(&[("deflection_m", deflection_m), ("tip_velocity_m_per_s", velocity_m_per_s)]),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENES: [&str; 4] = [
        include_str!("../../data/scenes/actual-blade.toml"),
        include_str!("../../data/scenes/light-blade-from-rest.toml"),
        include_str!("../../data/scenes/light-blade-strokes.toml"),
        include_str!("../../data/scenes/published-experiment.toml"),
    ];

    fn reads_back(scene: &Scene) {
        let text = write_scene_toml(CommentedToml::default(), scene.title(), scene, None, |_| None).unwrap();
        let again = Scene::parse("scene", &text).unwrap();
        assert_eq!(&again, scene, "{text}");
    }

    #[test]
    fn a_scene_reads_back_as_the_same() {
        for text in SCENES {
            let scene = Scene::parse("scene", text).unwrap();
            reads_back(&scene);
            // a number that needs all its digits, and a parameter that the scene states by another quantity
            let moved = scene.with_parameter("friction.a", 0.1 + 0.2).unwrap();
            reads_back(&moved.with_parameter("blade.neck_natural_frequency_hz", 1000.0 / 3.0).unwrap());
        }
    }

    #[test]
    fn a_scene_reads_back_with_its_friction_law() {
        for law in [
            "a = 0.1\nb_s_per_m = 5.0\nc = 0.3\nstatic_ratio = 1.25\nviscous_s_per_m = 0.1\nbackward_ratio = 0.9",
            "law = \"stribeck\"\nlimit_at_zero = 0.4\ncoulomb_level = 0.3\nstribeck_speed_m_per_s = 0.2\n\
             stribeck_exponent = 1.5",
            "law = \"rational\"\nlimit_at_zero = 0.4\nrational_s_per_m = 3",
            "law = \"table\"\nspeeds_m_per_s = [0, 0.1, 1.5]\ncoefficients = [0.4, 0.3, 0.35]",
        ] {
            let (head, rest) = SCENES[0].split_once("[friction]").unwrap();
            let (_, rest) = rest.split_once("\n[").unwrap();
            reads_back(&Scene::parse("scene", &format!("{head}[friction]\n{law}\n[{rest}")).unwrap());
        }
    }

    #[test]
    fn start_contact_and_limits_are_kept() {
        let text = SCENES[0]
            .replacen("kind = \"steady-slide\"", "kind = \"state\"\nneck_angle_rad = 0.1\nlip_angle_rad = 1e-17\nneck_rate_rad_per_s = -3.0\nlip_rate_rad_per_s = 0.0", 1)
            .replacen("frequency_hz = 0.749", "frequency_hz = 0.749\ndelay_s = -0.25", 1)
            + "most_evaluations = 123456\n[contact]\nloss = \"fly\"\njam = \"impact\"\nrestitution = 0.25\n";
        let scene = Scene::parse("scene", &text).unwrap();
        assert!(matches!(scene.start, StartKind::State(_)) && scene.drive.delay_s() == -0.25);
        reads_back(&scene);
    }
}
