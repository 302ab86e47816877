//! Writes the first scene and the first job for a recording of a slider.

use super::CommentedToml;
use super::findings::{DraftError, DraftFindings, DraftHead};
use super::scene::add_run;
use crate::fit::nuisance_parameters::default_prior_sd;
use crate::model::parameters::{damping_from_ratio, find_parameter};
use crate::recording::Recording;
use crate::text::{format_percent, round_to_digits};

/// Numbers of a slider that the user gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct KnownSlider {
    pub mass_kg: f64,
    pub normal_force_n: f64,
}

/// Friction coefficient of the first scene, and the bounds of the search. Coefficients of dry solids are 0.1
/// to 1.
const FRICTION: f64 = 0.3;
const FRICTION_BOUNDS: [f64; 2] = [0.03, 1.5];
/// The bounds of the stiffness are the first guess divided by this factor and multiplied by it.
const STIFFNESS_FACTOR: f64 = 8.0;
/// Largest damping ratio of the spring that a search tries.
const MAX_DAMPING_RATIO: f64 = 0.2;
/// Standard deviation, m, of the difference between the zeros of the sensors of slider and head.
const OFFSET_SD_M: f64 = 0.002;

impl KnownSlider {
    /// First guess of the stiffness, N/m. At the deflection that a tenth of the frames exceed, the force of
    /// the spring is equal to friction.
    fn guess_stiffness(self, recording: &Recording) -> Option<f64> {
        let traces = recording.traces();
        let points = traces.tip_x_m.iter().zip(&traces.head_x_m);
        let mut deflections: Vec<f64> =
            points.filter_map(|(tip, head)| Some(((*tip)? - (*head)?).abs())).collect();
        deflections.sort_by(f64::total_cmp);
        let usual_m = *deflections.get(9 * deflections.len() / 10)?;
        Some(round_to_digits(FRICTION * self.normal_force_n / usual_m, 2))
            .filter(|k| k.is_finite() && *k > 0.0)
    }

    /// The scene and the job for a recording; `path` is that of the recording, relative to both, and `scene`
    /// that of the scene, relative to the job.
    ///
    /// # Errors
    /// [`DraftError`] if the head was not tracked or does not move relative to the slider.
    pub(crate) fn write_files(
        self,
        found: &DraftFindings,
        recording: &Recording,
        [path, scene]: [&str; 2],
    ) -> Result<[String; 2], DraftError> {
        let stiffness = self.guess_stiffness(recording).filter(|_| found.head == DraftHead::Recorded);
        let stiffness = stiffness.ok_or_else(|| {
            let why = "found no head that moves relative to the slider, expected the positions of slider and head; track the other end of the spring as the head";
            DraftError::new(why)
        })?;
        let damping = damping_from_ratio(MAX_DAMPING_RATIO, stiffness, self.mass_kg);
        let job = write_job(found, [path, scene], stiffness, damping);
        Ok([self.write_scene(found, path, stiffness), job])
    }

    fn write_scene(self, found: &DraftFindings, recording: &str, stiffness: f64) -> String {
        let how = |key: &str| {
            let row = find_parameter(&format!("slider.{key}"));
            row.map(|row| format!("{}, {}: {}.", row.meaning, row.unit, row.quantity.measurement_method()))
        };
        let text = CommentedToml::default()
            .add_comment(&format!(
                "The slider of the recording {}, for `wiperlab simulate` and for job.toml.",
                found.name
            ))
            .add_comments(found.synthetic_note())
            .add_line("format = 1")
            .add_text("title", "My slider")
            .add_empty_line()
            .add_line("[slider]")
            .add_comments(how("mass_kg"))
            .add_number("mass_kg", self.mass_kg)
            .add_comments(how("normal_force_n"))
            .add_number("normal_force_n", self.normal_force_n)
            .add_comments(how("stiffness_n_per_m"))
            .add_comment(
                "A first guess from the deflections in the recording. The fit searches between wide bounds.",
            )
            .add_number("stiffness_n_per_m", stiffness)
            .add_comments(how("damping_n_s_per_m"))
            .add_comment("The fit searches between zero and a damping ratio of about a fifth.")
            .add_number("damping_n_s_per_m", 0.0)
            .add_empty_line()
            .add_comment(
                "Between slider and surface: mu = a exp(-b |speed|) + c. Here mu is the same at all speeds.",
            )
            .add_line("[friction]")
            .add_numbers(&[("a", 0.0), ("b_s_per_m", 0.0), ("c", FRICTION)])
            .add_empty_line()
            .add_comment("The head moves as in the recording.")
            .add_line("[drive]")
            .add_text("recording", recording);
        let start = [
            "The run starts with the spring relaxed; a fit starts from the states in the recording.",
            "relaxed",
        ];
        add_run(text, start, found.run_s, found.frame_rate_hz).into_text()
    }
}

fn write_job(
    found: &DraftFindings,
    [recording, scene]: [&str; 2],
    stiffness: f64,
    most_damping: f64,
) -> String {
    let text = CommentedToml::default()
        .add_comment(&format!("Fits the slider of scene.toml to the recording {}:", found.name))
        .add_comment("`wiperlab fit job.toml` in this folder, then `wiperlab report .`.")
        .add_comments(found.synthetic_note())
        .add_line("format = 1")
        .add_text("title", &format!("Fit to {}", found.name))
        .add_text("scene", scene)
        .add_comment("A whole number; the same one gives the same result.")
        .add_line("seed = 1")
        .add_empty_line()
        .add_comment("Standard deviations of the mass and the normal force, which the fit moves within them.")
        .add_line("nuisance = [");
    let text = ["slider.mass_kg", "slider.normal_force_n"].into_iter().fold(text, |text, name| {
        let sd = find_parameter(name).and_then(default_prior_sd).map(format_percent).unwrap_or_default();
        text.add_line(&format!("    {{ name = \"{name}\", sd = \"{sd}\" }},"))
    });
    let bounds = [
        ("friction.c", FRICTION_BOUNDS, "log"),
        ("slider.stiffness_n_per_m", [stiffness / STIFFNESS_FACTOR, stiffness * STIFFNESS_FACTOR], "log"),
        ("slider.damping_n_s_per_m", [0.0, most_damping], "linear"),
    ];
    let text = text.add_line("]").add_empty_line().add_line("[[recording]]").add_text("path", recording);
    let text = bounds.into_iter().fold(text, |text, (name, [lower, upper], scale)| {
        let [lower, upper] = [lower, upper].map(|bound| round_to_digits(bound, 2));
        text.add_empty_line()
            .add_line("[[parameter]]")
            .add_text("name", name)
            .add_numbers(&[("lower", lower), ("upper", upper)])
            .add_text("scale", scale)
    });
    text.add_empty_line()
        .add_comment("Every frame of tip x is compared, in short segments; the head of the recording drives the model.")
        .add_line("[[trace]]")
        .add_line("channels = [\"tip-x\"]")
        .add_empty_line()
        .add_comment("Standard deviation of the difference between the zeros of the sensors of slider and head.")
        .add_line("[trace.camera]")
        .add_number("offset_sd_m", OFFSET_SD_M)
        .into_text()
}
