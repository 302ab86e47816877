//! Scenes: a blade or a slider, its friction, its drive and the settings of a run, read from `scene.toml` and
//! validated.

mod as_written;
pub mod contact;
pub mod error;
mod linkage;
mod numbers;
mod run;

pub use super::drive::Drive;
use super::drive::{HeadSpline, UNCERTAIN_END_S, even_motion_start_s, smooth_head_motion};
use crate::model::Linkage;
use crate::model::friction::FrictionShape;
use crate::model::modes::time_scales_rad_per_s;
use crate::model::parameters::{self, ModelParameter, PARAMETERS, ParameterQuantity};
use crate::model::plausibility::{self, PlausibilityFinding};
use crate::recording::Recording;
use crate::simulate::scene::contact::{ContactLossRule, JamRule};
use crate::simulate::scene::error::{SceneError, key_error};
use crate::toml_file;
use as_written::SceneFile;
use linkage::{build_linkage, linkage_constants};
use numbers::{
    SceneReader, check_complete, check_law_key, check_range, find_known_parameter, of_other_mechanism,
};
use run::foreign_key;
pub use run::{MOST_EVALUATIONS, RunSettings, StartKind, check_tolerance};
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A validated scene. Its serialised form contains exactly the data that determine a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scene {
    #[serde(skip)]
    file: String,
    #[serde(skip)]
    title: String,
    values: BTreeMap<&'static str, f64>,
    has_shoulder: bool,
    /// What the run does when contact is lost.
    pub loss: ContactLossRule,
    /// What the run does at the Painlevé paradox.
    pub jam: JamRule,
    /// Motion of the head.
    pub drive: Drive,
    /// Start of the run, s.
    pub start_s: f64,
    /// State at the start of the run.
    pub start: StartKind,
    /// End, tolerance and outputs of the run.
    pub run: RunSettings,
    /// Blade, friction and shoulder.
    pub linkage: Linkage,
}

impl Scene {
    /// Reads and validates a scene that needs no other file; `file` is the name of the scene in error
    /// messages.
    ///
    /// # Errors
    /// [`SceneError`] with file, line, key, finding and advice; also for a scene with `drive.recording`,
    /// which needs [`Self::parse_with_recording`].
    pub fn parse(file: &str, text: &str) -> Result<Self, SceneError> {
        Self::parse_with_recording(file, text, |path| {
            Err(format!(
                "found \"{path}\", expected amplitude_m and frequency_hz: recordings are not at hand here"
            ))
        })
    }

    /// Reads and validates a scene. `recording` loads the file that `drive.recording` names, or returns the
    /// reason why it cannot.
    ///
    /// # Errors
    /// [`SceneError`] with file, line, key, finding and advice.
    pub fn parse_with_recording(
        file: &str,
        text: &str,
        recording: impl FnOnce(&str) -> Result<Recording, String>,
    ) -> Result<Self, SceneError> {
        let scene = Self::parse_any_start(file, text, recording)?;
        scene.check_start()?;
        Ok(scene)
    }

    fn check_start(&self) -> Result<(), SceneError> {
        run::check_steady_start(&self.file, self.start_s, self.start, &self.linkage, &self.drive)
    }

    /// The same scene. If it starts in steady slip that does not exist, its blade starts upright.
    pub(crate) fn with_possible_start(mut self) -> Self {
        if self.check_start().is_err() {
            self.start = StartKind::Upright;
        }
        self
    }

    /// Like [`Self::parse_with_recording`], but accepts a start in steady slip that does not exist.
    ///
    /// # Errors
    /// As [`Self::parse_with_recording`].
    pub(crate) fn parse_any_start(
        file: &str,
        text: &str,
        recording: impl FnOnce(&str) -> Result<Recording, String>,
    ) -> Result<Self, SceneError> {
        let written: SceneFile = toml_file::parse_toml(file, text)?;
        toml_file::check_format(file, written.format)?;
        let mut reader = SceneReader { file, text, values: BTreeMap::new() };
        let is_slider = written.slider.is_some();
        let tables_of_blade = [("blade", written.blade.is_some()), ("shoulder", written.shoulder.is_some())];
        let tables_of_blade = tables_of_blade.into_iter().chain([("contact", written.contact.is_some())]);
        if let Some((table, _)) = tables_of_blade.into_iter().find(|(_, given)| is_slider && *given) {
            return Err(foreign_key(file, table, is_slider));
        }
        if !is_slider && written.blade.is_none() {
            let advice = "add the table of the blade, or of a slider";
            return Err(key_error(file, "blade", "nothing", "[blade] or [slider]", advice));
        }
        reader.read_table("blade", written.blade.unwrap_or_default())?;
        reader.read_table("slider", written.slider.unwrap_or_default())?;
        let has_shoulder = written.shoulder.is_some();
        reader.read_table("shoulder", written.shoulder.unwrap_or_default())?;
        let contact = written.contact.unwrap_or_default();
        let law = reader.read_friction(written.friction)?;
        let recorded = reader.read_drive(&written.drive)?;
        let delay_s = reader.read_delay_s(&written.drive)?;
        reader.read_number("contact.restitution", contact.restitution)?;
        let values = reader.values;
        check_complete(file, &values, [is_slider, has_shoulder, recorded.is_some()], &law)?;
        let (start_s, start) = run::check_start(file, &written.start, is_slider)?;
        let run = run::check_run(file, &written.run, start_s)?;
        let linkage = build_linkage(file, &values, has_shoulder, law)?;
        run::check_work_limit(file, &run, start_s, time_scales_rad_per_s(&linkage).1)?;
        let drive = match recorded {
            Some((place, path)) => recorded_drive(&place, recording(&path), [start_s, run.stop_s])?,
            None => written_drive(&values, delay_s),
        };
        Ok(Self {
            file: file.to_owned(),
            title: written.title,
            values,
            has_shoulder,
            loss: contact.loss,
            jam: contact.jam,
            drive,
            start_s,
            start,
            run,
            linkage,
        })
    }

    /// JSON Schema of scene.toml, for editors and messages.
    #[must_use]
    pub fn schema() -> serde_json::Value {
        toml_file::schema_of::<SceneFile>()
    }

    /// Title of the scene.
    #[must_use]
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Energetic coefficient of restitution of the tip on the glass, 0 to 1.
    pub(crate) fn restitution(&self) -> f64 {
        self.values.get("contact.restitution").copied().unwrap_or(0.0)
    }

    /// The same scene with one parameter set; if the scene gives the same quantity by an equivalent
    /// parameter, that parameter is removed.
    ///
    /// # Errors
    /// [`SceneError::Key`] for an unknown name or a value out of range.
    pub fn with_parameter(&self, name: &str, value: f64) -> Result<Self, SceneError> {
        let parameter = self.find_own_parameter(name)?;
        check_range(&self.file, parameter, value)?;
        let mut scene = self.clone();
        scene.values = self.values_with(parameter, value);
        scene.linkage =
            build_linkage(&self.file, &scene.values, self.has_shoulder, self.linkage.friction.shape)?;
        if !matches!(self.drive, Drive::Recorded(_)) {
            scene.drive = written_drive(&scene.values, self.drive.delay_s());
        }
        Ok(scene)
    }

    /// The same scene with a shoulder that the neck meets at an angle, rad, and that adds `stiffness_ratio`
    /// times the stiffness of the neck.
    ///
    /// # Errors
    /// [`SceneError::Key`] for a value out of range.
    pub(crate) fn with_shoulder(&self, angle_rad: f64, stiffness_ratio: f64) -> Result<Self, SceneError> {
        let scene = Self { has_shoulder: true, ..self.clone() };
        let scene = scene.with_parameter("shoulder.contact_angle_rad", angle_rad)?;
        scene.with_parameter("shoulder.stiffness_ratio", stiffness_ratio)
    }

    /// The same scene with another law of friction, whose own parameters come near the present law.
    ///
    /// # Errors
    /// [`SceneError::Key`] if the law does not accept one of these values.
    pub(crate) fn with_friction_shape(&self, shape: FrictionShape) -> Result<Self, SceneError> {
        let mut scene = self.clone();
        let old = &self.linkage.friction;
        scene.values.retain(|name, _| !old.shape.own_parameters().contains(name));
        let own = shape.own_parameters().iter();
        scene.values.extend(own.filter_map(|name| Some((*name, old.nearest_value(name)?))));
        scene.linkage = build_linkage(&self.file, &scene.values, self.has_shoulder, shape)?;
        Ok(scene)
    }

    /// The same scene, driven by the head of a recording. The run covers the tracked time except for its
    /// uncertain ends; a start in steady slip waits until the head moves.
    ///
    /// # Errors
    /// [`SceneError`] if the head is tracked too briefly or steady slip is impossible.
    pub fn drive_by_recording(&self, recording: &Recording) -> Result<Self, SceneError> {
        let motion = read_head_motion(&self.file, recording)?;
        let [first_s, last_s] = motion.span_s();
        let start_s = match self.start {
            StartKind::SteadySlide => even_motion_start_s(&motion),
            _ => first_s + UNCERTAIN_END_S,
        };
        let stop_s = last_s - UNCERTAIN_END_S;
        if start_s >= stop_s {
            let problem = format!(
                "found the head's motion of `{}` from {first_s} s to {last_s} s, expected one that goes on for more than {} s after the head moves; film more of the stroke",
                recording.name(),
                2.0 * UNCERTAIN_END_S
            );
            return Err(SceneError::Recording { place: self.file.clone(), problem });
        }
        let mut scene = self.clone();
        scene.values.retain(|name, _| !name.starts_with("drive."));
        (scene.start_s, scene.run.stop_s) = (start_s, stop_s);
        scene.drive = Drive::Recorded(Arc::new(motion));
        scene.check_start()?;
        Ok(scene)
    }

    /// The linkage with one parameter set to any value, for finite differences; the value is not checked.
    pub(super) fn linkage_with(&self, parameter: &ModelParameter, value: f64) -> Linkage {
        let law = self.linkage.friction.shape;
        linkage_constants(&self.values_with(parameter, value), self.has_shoulder, law)
    }

    fn values_with(&self, parameter: &ModelParameter, value: f64) -> BTreeMap<&'static str, f64> {
        let mut values = self.values.clone();
        let same = PARAMETERS.iter().filter(|p| p.quantity == parameter.quantity);
        same.for_each(|other| _ = values.remove(other.name));
        values.insert(parameter.name, value);
        values
    }

    /// Finds a parameter that this scene has.
    ///
    /// # Errors
    /// [`SceneError::Key`] for an unknown name or a parameter of an absent part.
    pub(super) fn find_own_parameter(&self, name: &str) -> Result<&'static ModelParameter, SceneError> {
        let parameter = find_known_parameter(&self.file, name)?;
        let law = &self.linkage.friction.shape;
        check_law_key(&self.file, name, law)?;
        let (table, is_slider) = (name.split('.').next().unwrap_or_default(), self.linkage.is_slider());
        if of_other_mechanism(table, is_slider) {
            return Err(self.foreign_key(name));
        }
        let is_speed = parameter.quantity == ParameterQuantity::DriveSpeed;
        let (found, expected, advice) = match (table, &self.drive) {
            ("shoulder", _) if !self.has_shoulder => {
                ("no [shoulder]", "a scene with a shoulder", "add a [shoulder] table to the scene")
            }
            ("drive", Drive::Recorded(_)) => {
                ("a recorded drive", "a scene whose `[drive]` has this key", "leave the parameter out")
            }
            ("drive", Drive::Cosine { .. }) if is_speed => (
                "a head that moves as a cosine",
                "a scene with drive.speed_m_per_s",
                "leave the parameter out",
            ),
            ("drive", Drive::Uniform { .. }) if !is_speed => (
                "a head of constant speed",
                "a scene whose head moves as a cosine",
                "leave the parameter out",
            ),
            _ => return Ok(parameter),
        };
        Err(key_error(&self.file, name, found, expected, advice))
    }

    /// At the start, the position of a slider minus that of its head, m, and its velocity, m/s.
    pub(crate) fn slider_state(&self) -> Option<[f64; 2]> {
        let (pose, head) = (super::initial_pose(self)?, self.drive.motion_at(self.start_s));
        let arm_m = self.linkage.l2_m;
        Some([arm_m * pose.phi, arm_m * pose.phi_rate + head.velocity_m_per_s])
    }

    /// Error of a key that belongs to a blade in the scene of a slider, or the reverse.
    pub(super) fn foreign_key(&self, key: &str) -> SceneError {
        foreign_key(&self.file, key, self.linkage.is_slider())
    }

    /// Names and values of all parameters that the scene file gives, under the names that the file uses.
    pub fn written_values(&self) -> impl Iterator<Item = (&'static str, f64)> {
        self.values.iter().map(|(name, value)| (*name, *value))
    }

    /// Implausible numbers of the scene.
    #[must_use]
    pub fn find_implausible(&self) -> Vec<PlausibilityFinding> {
        let written = |name| find_written_key(&self.values, name);
        plausibility::find_implausible(plausibility::SCENE_RANGES, &|name| self.value(name), &written)
    }

    /// Value of a parameter in its SI unit, converted if the scene gives the same quantity by an equivalent
    /// parameter; `None` for a part that the scene lacks.
    #[must_use]
    pub fn value(&self, name: &str) -> Option<f64> {
        self.values.get(name).copied().or_else(|| parameters::convert_value(name, &self.linkage))
    }
}

/// The key under which a scene gives the quantity of the parameter `name`.
fn find_written_key(values: &BTreeMap<&'static str, f64>, name: &'static str) -> &'static str {
    let quantity = parameters::find_parameter(name).map(|p| p.quantity);
    let mut ways = PARAMETERS.iter().filter(|p| Some(p.quantity) == quantity).map(|p| p.name);
    ways.find(|way| values.contains_key(way)).unwrap_or(name)
}

/// Motion of a head that is not recorded.
fn written_drive(values: &BTreeMap<&'static str, f64>, delay_s: f64) -> Drive {
    if let Some(&speed_m_per_s) = values.get("drive.speed_m_per_s") {
        return Drive::Uniform { speed_m_per_s };
    }
    let number = |name: &str| values.get(name).copied().unwrap_or(0.0); // completeness was checked
    let (amplitude_m, frequency_hz) = (number("drive.amplitude_m"), number("drive.frequency_hz"));
    Drive::Cosine { amplitude_m, frequency_hz, delay_s }
}

/// Motion of a recorded head; refuses a run outside the tracked time.
fn recorded_drive(
    place: &str,
    recording: Result<Recording, String>,
    [start_s, stop_s]: [f64; 2],
) -> Result<Drive, SceneError> {
    let unread = |problem| SceneError::Recording { place: place.to_owned(), problem };
    let recording = recording.map_err(unread)?;
    let motion = read_head_motion(place, &recording)?;
    let [first_s, last_s] = motion.span_s();
    if motion.covers(start_s, stop_s) {
        return Ok(Drive::Recorded(Arc::new(motion)));
    }
    let found = format!("a run from {start_s} s to {stop_s} s");
    let expected =
        format!("one within the {first_s} s to {last_s} s in which `{}` tracks the head", recording.name());
    let advice = "change start.time_s and run.stop_s, or take another recording";
    Err(key_error(place, "drive.recording", found, &expected, advice))
}

fn read_head_motion(place: &str, recording: &Recording) -> Result<HeadSpline, SceneError> {
    smooth_head_motion(recording)
        .map_err(|problem| SceneError::Recording { place: place.to_owned(), problem: problem.to_string() })
}
