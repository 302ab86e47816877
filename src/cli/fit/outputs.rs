//! Files that a fit writes next to its result: the parameters as one row, the recordings compared with the
//! model, and the scenes at the estimates.

use crate::cli::job::LoadedJob;
use crate::cli::prelude::*;
use crate::compare::{COMPARISON_FILE, FittedRecording, ModelRun, comparison_table, run_conditions};
use crate::draft::{FittedScene, write_fitted_scene};
use crate::fit::job::HeadSource;
use crate::fit::result::{FitResult, FitStatus};
use crate::simulate::scene::Scene;
use crate::stability::chatter::ChatterSummary;

/// Names of files with their contents.
type FileContents = Vec<(String, Vec<u8>)>;

/// File with the parameters as one row.
const PARAMETERS_FILE: &str = "parameters.csv";

impl LoadedJob {
    /// Refuses a folder into which the files of this fit cannot be written.
    pub(crate) fn check_outputs(&self, writer: &WritePolicy) -> Outcome<()> {
        let scenes = (0..self.job().conditions.len()).map(|at| self.scene_file_name(at));
        let names = [files::RESULT_FILE, PARAMETERS_FILE, COMPARISON_FILE].map(str::to_owned);
        let names: Vec<String> = names.into_iter().chain(scenes).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        OutputFolder::check(&self.folder, writer, &names)?;
        (0..self.job().conditions.len()).try_for_each(|at| self.driver_path(at).map(|_| ()))
    }

    /// Writes the result and the other files into the folder of the job,
    /// and completes the result with the chatter of the fitted model.
    pub(crate) fn write_outputs(&self, result: &mut FitResult, writer: &WritePolicy) -> Outcome<()> {
        let mut files = Vec::new();
        if result.status != FitStatus::Failed {
            files.push((PARAMETERS_FILE.to_owned(), self.parameters_csv(result)?));
            let (compared, first) = self.comparison_files(result)?;
            files.extend(compared);
            let explained =
                result.status.has_ended() && result.has_estimates() && result.explains_recordings();
            result.chatter = first
                .filter(|_| explained)
                .and_then(|scene| ChatterSummary::from_scene(&scene, &result.parameter_spread()));
        }
        files.insert(0, (files::RESULT_FILE.to_owned(), result.to_json().into_bytes()));
        files::write_outputs(&self.folder, writer, &files)
    }

    /// File name of the scene of a condition, numbered if there are several conditions.
    fn scene_file_name(&self, condition: usize) -> String {
        match self.job().conditions.len() {
            1 => "fitted-scene.toml".to_owned(),
            _ => format!("fitted-scene-{}.toml", condition + 1),
        }
    }

    /// All estimates with their intervals as one row, so that the rows of many fits form a table.
    fn parameters_csv(&self, result: &FitResult) -> Outcome<Vec<u8>> {
        let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:?}"));
        let synthetic = self.measured.iter().any(|loaded| loaded.recording.is_synthetic());
        let mut columns = vec![
            ("title".to_owned(), result.title.clone()),
            ("status".to_owned(), result.status.name().to_owned()),
            ("explained".to_owned(), result.explains_recordings().to_string()),
            ("synthetic".to_owned(), synthetic.to_string()),
        ];
        let mut add = |name: &str, found: [Option<f64>; 3]| {
            let ends = ["", "_lower_95", "_upper_95"].map(|end| format!("{name}{end}"));
            columns.extend(ends.into_iter().zip(found.map(number)));
        };
        for constant in result.nuisances.iter().filter(|nuisance| nuisance.recording.is_none()) {
            add(&constant.name, [Some(constant.estimate), constant.lower_95, constant.upper_95]);
        }
        for (name, found) in &result.parameters {
            add(name, [Some(found.estimate), found.lower_95, found.upper_95]);
        }
        for (name, found) in &result.parameters {
            columns.push((format!("{name}_verdict"), found.verdict.name().to_owned()));
        }
        let (names, values): (Vec<_>, Vec<_>) = columns.into_iter().unzip();
        let mut table = csv::Writer::from_writer(Vec::new());
        table.write_record(names).map_err(Failure::internal)?;
        table.write_record(values).map_err(Failure::internal)?;
        table.into_inner().map_err(Failure::internal)
    }

    /// The files with the recordings compared with the model, and with the scenes at the estimates; with the
    /// scene of the first condition.
    fn comparison_files(&self, result: &FitResult) -> Outcome<(FileContents, Option<Scene>)> {
        let model = self.problem.fitted_model(result).map_err(Failure::input)?;
        let runs = match run_conditions(self.job(), &model, result) {
            Ok(runs) => runs,
            Err(why) => {
                let file = &self.file;
                warn_line!(
                    "warning: {file}: no {COMPARISON_FILE} and no scene: the best model does not run: {why}"
                );
                return Ok((Vec::new(), None));
            }
        };
        let measured = self.measured.iter().map(|loaded| FittedRecording {
            recording: &loaded.recording,
            file: loaded.file.as_ref(),
            film: None,
        });
        let measured: Vec<_> = measured.collect();
        let table = comparison_table(self.job(), &measured, &runs);
        let mut files: Vec<_> =
            table.into_iter().map(|table| (table.file.to_owned(), table.text.into_bytes())).collect();
        for (at, run) in runs.iter().enumerate() {
            let scene = self.fitted_scene_text(at, run, result)?;
            files.extend(scene.map(|text| (self.scene_file_name(at), text.into_bytes())));
        }
        Ok((files, runs.into_iter().next().map(|run| run.scene)))
    }

    /// Path of the recording that drives the fitted scene of a condition, as written in that scene.
    fn driver_path(&self, at: usize) -> Outcome<Option<String>> {
        let condition = &self.job().conditions[at];
        let trace = self.problem.traces().iter().find(|trace| trace.condition == at);
        let driven = [Some(condition.head), trace.map(|t| t.head)].contains(&Some(HeadSource::Recording));
        let driver = if driven { self.recording_paths.get(at) } else { self.drivers[at].as_ref() };
        driver.map(|path| files::relative_path(&self.folder, path)).transpose()
    }

    fn fitted_scene_text(&self, at: usize, run: &ModelRun, result: &FitResult) -> Outcome<Option<String>> {
        let condition = &self.job().conditions[at];
        let recording = self.measured.get(at).map(|loaded| &loaded.recording);
        let driver = self.driver_path(at)?;
        Ok(write_fitted_scene(&FittedScene {
            scene: &run.scene,
            condition: &condition.name,
            index: at,
            synthetic: recording.map(|recording| recording.is_synthetic()),
            recording: driver.as_deref(),
            result,
        }))
    }
}
