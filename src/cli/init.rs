//! `wiperlab init`.

use super::load::load_recording;
use super::prelude::*;
use crate::draft::{self, KnownSlider, KnownStroke};
use crate::simulate::scene::Scene;

const SCENE: &str = "scene.toml";
const JOB: &str = "job.toml";

const AFTER_HELP: &str = "\
Both files have comments: what was found in the recording, why each number was chosen, and which numbers only
you can measure (marked YOURS). Replace those, then:

    wiperlab fit DIR/job.toml
    wiperlab report DIR";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct InitArgs {
    /// Folder of a recording, or a single trace.csv
    #[arg(value_name = "RECORDING", required_unless_present = "scene", conflicts_with = "scene")]
    pub recording: Option<PathBuf>,
    /// Write only a scene, without a recording
    #[arg(long)]
    pub scene: bool,
    /// Write a scene for a blade whose neck has no shoulder to lean on
    #[arg(long)]
    pub no_shoulder: bool,
    /// Write files for a slider in place of a blade: a mass on a spring, which rubs on a surface
    #[arg(
        long,
        requires_all = ["recording", "mass_kg", "normal_force_n"],
        conflicts_with_all = ["no_shoulder", "amplitude_m", "frequency_hz"]
    )]
    pub slider: bool,
    /// Mass of the slider, kg
    #[arg(long, value_name = "KG", requires = "slider", allow_negative_numbers = true)]
    pub mass_kg: Option<f64>,
    /// Force that presses the slider onto the surface, N
    #[arg(long, value_name = "N", requires = "slider", allow_negative_numbers = true)]
    pub normal_force_n: Option<f64>,
    /// Amplitude of the head, half its stroke, m, if the head was not tracked; otherwise estimated
    #[arg(long, value_name = "M", requires = "recording", allow_negative_numbers = true)]
    pub amplitude_m: Option<f64>,
    /// Strokes there and back per second, Hz, if the head was not tracked; otherwise estimated
    #[arg(long, value_name = "HZ", requires = "recording", allow_negative_numbers = true)]
    pub frequency_hz: Option<f64>,
    /// Folder for scene.toml and job.toml
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// The drafted files by name, and the findings on which they are based.
type DraftFiles = (Vec<(&'static str, String)>, Vec<String>);

impl InitArgs {
    pub(crate) fn run(&self, global: &GlobalArgs) -> Outcome {
        let writer = WritePolicy::new(OutputCommand::Init, self.overwrite);
        let names: &[&str] = if self.scene { &[SCENE] } else { &[SCENE, JOB] };
        OutputFolder::check(&self.out, &writer, names)?;
        let (texts, words) = match &self.recording {
            Some(recording) => self.draft_for_recording(recording)?,
            None => {
                let scene = draft::write_scene_alone(!self.no_shoulder).map_err(Failure::internal)?;
                (vec![(SCENE, scene)], Vec::new())
            }
        };
        let outputs: Vec<_> = texts.into_iter().map(|(name, text)| (name, text.into_bytes())).collect();
        files::write_outputs(&self.out, &writer, &outputs)?;
        if !global.quiet {
            self.print_next_steps(&words);
        }
        Ok(CommandOutcome::Done)
    }

    fn draft_for_recording(&self, path: &Path) -> Outcome<DraftFiles> {
        if files::is_standard_input(path) {
            let expected = "a folder or a file, which scene and job can name";
            return Err(Failure::Input(format!(
                "-: found standard input, expected {expected}; save it as trace.csv"
            )));
        }
        let loaded = load_recording(path)?;
        let exposure_s = loaded.exposure_s();
        let found = draft::DraftFindings::from_recording(&loaded.recording, exposure_s, self.known_stroke()?)
            .map_err(|error| Failure::at(path.display(), error))?;
        let seen = files::relative_path(&self.out, path)?;
        let said = || loaded.recording.describe_resampling().into_iter().chain(found.describe()).collect();
        if let Some(slider) = self.known_slider()? {
            let written = slider.write_files(&found, &loaded.recording, [&seen, SCENE]);
            let [scene, job] = written.map_err(|error| Failure::at(path.display(), error))?;
            return Ok((vec![(SCENE, scene), (JOB, job)], said()));
        }
        let scene = draft::write_scene(&found, &seen, !self.no_shoulder).map_err(Failure::internal)?;
        let file = self.out.join(SCENE).display().to_string();
        Scene::parse_with_recording(&file, &scene, |_| Ok(loaded.recording.clone()))
            .map_err(|error| {
                Failure::at(path.display(), format!("found {:.4} s, too short or too slow a motion for a run to start in; expected a head that moves by several millimetres; film more of the stroke ({error})", found.length_s()))
            })?;
        let job = draft::write_job(&found, &loaded.recording, [&seen, SCENE], !self.no_shoulder);
        Ok((vec![(SCENE, scene), (JOB, job)], said()))
    }

    /// Mass and normal force of a slider; `None` for a blade.
    fn known_slider(&self) -> Outcome<Option<KnownSlider>> {
        check_positive([("--mass-kg", self.mass_kg), ("--normal-force-n", self.normal_force_n)])?;
        let numbers = self.mass_kg.zip(self.normal_force_n).filter(|_| self.slider);
        Ok(numbers.map(|(mass_kg, normal_force_n)| KnownSlider { mass_kg, normal_force_n }))
    }

    /// Amplitude and frequency of the stroke, as far as the options give them.
    fn known_stroke(&self) -> Outcome<KnownStroke> {
        check_positive([("--amplitude-m", self.amplitude_m), ("--frequency-hz", self.frequency_hz)])?;
        Ok(KnownStroke { amplitude_m: self.amplitude_m, frequency_hz: self.frequency_hz })
    }

    fn print_next_steps(&self, words: &[String]) {
        words.iter().for_each(|line| print_line!("found: {line}"));
        let [scene, job, run] = [SCENE, JOB, "run"].map(|name| self.out.join(name).display().to_string());
        print_line!("written to {}", self.out.display());
        if !self.slider {
            let mark = draft::YOURS_MARK;
            print_line!("next: replace the numbers marked {mark} in {scene}; they are those of an example");
        }
        if self.scene {
            print_line!("then: wiperlab simulate {scene} --out {run}");
        } else {
            print_line!("then: wiperlab fit {job}");
        }
    }
}

/// Refuses an option whose value is not above 0.
fn check_positive(typed: [(&str, Option<f64>); 2]) -> Outcome<()> {
    let is_wrong = |value: &f64| !(value.is_finite() && *value > 0.0);
    if let Some((option, value)) = typed.into_iter().find_map(|(o, x)| Some((o, x.filter(is_wrong)?))) {
        return Err(Failure::at(option, format!("found {value}, expected a number above 0")));
    }
    Ok(())
}
