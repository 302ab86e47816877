//! Blades given by their parts, and the scenes made of them through the scene format.

use rand::Rng;
use std::fmt::Write;
use wiperlab::simulate::scene::Scene;

/// Parts of a blade in SI units, letters as in the paper.
#[derive(Debug, Clone, Copy)]
pub struct Parts {
    /// Masses of head, neck and lip.
    pub m: [f64; 3],
    /// Lengths of neck and lip.
    pub l: [f64; 2],
    /// From each link's upper hinge to its centre of mass.
    pub g: [f64; 2],
    /// Inertias about the centres of mass.
    pub j: [f64; 2],
    /// Stiffnesses of head, neck and lip.
    pub k: [f64; 3],
    /// Dampings of head, neck and lip.
    pub c: [f64; 3],
    /// Displacement of the support.
    pub hd: f64,
    /// Friction: A, B, C.
    pub friction: [f64; 3],
    /// Angle, stiffness and damping of the shoulder.
    pub shoulder: Option<[f64; 3]>,
}

impl Parts {
    /// A plausible blade: a few millimetres, heads of 0.5 to 50 g, neck and lip of 100 to 1300 Hz, every
    /// second one with a shoulder.
    pub fn random(rng: &mut impl Rng) -> Self {
        let mut log = |low: f64, high: f64| low * (high / low).powf(rng.random::<f64>());
        let l = [log(2e-3, 6e-3), log(1.5e-3, 6e-3)];
        let m = [log(5e-4, 5e-2), log(5e-5, 2e-4), log(2e-5, 8e-5)];
        let g = [l[0] * log(0.3, 0.7), l[1] * log(0.3, 0.7)];
        let j = [m[1] * l[0] * l[0] * log(0.04, 0.12), m[2] * l[1] * l[1] * log(0.03, 0.12)];
        let inertia =
            [m.iter().sum(), j[0] + m[1] * g[0] * g[0] + m[2] * l[0] * l[0], j[1] + m[2] * g[1] * g[1]];
        let frequency = [log(6.0, 30.0), log(150.0, 700.0), log(400.0, 1400.0)];
        let k: [f64; 3] =
            std::array::from_fn(|i| inertia[i] * (std::f64::consts::TAU * frequency[i]).powi(2));
        let c: [f64; 3] = std::array::from_fn(|i| 2.0 * log(0.01, 0.2) * (k[i] * inertia[i]).sqrt());
        let hd = log(0.1, 0.7) / k[0];
        let friction = [log(0.05, 0.8), log(0.5, 15.0), log(0.2, 0.8)];
        let shoulder = [log(0.02, 0.25), k[1] * log(5.0, 50.0), c[1] * log(0.1, 2.0)];
        let with_shoulder = log(1.0, 4.0) > 2.0;
        Self { m, l, g, j, k, c, hd, friction, shoulder: with_shoulder.then_some(shoulder) }
    }

    /// The scene of this blade; `rest` holds the tables behind `[friction]`.
    pub fn scene(&self, rest: &str) -> Scene {
        let [a, b, c] = self.friction;
        self.scene_with_friction(&format!("a = {a:e}\nb_s_per_m = {b:e}\nc = {c:e}\n"), rest)
    }

    /// The scene with other rows of `[friction]`.
    pub fn scene_with_friction(&self, friction: &str, rest: &str) -> Scene {
        let mut text = "format = 1\ntitle = \"made of parts\"\n[blade]\n".to_owned();
        let rows = [
            ("head_mass_kg", self.m[0]),
            ("neck_mass_kg", self.m[1]),
            ("lip_mass_kg", self.m[2]),
            ("neck_length_m", self.l[0]),
            ("lip_length_m", self.l[1]),
            ("neck_centre_m", self.g[0]),
            ("lip_centre_m", self.g[1]),
            ("neck_inertia_kg_m2", self.j[0]),
            ("lip_inertia_kg_m2", self.j[1]),
            ("head_stiffness_n_per_m", self.k[0]),
            ("neck_stiffness_n_m_per_rad", self.k[1]),
            ("lip_stiffness_n_m_per_rad", self.k[2]),
            ("head_damping_n_s_per_m", self.c[0]),
            ("neck_damping_n_m_s_per_rad", self.c[1]),
            ("lip_damping_n_m_s_per_rad", self.c[2]),
            ("preload_displacement_m", self.hd),
        ];
        for (key, value) in rows {
            writeln!(text, "{key} = {value:e}").unwrap();
        }
        if let Some([angle, stiffness, damping]) = self.shoulder {
            writeln!(text, "[shoulder]\ncontact_angle_rad = {angle:e}\nstiffness_n_m_per_rad = {stiffness:e}\ndamping_n_m_s_per_rad = {damping:e}").unwrap();
        }
        writeln!(text, "[friction]\n{friction}\n{rest}").unwrap();
        Scene::parse("parts.toml", &text).unwrap()
    }
}

/// A stroke of 1.5 cm at 0.9 Hz.
pub const STROKE: &str =
    "[drive]\namplitude_m = 0.015\nfrequency_hz = 0.9\n[run]\nstop_s = 0.7\nsample_rate_hz = 1000.0";
