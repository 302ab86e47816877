//! Tables and types of scene.toml as written; the values are checked later.

use super::contact::{ContactLossRule, JamRule, OutputTable};
use crate::model::friction::LAW_KEYS;
use crate::model::parameters::{PARAMETERS, ParameterRange};
use crate::toml_file::table_schema;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::Deserialize;
use serde_json::json;
use std::collections::BTreeMap;
use toml::Spanned;

pub(super) type SceneNumbers = BTreeMap<String, Spanned<f64>>;
/// Values of `[friction]`: numbers, the name of the law, and the points of a table.
pub(super) type FrictionValues = BTreeMap<String, Spanned<toml::Value>>;

/// A blade or a slider, its friction, the motion of its head, and the run to compute.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "scene.toml")]
pub(crate) struct SceneFile {
    /// Version of the format: 1.
    pub(super) format: u32,
    /// Title for pages and figures.
    pub(super) title: String,
    /// Masses, lengths, stiffnesses and dampings, all for one length of blade; needed without `[slider]`.
    #[schemars(schema_with = "blade")]
    #[serde(default)]
    pub(super) blade: Option<SceneNumbers>,
    /// A slider in place of a blade: a mass on a spring, which rubs on a surface.
    #[schemars(schema_with = "slider")]
    #[serde(default)]
    pub(super) slider: Option<SceneNumbers>,
    /// Shoulder that stiffens the neck beyond an angle; left out for a blade without a shoulder.
    #[schemars(schema_with = "shoulder")]
    #[serde(default)]
    pub(super) shoulder: Option<SceneNumbers>,
    /// Coefficient of friction of the lip or slider: `A exp(-B |v|) + C`, or another law.
    #[schemars(schema_with = "friction")]
    pub(super) friction: FrictionValues,
    /// Motion of the head: a cosine, a constant speed, or the motion in a recording.
    pub(super) drive: DriveFile,
    /// What happens when contact is lost or the tip jams.
    #[serde(default)]
    pub(super) contact: Option<ContactFile>,
    /// Start of the run: its time and the state of the blade or slider.
    #[serde(default)]
    pub(super) start: StartFile,
    /// How long the simulation runs, and which tables it writes.
    pub(super) run: RunFile,
}

/// Motion of the head: `recording`, `speed_m_per_s`, or both `amplitude_m` and `frequency_hz`.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct DriveFile {
    /// Half the stroke of the head, m; the head moves as
    /// `amplitude_m (1 - cos(2 pi frequency_hz (t - delay_s)))`.
    #[schemars(with = "Option<f64>")]
    pub(super) amplitude_m: Option<Spanned<f64>>,
    /// Frequency of the head's motion, Hz; a cycle is one stroke there and back.
    #[schemars(with = "Option<f64>")]
    pub(super) frequency_hz: Option<Spanned<f64>>,
    /// Time at which the head starts from one end of its stroke, s; 0 if left out.
    #[schemars(with = "Option<f64>")]
    pub(super) delay_s: Option<Spanned<f64>>,
    /// Constant speed of the head, m/s; its position at time `t` is `speed_m_per_s t`.
    #[schemars(with = "Option<f64>")]
    pub(super) speed_m_per_s: Option<Spanned<f64>>,
    /// Folder of a recording whose head drives the scene, or its trace.csv; relative to this file.
    #[schemars(with = "Option<String>")]
    pub(super) recording: Option<Spanned<String>>,
}

/// What happens when contact is lost or the tip jams.
#[derive(Deserialize, Default, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ContactFile {
    /// What happens when the normal force reaches zero; "stop" if left out.
    #[serde(default)]
    pub(super) loss: ContactLossRule,
    /// What happens when the Painleve condition fails; "stop" if left out.
    #[serde(default)]
    pub(super) jam: JamRule,
    /// Coefficient of restitution of a landing in the normal direction, 0 to 1; 0 if left out.
    #[schemars(with = "Option<f64>")]
    pub(super) restitution: Option<Spanned<f64>>,
}

/// State at the start of a run.
#[derive(Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum StartWord {
    /// A blade, upright and at rest relative to its head.
    Upright,
    /// A slider at rest on its surface, with the spring relaxed.
    Relaxed,
    /// In the equilibrium of steady slip at the head's speed.
    SteadySlide,
    /// In a given state: two angles and two rates of a blade, or deflection and velocity of a slider.
    State,
}

/// Start of the run: its time and the state of the blade or slider.
#[derive(Deserialize, Default, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct StartFile {
    /// Start of the run, s; 0 if left out.
    #[serde(default)]
    pub(super) time_s: f64,
    /// State at the start; if left out, "upright" for a blade and "relaxed" for a slider.
    #[serde(default)]
    pub(super) kind: Option<StartWord>,
    /// Angle of the neck from the vertical, rad; only with kind = "state".
    pub(super) neck_angle_rad: Option<f64>,
    /// Angle of the lip from the vertical, rad; only with kind = "state".
    pub(super) lip_angle_rad: Option<f64>,
    /// Rate of the neck's angle, rad/s; only with kind = "state".
    pub(super) neck_rate_rad_per_s: Option<f64>,
    /// Rate of the lip's angle, rad/s; only with kind = "state".
    pub(super) lip_rate_rad_per_s: Option<f64>,
    /// Position of a slider minus that of its head, m; only with kind = "state".
    pub(super) deflection_m: Option<f64>,
    /// Velocity of a slider, m/s; only with kind = "state".
    pub(super) tip_velocity_m_per_s: Option<f64>,
}

/// How long the simulation runs, and which tables it writes.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct RunFile {
    /// End of the run, s.
    pub(super) stop_s: f64,
    /// Number of rows per second in the tables, Hz.
    pub(super) sample_rate_hz: f64,
    /// Relative error allowed in a step; 1e-8 if left out.
    pub(super) relative_tolerance: Option<f64>,
    /// Number of evaluations of the right-hand side after which a run is ended, so that every run ends.
    pub(super) most_evaluations: Option<u64>,
    /// Tables that `simulate` writes; all if left out.
    pub(super) outputs: Option<Vec<OutputTable>>,
}

fn blade(_: &mut SchemaGenerator) -> Schema {
    number_table_schema("blade", [])
}

fn slider(_: &mut SchemaGenerator) -> Schema {
    number_table_schema("slider", [])
}

fn shoulder(_: &mut SchemaGenerator) -> Schema {
    number_table_schema("shoulder", [])
}

fn friction(_: &mut SchemaGenerator) -> Schema {
    let list = |description: &str| {
        let numbers = json!({ "type": "number", "minimum": 0 });
        json!({ "type": "array", "items": numbers, "description": description })
    };
    let words: Vec<&str> = LAW_KEYS.iter().map(|(law, _)| *law).collect();
    let about = "Law between friction coefficient and speed; \"exponential\" if left out.";
    let others = [
        ("law", json!({ "type": "string", "enum": words, "description": about })),
        (
            "speeds_m_per_s",
            list("Speeds of the 2 to 32 points of a table, increasing, m/s. For the law \"table\"."),
        ),
        ("coefficients", list("Friction coefficients at `speeds_m_per_s`. For the law \"table\".")),
    ];
    number_table_schema("friction", others)
}

/// Schema of a table of numbers, from the table of parameters, and of its other keys. A key is not required
/// if its quantity has two keys or belongs to a particular friction law.
fn number_table_schema<const N: usize>(table: &str, others: [(&str, serde_json::Value); N]) -> Schema {
    let rows = || PARAMETERS.iter().filter_map(|row| Some((row.name.split_once('.')?, row)));
    let rows = || rows().filter(|((of, _), _)| *of == table);
    let keys = rows()
        .map(|((_, key), row)| {
            let unit = if row.unit == "1" { String::new() } else { format!(", {}", row.unit) };
            let mut schema = json!({
                "type": "number",
                "description": format!("{}{unit}.{} How to measure it: {}.", row.meaning, laws_of(row.name), row.quantity.measurement_method()),
            });
            match row.range {
                ParameterRange::Positive => schema["exclusiveMinimum"] = json!(0),
                ParameterRange::NotNegative => schema["minimum"] = json!(0),
                ParameterRange::Within(least, most) => {
                    schema["minimum"] = json!(least);
                    schema["maximum"] = json!(most);
                }
            }
            if let Some(default) = row.default {
                schema["default"] = json!(default);
            }
            (key.to_owned(), schema)
        });
    let ways = |quantity| PARAMETERS.iter().filter(|row| row.quantity == quantity).count();
    let required: Vec<&str> = rows()
        .filter(|(_, row)| row.default.is_none() && ways(row.quantity) == 1 && laws_of(row.name).is_empty())
        .map(|((_, key), _)| key)
        .collect();
    table_schema(keys.chain(others.map(|(key, schema)| (key.to_owned(), schema))), &required)
}

/// Sentence that names the friction laws with a parameter; empty for a parameter of every law.
fn laws_of(name: &str) -> String {
    let laws = LAW_KEYS.iter().filter(|(_, keys)| keys.contains(&name));
    let laws: Vec<String> = laws.map(|(law, _)| format!("\"{law}\"")).collect();
    if laws.is_empty() { String::new() } else { format!(" For the law {}.", laws.join(" or ")) }
}
