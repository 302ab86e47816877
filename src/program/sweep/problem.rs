//! A study with its scene, read from disk.

use crate::program::failure::Failure;
use crate::program::files;
use crate::program::load::read_named_scene;
use crate::simulate::scene::Scene;
use crate::sweep::journal::{SweepHeader, study_header};
use crate::sweep::{CollectError, PointCollection, Study};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// A checked study with its scene.
pub struct LoadedStudy {
    pub study: Study,
    pub scene: Scene,
    pub fingerprint: String,
}

impl LoadedStudy {
    pub fn load(path: &Path) -> Result<Self, Failure> {
        let file = path.display().to_string();
        let text = files::read_toml(path)?;
        let study = Study::parse(&file, &text).map_err(Failure::input)?;
        let scene = read_named_scene(path, &study.scene)?;
        study.check_scene(&file, &scene).map_err(Failure::input)?;
        let fingerprint = study.fingerprint(&scene);
        Ok(Self { study, scene, fingerprint })
    }

    /// First line of every journal of the study.
    pub fn header(&self) -> SweepHeader {
        study_header(&self.study, &self.fingerprint)
    }

    /// No point yet; the temporary file lies where `out` will be.
    pub fn new_collection(&self, out: &Path) -> Result<PointCollection<File>, Failure> {
        Ok(PointCollection::new(self.header(), files::create_scratch_file(out)?))
    }

    /// Adds the points of a journal.
    pub fn add_checkpoint(&self, points: &mut PointCollection<File>, journal: &Path) -> Result<(), Failure> {
        let name = journal.display().to_string();
        let refused = |problem: String| Failure::Input(format!("{name}: {problem}"));
        let file = File::open(journal).map_err(|error| refused(format!("cannot be read: {error}")))?;
        let added = points.add_journal(&name, BufReader::new(file)).map_err(collection_failure)?;
        match added {
            None => warn_line!("warning: {name}: holds no complete line"),
            Some(added) if added.end.torn => {
                warn_line!("warning: {name}: the last line is incomplete and left out")
            }
            Some(_) => {}
        }
        Ok(())
    }
}

/// Why points cannot be collected.
pub fn collection_failure(error: CollectError) -> Failure {
    match error {
        CollectError::Journal(refused) => Failure::input(refused),
        CollectError::Spool(_) => Failure::internal(error),
    }
}
