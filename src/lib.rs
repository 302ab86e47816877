//! wiperlab holds high-speed-video measurements of a windshield wiper blade against a stick-slip model of it.
//!
//! # The pipeline
//!
//! | step | module | in | out |
//! |---|---|---|---|
//! | import | [`import`] | text of a tracking program | [`recording::Recording`], on the frame grid, SI |
//! | look | [`recording`], [`spectrum`] | a recording | quality, instants, components |
//! | model | [`blade`], [`ode`], [`simulate`] | a scene | motion, transitions, summary |
//! | check the model | [`accuracy`] | a scene | error against work of every method |
//! | camera | [`twin`] | a scene | a synthetic recording |
//! | read | [`feature`] | a recording | frequencies, durations, deflections, or why they are missing |
//! | compare | [`fit`] | a job, recordings | estimates, intervals, verdicts |
//! | vary | [`sweep`] | a study, its scene | quantities over a grid of parameters |
//! | show | [`report`] | results | SVG figures, one HTML page |
//!
//! The library reads no files and prints nothing: text and numbers in, typed values and text out. The program
//! `wiperlab` opens the files.
//!
//! # The equations
//!
//! The model is that of the paper "Investigation of the dynamics of the wiper blade around the reversal":
//! equations (1) to (3) for neck, lip and normal force ([`blade`]), (4) and (5) for friction
//! ([`blade::friction`]). In reduced form, with `q = (theta, phi)`,
//!
//! ```text
//! A qdd + b = f w      N = n.qdd + N0
//! slip, sigma = sign(v3dot):  f = -sigma mu(|v3dot|) N,  mu = a exp(-b |v3dot|) + c
//! stick:                      v3ddot = 0 gives f and N directly, while |f| <= (a + c) N
//! ```
//!
//! # Symbols and units
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | `theta`, `phi` | angles of neck and lip from the vertical, positive when the lower end lies towards +v | rad |
//! | `v`, `u` | position of the head along the sweep, its drop towards the glass | m |
//! | `v3` | position of the lip tip along the sweep | m |
//! | `N`, `f` | normal force and friction force of the glass on the tip | N |
//! | `l1`, `l2` | lengths of neck and lip | m |
//! | `k0`, `k1`, `k2` | stiffness of the head's support, the neck, the lip | N/m, N m/rad |
//!
//! Everything is SI inside; files and fields carry their unit in the name. The parameters of a scene stand in
//! one table, [`blade::parameters::PARAMETERS`].
//!
//! # A run
//!
//! ```
//! use wiperlab::simulate::{outputs::Transitions, run, scene::Scene, Status};
//!
//! let text = include_str!("../data/scenes/light-blade.toml");
//! let scene = Scene::parse("light-blade.toml", text)?;
//! let mut transitions = Transitions::default();
//! let ended = run(&scene, &mut transitions);
//! assert_eq!(ended.status, Status::Completed);
//! assert_eq!(ended.transitions as usize, transitions.0.len());
//! # Ok::<(), wiperlab::simulate::scene::SceneError>(())
//! ```

pub mod accuracy;
pub mod blade;
pub mod camera;
pub mod compare;
pub mod feature;
pub mod fit;
pub mod import;
pub mod journal;
pub mod ode;
pub mod recording;
pub mod report;
pub mod simulate;
pub mod spectrum;
pub mod sweep;
pub mod text;
pub mod toml_file;
pub mod twin;
