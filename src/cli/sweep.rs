//! `wiperlab sweep`.

mod results;
mod shards;
mod solve;

use super::args::TimeLimit;
use super::checkpoint::CHECKPOINT_FILE;
use super::load::read_named_scene;
use super::prelude::*;
use crate::checkpoint::Shard;
use crate::simulate::scene::Scene;
use crate::sweep::journal::{SweepHeader, study_header};
use crate::sweep::{CollectError, PointCollection, Study};
pub(crate) use shards::find_study;
use std::fs::File;
use std::io::BufReader;

#[derive(Debug, Args)]
pub(crate) struct SweepArgs {
    /// Study to run (sweep.toml): a scene, the parameters to vary, and the quantities to map
    pub sweep: PathBuf,
    /// Folder for sweep.csv, summary.json, one SVG per map, and journal.jsonl, to which every point is added
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    #[command(flatten)]
    pub overwrite: Overwrite,
    /// Continue from the journal in DIR; without this option a study starts anew, and the old journal is kept
    /// as journal.previous-1.jsonl (the next free number)
    #[arg(long)]
    pub resume: bool,
    /// Run only every N-th point, beginning with point K (counted from 0), into DIR/shards/K-of-N.jsonl;
    /// continues from what that file contains, and `wiperlab collect DIR` puts the shards together
    #[arg(long, value_name = "K/N", conflicts_with = "force")]
    pub shard: Option<Shard>,
    /// Stop after this time and keep what is done (exit code 3); such as 45min, 1h30min or 02:00:00
    #[arg(long, value_name = "TIME")]
    pub time_limit: Option<TimeLimit>,
}

impl SweepArgs {
    pub(crate) fn run(&self, global: &GlobalArgs) -> Outcome {
        let problem = LoadedStudy::load(&self.sweep)?;
        if let Some(TimeLimit(time)) = self.time_limit {
            interrupt::set_time_limit(time);
        }
        if let Some(shard) = self.shard {
            return problem.solve_shard(&self.sweep, &self.out, shard, global);
        }
        let journal = self.out.join(CHECKPOINT_FILE);
        files::check_path_free(&journal)?;
        let writer = global.write_policy(OutputCommand::Sweep, self.overwrite);
        problem.check_outputs(&self.out, &writer)?;
        if !problem.solve(&journal, self.resume, global)? {
            return Ok(CommandOutcome::StoppedEarly);
        }
        let mut points = problem.new_collection(&self.out)?;
        problem.add_checkpoint(&mut points, &journal)?;
        problem.write_outputs(&mut points, &self.out, &writer, global)
    }
}

/// A checked study with its scene.
pub(crate) struct LoadedStudy {
    pub study: Study,
    pub scene: Scene,
    pub fingerprint: String,
}

impl LoadedStudy {
    pub(crate) fn load(path: &Path) -> Outcome<Self> {
        let file = path.display().to_string();
        let text = files::read_toml(path)?;
        let study = Study::parse(&file, &text).map_err(Failure::input)?;
        let scene = read_named_scene(path, &study.scene)?;
        study.check_scene(&file, &scene).map_err(Failure::input)?;
        let fingerprint = study.fingerprint(&scene);
        Ok(Self { study, scene, fingerprint })
    }

    /// The first line of every journal of the study.
    pub(crate) fn header(&self) -> SweepHeader {
        study_header(&self.study, &self.fingerprint)
    }

    /// An empty collection, whose temporary file is in `out` or its nearest existing parent.
    pub(crate) fn new_collection(&self, out: &Path) -> Outcome<PointCollection<File>> {
        Ok(PointCollection::new(self.header(), files::create_scratch_file(out)?))
    }

    /// Adds the points of a journal to a collection.
    pub(crate) fn add_checkpoint(&self, points: &mut PointCollection<File>, journal: &Path) -> Outcome<()> {
        let name = journal.display().to_string();
        let refused = |problem: String| Failure::Input(format!("{name}: {problem}"));
        let file = File::open(journal).map_err(|error| refused(format!("cannot be read: {error}")))?;
        let added = points.add_journal(&name, BufReader::new(file)).map_err(collection_failure)?;
        if added.is_none() {
            warn_line!("warning: {name}: holds no complete line");
        } else if added.is_some_and(|added| added.end.torn) {
            warn_line!("warning: {name}: the last line is incomplete and left out");
        }
        Ok(())
    }
}

/// The failure that reports why points cannot be collected.
pub(crate) fn collection_failure(error: CollectError) -> Failure {
    match error {
        CollectError::Journal(refused) => Failure::input(refused),
        CollectError::Spool(_) => Failure::internal(error),
    }
}
