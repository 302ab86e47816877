//! What a fit leaves next to its result: the parameters in a row, the recordings beside the model, and the
//! scenes at the estimates.

use crate::compare::{COMPARISON, Measured, ModelRun, comparison, model_runs};
use crate::draft::{Fitted, fitted_scene};
use crate::fit::job::Head;
use crate::fit::result::{FitResult, NuisanceResult, Status};
use crate::program::failure::Failure;
use crate::program::files::{self, Place, Writer};
use crate::program::problem::Problem;

/// The parameters in a row.
const PARAMETERS: &str = "parameters.csv";

impl Problem {
    /// Refuses a folder in which the files of this fit have no place.
    pub fn check_place(&self, writer: &Writer) -> Result<(), Failure> {
        let names = self.names();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        Place::check(&self.folder, writer, &names)?;
        (0..self.job().conditions.len()).try_for_each(|at| self.driver(at).map(|_| ()))
    }

    fn names(&self) -> Vec<String> {
        let scenes = (0..self.job().conditions.len()).map(|at| self.scene_name(at));
        [files::RESULT, PARAMETERS, COMPARISON].map(str::to_owned).into_iter().chain(scenes).collect()
    }

    /// Writes what was found into the folder of the job.
    pub fn write(&self, result: &FitResult, writer: &Writer) -> Result<(), Failure> {
        let mut files = vec![(files::RESULT.to_owned(), result.to_json().into_bytes())];
        if result.status != Status::Failed {
            files.push((PARAMETERS.to_owned(), self.row(result)?));
            files.extend(self.at_the_estimates(result)?);
        }
        files::write_outputs(&self.folder, writer, &files)
    }

    /// A file for each condition; of one condition alone without a number.
    fn scene_name(&self, condition: usize) -> String {
        match self.job().conditions.len() {
            1 => "fitted-scene.toml".to_owned(),
            _ => format!("fitted-scene-{}.toml", condition + 1),
        }
    }

    /// Every estimate with its interval in one row, so that rows of many fits make a table.
    fn row(&self, result: &FitResult) -> Result<Vec<u8>, Failure> {
        let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:?}"));
        let synthetic = self.measured.iter().any(|loaded| loaded.recording.is_synthetic());
        let mut columns = vec![
            ("title".to_owned(), result.title.clone()),
            ("status".to_owned(), result.status.word().to_owned()),
            ("explained".to_owned(), result.explains().to_string()),
            ("synthetic".to_owned(), synthetic.to_string()),
        ];
        let mut add = |name: &str, found: [Option<f64>; 3]| {
            let ends = ["", "_lower_95", "_upper_95"].map(|end| format!("{name}{end}"));
            columns.extend(ends.into_iter().zip(found.map(number)));
        };
        let of_scene = |nuisance: &&NuisanceResult| nuisance.recording.is_none();
        for constant in result.nuisances.iter().filter(of_scene) {
            add(&constant.name, [Some(constant.estimate), constant.lower_95, constant.upper_95]);
        }
        for (name, found) in &result.parameters {
            add(name, [Some(found.estimate), found.lower_95, found.upper_95]);
        }
        let verdicts = result.parameters.iter();
        columns.extend(
            verdicts.map(|(name, found)| (format!("{name}_verdict"), found.verdict.word().to_owned())),
        );
        let (names, values): (Vec<_>, Vec<_>) = columns.into_iter().unzip();
        let mut table = csv::Writer::from_writer(Vec::new());
        table.write_record(names).map_err(Failure::internal)?;
        table.write_record(values).map_err(Failure::internal)?;
        table.into_inner().map_err(Failure::internal)
    }

    /// The recordings beside the model, and the scenes.
    fn at_the_estimates(&self, result: &FitResult) -> Result<Vec<(String, Vec<u8>)>, Failure> {
        let model = self.problem.model_of(result).map_err(Failure::input)?;
        let runs = match model_runs(self.job(), &model, result) {
            Ok(runs) => runs,
            Err(why) => {
                warn_line!(
                    "warning: {}: no {COMPARISON} and no scene: the best model does not run: {why}",
                    self.file
                );
                return Ok(Vec::new());
            }
        };
        let measured = self.measured.iter();
        let measured: Vec<_> = measured
            .map(|m| Measured { recording: &m.recording, file: m.file.as_ref(), film: None })
            .collect();
        let table = comparison(self.job(), &measured, &runs);
        let mut files: Vec<_> =
            table.into_iter().map(|table| (table.file.to_owned(), table.text.into_bytes())).collect();
        for (at, run) in runs.iter().enumerate() {
            files.extend(self.scene(at, run, result)?.map(|text| (self.scene_name(at), text.into_bytes())));
        }
        Ok(files)
    }

    /// The recording that drives the fitted scene of a condition, as that scene names it.
    fn driver(&self, at: usize) -> Result<Option<String>, Failure> {
        let condition = &self.job().conditions[at];
        let by_trace =
            self.problem.traces().iter().find(|trace| trace.condition == at).map(|trace| trace.head);
        let driven = [Some(condition.head), by_trace].contains(&Some(Head::Recording));
        let driver = if driven { self.measured_at.get(at) } else { self.drivers[at].as_ref() };
        driver.map(|path| files::path_from(&self.folder, path)).transpose()
    }

    fn scene(&self, at: usize, run: &ModelRun, result: &FitResult) -> Result<Option<String>, Failure> {
        let condition = &self.job().conditions[at];
        let recording = self.measured.get(at).map(|loaded| &loaded.recording);
        let driver = self.driver(at)?;
        Ok(fitted_scene(&Fitted {
            scene: &run.scene,
            condition: &condition.name,
            synthetic: recording.map(|recording| recording.is_synthetic()),
            recording: driver.as_deref(),
            result,
        }))
    }
}
