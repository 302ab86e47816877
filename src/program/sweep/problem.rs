//! A study with its scene, read from disk.

use crate::program::failure::Failure;
use crate::program::files;
use crate::program::load::read_scene_of;
use crate::simulate::scene::Scene;
use crate::sweep::journal::{Header, header};
use crate::sweep::{CollectError, Collection, Study};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// A checked study with its scene.
pub struct Problem {
    pub study: Study,
    pub scene: Scene,
    pub fingerprint: String,
}

impl Problem {
    pub fn load(path: &Path) -> Result<Self, Failure> {
        let file = path.display().to_string();
        let text = files::read_toml(path)?;
        let study = Study::parse(&file, &text).map_err(Failure::input)?;
        let scene = read_scene_of(path, &study.scene)?;
        study.check_scene(&file, &scene).map_err(Failure::input)?;
        let fingerprint = study.fingerprint(&scene);
        Ok(Self { study, scene, fingerprint })
    }

    /// First line of every journal of the study.
    pub fn header(&self) -> Header {
        header(&self.study, &self.fingerprint)
    }

    /// No point yet; the temporary file lies where `out` will be.
    pub fn collection(&self, out: &Path) -> Result<Collection<File>, Failure> {
        Ok(Collection::new(self.header(), files::scratch(out)?))
    }

    /// Adds the points of a journal.
    pub fn add(&self, points: &mut Collection<File>, journal: &Path) -> Result<(), Failure> {
        let name = journal.display().to_string();
        let refused = |problem: String| Failure::Input(format!("{name}: {problem}"));
        let file = File::open(journal).map_err(|error| refused(format!("cannot be read: {error}")))?;
        let added = points.add(&name, BufReader::new(file)).map_err(failure)?;
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
pub fn failure(error: CollectError) -> Failure {
    match error {
        CollectError::Journal(refused) => Failure::input(refused),
        CollectError::Spool(_) => Failure::internal(error),
    }
}
