//! Tables of a study that are written besides `sweep.csv` where they are wanted.

use super::problem::Problem;
use crate::program::failure::Failure;
use crate::program::files::{Growing, Place};
use crate::sweep::{Outcome, Study};
use clap::Args;

#[cfg(feature = "parquet")]
const PARQUET: &str = "sweep.parquet";

#[derive(Debug, Default, Args)]
pub struct Tables {
    /// Write the table as Apache Parquet too (sweep.parquet), for data frames: the columns of sweep.csv with
    /// their types, and a null where there is no value
    #[cfg(feature = "parquet")]
    #[arg(long)]
    pub parquet: bool,
}

/// The wanted tables, as they grow.
#[derive(Default)]
pub struct Begun {
    #[cfg(feature = "parquet")]
    parquet: Option<Result<crate::sweep::parquet::Table<Growing>, Failure>>,
}

#[cfg(feature = "parquet")]
impl Tables {
    /// Names of their files.
    pub fn names(&self) -> Option<&'static str> {
        self.parquet.then_some(PARQUET)
    }

    pub fn begin(&self, problem: &Problem, place: &Place) -> Result<Begun, Failure> {
        let table = |file| {
            crate::sweep::parquet::Table::new(&problem.study, &problem.fingerprint, file).map_err(unwritten)
        };
        let parquet = self.parquet.then(|| place.file(PARQUET)).transpose()?.map(table);
        Ok(Begun { parquet })
    }
}

#[cfg(feature = "parquet")]
impl Begun {
    /// Adds a point; what fails is said at the end.
    pub fn push(&mut self, study: &Study, index: usize, outcome: &Outcome) {
        if let Some(Ok(table)) = &mut self.parquet
            && let Err(error) = table.push(study, index, outcome)
        {
            self.parquet = Some(Err(unwritten(error)));
        }
    }

    pub fn finish(self) -> Result<Option<Growing>, Failure> {
        let finished = |table: Result<crate::sweep::parquet::Table<Growing>, Failure>| {
            table?.finish().map_err(unwritten)
        };
        self.parquet.map(finished).transpose()
    }
}

#[cfg(feature = "parquet")]
fn unwritten(error: impl std::fmt::Display) -> Failure {
    Failure::Internal(format!("{PARQUET}: cannot be written: {error}"))
}

/// There are none in a build without the feature `parquet`.
#[cfg(not(feature = "parquet"))]
impl Tables {
    pub fn names(&self) -> Option<&'static str> {
        None
    }

    pub fn begin(&self, _: &Problem, _: &Place) -> Result<Begun, Failure> {
        Ok(Begun::default())
    }
}

#[cfg(not(feature = "parquet"))]
impl Begun {
    pub fn push(&mut self, _: &Study, _: usize, _: &Outcome) {}

    pub fn finish(self) -> Result<Option<Growing>, Failure> {
        Ok(None)
    }
}
