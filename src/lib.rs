//! wiperlab compares high-speed-video measurements of a windshield wiper blade with a stick-slip model of it.
//!
//! # The pipeline
//!
//! | step | module | in | out |
//! |---|---|---|---|
//! | import | [`import`] | text of a tracking program | [`recording::Recording`], on the frame grid, SI |
//! | look | [`recording`], [`short_spectra`] | a recording | quality, instants, components |
//! | model | [`model`], [`hybrid_ode`], [`simulate`] | a scene | motion, transitions, summary |
//! | dimensions | [`model::section`], [`model::plausibility`] | the section of a blade, a scene | a first `[blade]` table, numbers to check, doubts |
//! | check the model | [`simulate::accuracy`] | a scene | error against work of every method |
//! | stability | [`stability`] | a scene | speeds at which steady sliding is unstable, effects of changes |
//! | camera | [`simulate::twin`] | a scene | a synthetic recording |
//! | read | [`feature`] | a recording | frequencies, durations, deflections, or why they are missing |
//! | fit | [`fit`] | a job, recordings | estimates, intervals, verdicts |
//! | compare | [`compare`] | recordings, the fitted model | clock shift, residuals, ridges, transitions |
//! | vary | [`sweep`] | a study, its scene | quantities over a grid of parameters |
//! | draw | [`plain_charts`], [`figures`] | results | SVG figures |
//! | show | [`report`] | results | one HTML page |
//!
//! These modules read no files and print nothing: text and numbers in, typed values and text out. Only
//! [`cli`], the command-line program, opens files.
//!
//! # The equations
//!
//! The model is that of the paper "Investigation of the dynamics of the wiper blade around the reversal":
//! equations (1) to (3) for neck, lip and normal force, (4) and (5) for friction ([`model::friction`]). In
//! reduced form, with `q = (theta, phi)`, `d` and `dot` for time derivatives, and `A`, `w` and `n` as in
//! [`model`],
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
//! All quantities are in SI units; the names of columns, keys and fields contain their unit. The parameters
//! of a scene are in one table, [`model::parameters::PARAMETERS`].
//!
//! # From a tracking export to a report
//!
//! ```
//! use wiperlab::prelude::*;
//!
//! // a synthetic export of a tracking program: 5,000 frames/s, 20 um per pixel, y points up
//! let export = include_bytes!("../data/actual-blade-twin/synthetic-tracker-export.txt").to_vec();
//! let options = ImportOptions {
//!     frame_rate_hz: Some(5000.0),
//!     scale: Some(CoordinateScale::parse("20um/px")?),
//!     y_axis: Some(YAxis::Up),
//!     tip: Some("synthetic tip".to_owned()),
//!     head: Some("synthetic head".to_owned()),
//!     ..ImportOptions::default()
//! };
//! let recording = import(&[ImportSource::without_companions("export.txt", export)], &options)?.recording;
//!
//! // the low component of the head's drop after the flip
//! let instants = ReversalInstants::find_instants(&recording);
//! let frames = Window::parse("after")?.resolve_frames(&recording, &instants)?;
//! let samples = &Channel::HeadDrop.samples(&recording)[frames];
//! let record = SampledRecord { samples, frame_rate_hz: 5000.0, exposure_s: Some(5e-5) };
//! let components = SpectralAnalysis::from_record(&record,
//! &SpectrumSettings::default())?.spectrum.components;
//! assert!((components[0].frequency_hz - 74.8).abs() < 1.0);
//!
//! // a reversal of the model, transition by transition
//! let scene = Scene::parse("scene.toml", include_str!("../data/scenes/actual-blade.toml"))?;
//! let mut transitions = Transitions::default();
//! assert_eq!(run_scene(&scene, &mut transitions).status, RunStatus::Completed);
//! assert_eq!(transitions.0.len(), 380);
//!
//! // friction and neck stiffness from the recording: 12 evaluations here, thousands in a real fit
//! let job = Job::parse("job.toml", include_str!("../fits/actual-blade-twin/job.toml"))?;
//! let problem = Problem::new(job, vec![scene], vec![recording.into()])?;
//! let result = problem.fit_within(12)?;
//!
//! // the page as text; nothing was written
//! let report = Report::from_fit(&problem, &result)?;
//! assert!(report.render_page().contains("Actual blade fitted to its synthetic recording"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may use the disallowed methods

pub mod camera;
pub mod checkpoint;
pub mod cli;
pub mod compare;
pub mod draft;
pub mod feature;
pub mod figures;
pub mod fit;
pub mod import;
pub mod model;
pub mod prelude;
pub mod recording;
pub mod report;
pub mod simulate;
pub mod stability;
pub mod sweep;
pub mod text;
pub mod toml_file;
