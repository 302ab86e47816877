//! Points of a study, collected from any number of journals without repetition.
//!
//! The points are stored in a temporary file; the memory needed is eight bytes per point.

use super::journal::{SweepHeader, SweepPoint};
use super::point::PointOutcome;
use crate::checkpoint::{
    CheckpointEnd, CheckpointError, CheckpointReader, StoredRecord, describe_difference,
};
use std::io::{self, BufRead, BufWriter, Read, Seek, SeekFrom, Write};

/// Reason why points cannot be collected.
#[derive(Debug, thiserror::Error)]
pub enum CollectError {
    /// A journal is refused, or two journals have different outcomes of a point.
    #[error(transparent)]
    Journal(#[from] CheckpointError),
    /// The temporary file cannot be written or read.
    #[error("the temporary file with the points cannot be used: {0}")]
    Spool(#[from] io::Error),
}

/// Result of adding a journal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AddedPoints {
    /// Number of points in the journal.
    pub points: usize,
    /// Number of points that no earlier journal contained.
    pub new: usize,
    /// How the journal ends, for example with an incomplete line.
    pub end: CheckpointEnd,
}

/// Points of a study in a temporary file.
#[derive(Debug)]
pub struct PointCollection<F: Write> {
    header: SweepHeader,
    /// Offset of each point in the temporary file, plus one; 0 for a missing point.
    places: Vec<u64>,
    files: Vec<String>,
    spool: BufWriter<F>,
    end: u64,
    known: usize,
}

/// Number of bytes before the text of a point: index of its journal (4 bytes), its line number (8 bytes),
/// length of the text (4 bytes).
const HEAD_BYTES: usize = 16;

impl<F: Read + Write + Seek> PointCollection<F> {
    /// An empty collection; every journal must have this `header`, and `spool` is an empty file.
    pub fn new(header: SweepHeader, spool: F) -> Self {
        let places = vec![0; header.body.points];
        Self { header, places, files: Vec::new(), spool: BufWriter::new(spool), end: 0, known: 0 }
    }

    /// Adds the points of a journal; returns `None` if the journal has no complete header. `file` is the name
    /// of the journal in error messages.
    ///
    /// # Errors
    /// [`CollectError`] if the journal is of another study or version, is damaged, or disagrees with an
    /// earlier journal on a point.
    pub fn add_journal(
        &mut self,
        file: &str,
        from: impl BufRead,
    ) -> Result<Option<AddedPoints>, CollectError> {
        let Some(mut journal) = CheckpointReader::<SweepPoint, _>::open(file, from)? else { return Ok(None) };
        journal.header().check_matches::<SweepPoint>(file, &self.header)?;
        let (before, mut points) = (self.known, 0);
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

    /// Number of collected points.
    pub(crate) fn known_count(&self) -> usize {
        self.known
    }

    /// Indices of the missing points.
    pub(crate) fn missing_indices(&self) -> impl Iterator<Item = usize> + '_ {
        self.places.iter().enumerate().filter(|(_, place)| **place == 0).map(|(index, _)| index)
    }

    /// Calls `each` with every point in order.
    ///
    /// # Errors
    /// [`CollectError::Spool`], also if a point is missing.
    pub fn for_each_point(&mut self, mut each: impl FnMut(usize, PointOutcome)) -> Result<(), CollectError> {
        for index in 0..self.places.len() {
            let missing = || io::Error::other(format!("point {index} is missing"));
            each(index, self.read_point(index)?.ok_or_else(missing)?.point.outcome);
        }
        Ok(())
    }

    fn spool_point(&mut self, found: &StoredRecord<SweepPoint>) -> Result<(), CollectError> {
        let text = serde_json::to_vec(&found.record).map_err(io::Error::from)?;
        let (file, line, length) = ((self.files.len() - 1) as u32, found.line as u64, text.len() as u32);
        let bytes = [&file.to_le_bytes()[..], &line.to_le_bytes(), &length.to_le_bytes(), &text].concat();
        self.spool.write_all(&bytes)?;
        if let Some(place) = self.places.get_mut(found.record.index) {
            *place = self.end + 1;
        }
        self.end += bytes.len() as u64;
        self.known += 1;
        Ok(())
    }

    fn read_point(&mut self, index: usize) -> Result<Option<SpooledPoint>, CollectError> {
        let Some(place) = self.places.get(index).filter(|place| **place > 0) else { return Ok(None) };
        self.spool.seek(SeekFrom::Start(place - 1))?;
        let file = self.spool.get_mut();
        let mut head = [0; HEAD_BYTES];
        file.read_exact(&mut head)?;
        let [a, b, c, d, line @ .., e, f, g, h] = head;
        let mut text = vec![0; u32::from_le_bytes([e, f, g, h]) as usize];
        file.read_exact(&mut text)?;
        self.spool.seek(SeekFrom::Start(self.end))?;
        let point = serde_json::from_slice(&text).map_err(io::Error::from)?;
        let file = u32::from_le_bytes([a, b, c, d]) as usize;
        Ok(Some(SpooledPoint { point, file, line: u64::from_le_bytes(line) as usize }))
    }

    fn check_agreement(
        &self,
        there: &SpooledPoint,
        found: &StoredRecord<SweepPoint>,
    ) -> Result<(), CheckpointError> {
        let Some([expected, differs]) = describe_difference(&there.point, &found.record) else {
            return Ok(());
        };
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

/// A point, the index of its journal, and its line number there.
struct SpooledPoint {
    point: SweepPoint,
    file: usize,
    line: usize,
}
