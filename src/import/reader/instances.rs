//! Collects the rows of a file into clocks and tracks. Rows with the same key form an instance, such as a
//! tracked object or a block of rows. An instance has one clock, and a track for each of its points.

use super::track_file::{Column, Fact};
use crate::import::error::{ImportError, ImportResult, TextLocation};
use crate::import::reader::column::CoordinateUnit;
use crate::import::reader::track_file::{Clock, Track};
use std::collections::HashMap;

/// Maximum number of instances in a file. Files with more contain detections that are not linked to tracks.
const MOST_TRACKS: usize = 20_000;

#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct RowPosition {
    pub x: Option<f64>,
    pub y: Option<f64>,
    pub confidence: Option<f64>,
}

/// Line number of a row, and its frame number, its time or both.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct RowStamp {
    pub line: usize,
    pub frame: Option<f64>,
    pub time: Option<f64>,
}

/// A point that every instance has.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct PointFields {
    pub name: String,
    /// Units of x and y, where the header states them.
    pub units: [Fact<CoordinateUnit>; 2],
    pub has_y: bool,
    pub has_confidence: bool,
}

/// What every row of the file contains: a frame number or a time, and points.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct InstanceFields {
    pub has_frame: bool,
    pub has_time: bool,
    /// Index, within a row, of the cell that contains the frame number or the time. Error messages use it to
    /// give the column.
    pub clock_cell: usize,
    pub points: Vec<PointFields>,
}

/// Order of the rows of an instance in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RowOrder {
    /// The rows must be in order of time; they are not sorted.
    AsWritten,
    /// The rows may be in any order; they are sorted by frame number or time.
    Any,
}

/// Collects rows and groups them by instance. The instances stay in the order in which they first appear.
pub(crate) struct TrackCollector {
    shape: InstanceFields,
    known: HashMap<String, usize>,
    instances: Vec<CollectedInstance>,
    /// Index of the instance to which the last row belongs; the next row usually belongs to the same
    /// instance.
    last: usize,
    /// Line number of the first row whose instance would be one more than [`MOST_TRACKS`]; `None` if there is
    /// no such row.
    too_many: Option<usize>,
}

struct CollectedInstance {
    key: String,
    clock: Clock,
    points: Vec<[Column; 3]>,
}

impl TrackCollector {
    pub(crate) fn new(shape: InstanceFields) -> Self {
        Self { shape, known: HashMap::new(), instances: vec![], last: 0, too_many: None }
    }

    /// Adds a row of the instance named `key`; `positions` has one position for each point.
    pub(crate) fn add_row(&mut self, key: &str, stamp: RowStamp, positions: &[RowPosition]) {
        let same = |instance: &CollectedInstance| {
            instance.key.len() == key.len() && (key.is_empty() || instance.key == key)
        };
        if !self.instances.get(self.last).is_some_and(same) {
            let known = self.known.get(key).copied();
            if self.too_many.is_some() || (known.is_none() && self.instances.len() == MOST_TRACKS) {
                self.too_many.get_or_insert(stamp.line);
                return;
            }
            self.last = known.unwrap_or_else(|| self.add_instance(key));
        }
        let Some(instance) = self.instances.get_mut(self.last) else { return };
        instance.clock.lines.push(u32::try_from(stamp.line).unwrap_or(u32::MAX));
        if let Some(frames) = &mut instance.clock.frame {
            frames.push(stamp.frame);
        }
        if let Some(times) = &mut instance.clock.time {
            times.push(stamp.time);
        }
        for ((columns, position), shape) in instance.points.iter_mut().zip(positions).zip(&self.shape.points)
        {
            columns[0].push(position.x);
            if shape.has_y {
                columns[1].push(position.y);
            }
            if shape.has_confidence {
                columns[2].push(position.confidence);
            }
        }
    }

    fn add_instance(&mut self, key: &str) -> usize {
        let column = |present: bool| present.then(Column::default);
        let clock = Clock {
            cell: self.shape.clock_cell,
            frame: column(self.shape.has_frame),
            time: column(self.shape.has_time),
            ..Clock::default()
        };
        let points = self.shape.points.iter().map(|_| <[Column; 3]>::default()).collect();
        self.instances.push(CollectedInstance { key: key.to_owned(), clock, points });
        self.known.insert(key.to_owned(), self.instances.len() - 1);
        self.instances.len() - 1
    }

    /// Number of instances.
    pub(crate) fn len(&self) -> usize {
        self.instances.len()
    }

    /// Sorts the rows of every instance. Removes the instances that have two rows in one frame, and returns
    /// their keys, each with its error.
    pub(crate) fn take_branching(&mut self, file: &str) -> Vec<(String, ImportError)> {
        let mut branching = vec![];
        self.instances.retain_mut(|instance| match instance.sort_rows(file) {
            Ok(()) => true,
            Err(error) => {
                branching.push((instance.key.clone(), error));
                false
            }
        });
        branching
    }

    /// Returns one clock for each instance, and one track for each point of an instance. A track has the name
    /// of its point if its instance has no name. Otherwise it has the name of its instance if instances have
    /// only one point, the name of its point if there is only one instance, or else the name
    /// `INSTANCE:POINT`.
    ///
    /// # Errors
    /// [`ImportError::WrongTable`] for too many instances; [`ImportError::DuplicateRow`] if `order` is
    /// [`RowOrder::Any`] and two rows of an instance have the same frame number or time.
    pub(crate) fn finish(self, file: &str, order: RowOrder) -> ImportResult<(Vec<Clock>, Vec<Track>)> {
        if let Some(line) = self.too_many {
            return Err(ImportError::wrong_table(
                format!("{file}:{line}:1"),
                format!("more than {MOST_TRACKS} tracks"),
                "the tracks of a few points",
                "link the detections to tracks in the tracking program, and export those of tip and head",
            ));
        }
        let (alone, single) = (self.instances.len() == 1, self.shape.points.len() == 1);
        let (mut clocks, mut tracks) = (vec![], vec![]);
        for mut instance in self.instances {
            if order == RowOrder::Any {
                instance.sort_rows(file)?;
            }
            for (shape, [x, y, confidence]) in self.shape.points.iter().zip(instance.points) {
                let name = match (instance.key.as_str(), shape.name.as_str()) {
                    ("", point) => point.to_owned(),
                    (key, "") => key.to_owned(),
                    (key, _) if single => key.to_owned(),
                    (_, point) if alone => point.to_owned(),
                    (key, point) => format!("{key}:{point}"),
                };
                let (y, confidence) = (shape.has_y.then_some(y), shape.has_confidence.then_some(confidence));
                let units = shape.units.clone();
                tracks.push(Track { name, clock: clocks.len(), x, y, confidence, units });
            }
            clocks.push(instance.clock);
        }
        Ok((clocks, tracks))
    }
}

impl CollectedInstance {
    /// Sorts the rows by frame number, or by time if they have no frame numbers.
    fn sort_rows(&mut self, file: &str) -> ImportResult<()> {
        let clock = &self.clock;
        let Some(column) = clock.frame.as_ref().or(clock.time.as_ref()) else { return Ok(()) };
        let key = |row: usize| column.get(row).unwrap_or(f64::INFINITY);
        let mut order: Vec<usize> = (0..clock.len()).collect();
        portable_math::sort_by_number(&mut order, |a| key(*a));
        if let Some(pair) =
            order.windows(2).find(|pair| key(pair[0]) == key(pair[1]) && key(pair[0]).is_finite())
        {
            let (first, again) = (clock.line_number(pair[0]), clock.line_number(pair[1]));
            return Err(ImportError::DuplicateRow {
                place: TextLocation { file: file.to_owned(), line: again, column: 1 },
                what: if clock.frame.is_some() { "frame" } else { "time" },
                found: key(pair[0]),
                track: self.key.clone(),
                first,
            });
        }
        let lines = order.iter().map(|row| clock.lines[*row]).collect();
        let reordered = |column: &Column| column.reorder(&order);
        self.clock = Clock {
            lines,
            cell: clock.cell,
            digit: clock.digit,
            frame: clock.frame.as_ref().map(reordered),
            time: clock.time.as_ref().map(reordered),
            ..Clock::default()
        };
        self.points.iter_mut().flatten().for_each(|column| *column = column.reorder(&order));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn collector(points: &[&str]) -> TrackCollector {
        let point =
            |name: &&str| PointFields { name: (*name).to_owned(), has_y: true, ..PointFields::default() };
        TrackCollector::new(InstanceFields {
            has_frame: true,
            has_time: false,
            clock_cell: 0,
            points: points.iter().map(point).collect(),
        })
    }

    fn at(line: usize, frame: f64) -> RowStamp {
        RowStamp { line, frame: Some(frame), time: None }
    }

    fn position(x: f64) -> RowPosition {
        RowPosition { x: Some(x), y: Some(-x), confidence: None }
    }

    #[test]
    fn rows_of_each_instance_come_into_order() {
        let mut rows = collector(&[""]);
        for (line, (key, frame)) in [("a", 0.0), ("a", 9.0), ("b", 1.0), ("a", 4.0)].into_iter().enumerate() {
            rows.add_row(key, at(line + 2, frame), &[position(frame)]);
        }
        let (clocks, tracks) = rows.finish("a.csv", RowOrder::Any).unwrap();
        assert_eq!(tracks.iter().map(|t| t.name.as_str()).collect::<Vec<_>>(), ["a", "b"]);
        assert_eq!(clocks[0].lines, [2, 5, 3]);
        assert_eq!(tracks[0].x.iter().collect::<Vec<_>>(), [Some(0.0), Some(4.0), Some(9.0)]);
    }

    #[test]
    fn a_frame_twice_in_one_track_is_refused() {
        let mut rows = collector(&[""]);
        for (line, frame) in [(2, 0.0), (3, 1.0), (4, 0.0)] {
            rows.add_row("7", at(line, frame), &[position(1.0)]);
        }
        let message = rows.finish("a.csv", RowOrder::Any).unwrap_err().to_string();
        assert!(
            message.starts_with("a.csv:4:1: found frame 0 of track `7` a second time (first in line 2)"),
            "{message}"
        );
    }

    #[test]
    fn tracks_are_called_by_point_by_instance_or_by_both() {
        let names = |keys: &[&str], points: &[&str]| {
            let mut rows = collector(points);
            for (line, key) in keys.iter().enumerate() {
                rows.add_row(key, at(line, 0.0), &vec![position(1.0); points.len()]);
            }
            rows.finish("a.csv", RowOrder::Any)
                .unwrap()
                .1
                .into_iter()
                .map(|track| track.name)
                .collect::<Vec<_>>()
        };
        assert_eq!(names(&[""], &["tip", "head"]), ["tip", "head"]);
        assert_eq!(names(&["blade"], &["tip", "head"]), ["tip", "head"]);
        assert_eq!(names(&["a", "b"], &["tip", "head"]), ["a:tip", "a:head", "b:tip", "b:head"]);
        assert_eq!(names(&["0", "1"], &[""]), ["0", "1"]);
    }
}
