//! The points of a study from any number of journals, each counted once.
//!
//! Points are kept in a temporary file; the memory holds eight bytes a point.

use super::journal::{SweepHeader, SweepPoint};
use super::point::PointOutcome;
use crate::checkpoint::{CheckpointEnd, CheckpointError, CheckpointReader, CheckpointRecord, StoredRecord};
use std::io::{self, BufRead, BufWriter, Read, Seek, SeekFrom, Write};

/// Why points cannot be collected.
#[derive(Debug, thiserror::Error)]
pub enum CollectError {
    /// A journal is refused, or two disagree.
    #[error(transparent)]
    Journal(#[from] CheckpointError),
    /// The temporary file cannot be written or read.
    #[error("the temporary file with the points cannot be used: {0}")]
    Spool(#[from] io::Error),
}

/// What a journal added.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AddedPoints {
    /// Its points.
    pub points: usize,
    /// Those of them that no journal before it had.
    pub new: usize,
    /// How it ends.
    pub end: CheckpointEnd,
}

/// Points of a study, with a temporary file for them.
#[derive(Debug)]
pub struct PointCollection<F: Write> {
    header: SweepHeader,
    /// Where each point starts in the temporary file, plus one; 0 for one that is missing.
    places: Vec<u64>,
    files: Vec<String>,
    spool: BufWriter<F>,
    end: u64,
    known: usize,
}

/// A point in the temporary file: the numbers of its journal and line, and the length of its text.
const HEAD_BYTES: usize = 16;

impl<F: Read + Write + Seek> PointCollection<F> {
    /// No point yet; `header` is that of every journal of the study, and `spool` an empty file.
    pub fn new(header: SweepHeader, spool: F) -> Self {
        let places = vec![0; header.body.points];
        Self { header, places, files: Vec::new(), spool: BufWriter::new(spool), end: 0, known: 0 }
    }

    /// Adds the points of a journal, `None` where it has no complete header; `file` is its name in refusals.
    ///
    /// # Errors
    /// [`CollectError`] when it is of another study or version, is damaged, or a point in it is not what
    /// another journal has.
    pub fn add_journal(
        &mut self,
        file: &str,
        from: impl BufRead,
    ) -> Result<Option<AddedPoints>, CollectError> {
        let Some(mut journal) = CheckpointReader::<SweepPoint, _>::open(file, from)? else { return Ok(None) };
        journal.header().check_matches::<SweepPoint>(file, &self.header)?;
        let before = self.known;
        let mut points = 0;
        self.files.push(file.to_owned());
        while let Some(found) = journal.next_record()? {
            points += 1;
            match self.read_point(found.record.index)? {
                None => self.spool_point(&found)?,
                Some(there) => self.check_agreement(&there, &found)?,
            }
        }
        Ok(Some(AddedPoints { points, new: self.known - before, end: journal.end() }))
    }

    /// Number of points that are known.
    pub(crate) fn known_count(&self) -> usize {
        self.known
    }

    /// Indices of the points that are missing.
    pub(crate) fn missing_indices(&self) -> impl Iterator<Item = usize> + '_ {
        self.places.iter().enumerate().filter(|(_, place)| **place == 0).map(|(index, _)| index)
    }

    /// What a point gave; `None` where it is missing.
    ///
    /// # Errors
    /// [`CollectError::Spool`].
    pub(crate) fn read_outcome(&mut self, index: usize) -> Result<Option<PointOutcome>, CollectError> {
        Ok(self.read_point(index)?.map(|there| there.point.outcome))
    }

    /// Calls `each` with every point in order.
    ///
    /// # Errors
    /// [`CollectError::Spool`], also where a point is missing.
    pub fn for_each_point(&mut self, mut each: impl FnMut(usize, PointOutcome)) -> Result<(), CollectError> {
        for index in 0..self.places.len() {
            let missing = || io::Error::other(format!("point {index} is missing"));
            each(index, self.read_outcome(index)?.ok_or_else(missing)?);
        }
        Ok(())
    }

    fn spool_point(&mut self, found: &StoredRecord<SweepPoint>) -> Result<(), CollectError> {
        let text = serde_json::to_vec(&found.record.to_row(0)).map_err(io::Error::from)?;
        let file = (self.files.len() - 1) as u32;
        self.spool.write_all(&file.to_le_bytes())?;
        self.spool.write_all(&(found.line as u64).to_le_bytes())?;
        self.spool.write_all(&(text.len() as u32).to_le_bytes())?;
        self.spool.write_all(&text)?;
        if let Some(place) = self.places.get_mut(found.record.index) {
            *place = self.end + 1;
        }
        self.end += (HEAD_BYTES + text.len()) as u64;
        self.known += 1;
        Ok(())
    }

    /// A point that is known.
    fn read_point(&mut self, index: usize) -> Result<Option<SpooledPoint>, CollectError> {
        let Some(place) = self.places.get(index).filter(|place| **place > 0) else { return Ok(None) };
        self.spool.seek(SeekFrom::Start(place - 1))?;
        let file = self.spool.get_mut();
        let mut head = [0; HEAD_BYTES];
        file.read_exact(&mut head)?;
        let [a, b, c, d, line @ .., e, f, g, h] = head;
        let length = u32::from_le_bytes([e, f, g, h]) as usize;
        let mut text = vec![0; length];
        file.read_exact(&mut text)?;
        self.spool.seek(SeekFrom::Start(self.end))?;
        let row = serde_json::from_slice(&text).map_err(io::Error::from)?;
        let point = SweepPoint::from_row(row, &self.header.body).map_err(io::Error::other)?;
        let file = u32::from_le_bytes([a, b, c, d]) as usize;
        Ok(Some(SpooledPoint { point, file, line: u64::from_le_bytes(line) as usize }))
    }

    fn check_agreement(
        &self,
        there: &SpooledPoint,
        found: &StoredRecord<SweepPoint>,
    ) -> Result<(), CheckpointError> {
        let Some([expected, differs]) = there.point.difference(&found.record) else { return Ok(()) };
        let name = |at: usize| self.files.get(at).cloned().unwrap_or_default();
        Err(CheckpointError::Conflict {
            file: name(self.files.len() - 1),
            line: found.line,
            found: differs,
            other_file: name(there.file),
            other_line: there.line,
            expected,
        })
    }
}

/// A point and where its line stands.
struct SpooledPoint {
    point: SweepPoint,
    file: usize,
    line: usize,
}
