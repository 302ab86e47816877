//! A part of a study, or of a list of fits, for one machine.

use std::fmt;
use std::str::FromStr;

/// Maximum number of shards; it is larger than the number of cores of any cluster.
const MAX_SHARDS: usize = 1_000_000;

/// A shard: the points of a study, or the jobs of a list, whose index modulo `total` is `number`.
/// Neighbouring points, which often take similar times, belong to different shards.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    number: usize,
    total: usize,
}

impl Shard {
    /// The single shard that contains all points.
    pub const WHOLE: Self = Self { number: 0, total: 1 };

    /// Shard number `at`, counted from 0, of `of` shards; `None` if `at` or `of` is too large.
    pub(crate) fn new(at: usize, of: usize) -> Option<Self> {
        (at < of && of <= MAX_SHARDS).then_some(Self { number: at, total: of })
    }

    /// Number of the shard, counted from 0.
    pub(crate) fn number(self) -> usize {
        self.number
    }

    pub(crate) fn total(self) -> usize {
        self.total
    }

    /// Number of points in the shard if the study has `points` points.
    pub(crate) fn count_points(self, points: usize) -> usize {
        points.saturating_sub(self.number).div_ceil(self.total)
    }

    /// Whether the shard contains point `index`.
    pub(crate) fn contains(self, index: usize) -> bool {
        index % self.total == self.number
    }

    /// Whether two shards can have a point in common: their numbers are equal modulo the greatest common
    /// divisor of their totals.
    pub(crate) fn overlaps(self, other: Self) -> bool {
        let (mut common, mut rest) = (self.total, other.total);
        while rest > 0 {
            (common, rest) = (rest, common % rest);
        }
        self.number % common == other.number % common
    }

    /// Index in the study of point number `place` of the shard; both are counted from 0.
    pub(crate) fn point_index(self, place: usize) -> usize {
        self.number + place * self.total
    }

    /// Name of the journal of the shard, without extension, such as `3-of-64`.
    pub(crate) fn file_stem(self) -> String {
        format!("{}-of-{}", self.number, self.total)
    }

    /// The shard whose journal has this name; `None` for any other name.
    pub(crate) fn from_file_stem(name: &str) -> Option<Self> {
        let (at, of) = name.split_once("-of-")?;
        Self::new(at.parse().ok()?, of.parse().ok()?).filter(|shard| shard.file_stem() == name)
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.total)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(at, of)| Some((at.parse().ok()?, of.parse().ok()?)));
        let expected =
            || format!("expected K/N, such as 3/64, with K from 0 to N - 1 and N up to {MAX_SHARDS}");
        numbers.and_then(|(at, of)| Self::new(at, of)).ok_or_else(expected)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_is_in_exactly_one_shard() {
        for (points, of) in [(0, 3), (1, 3), (10, 3), (12, 4), (5, 64), (1000, 1)] {
            let mut held = vec![0; points];
            for at in 0..of {
                let shard = Shard::new(at, of).unwrap();
                (0..shard.count_points(points)).for_each(|place| held[shard.point_index(place)] += 1);
            }
            assert_eq!(held, vec![1; points], "{points} points in {of} shards");
        }
    }

    #[test]
    fn shards_meet_where_they_share_points() {
        for (a, b) in [(4, 4), (4, 6), (3, 7), (16, 8), (1, 5)] {
            for (i, j) in (0..a).flat_map(|i| (0..b).map(move |j| (i, j))) {
                let (one, two) = (Shard::new(i, a).unwrap(), Shard::new(j, b).unwrap());
                let shared = (0..a * b).any(|index| one.contains(index) && two.contains(index));
                assert_eq!(one.overlaps(two), shared, "{one} and {two}");
            }
        }
    }

    #[test]
    fn a_shard_is_read_as_it_is_written() {
        let shard = Shard::new(3, 64).unwrap();
        assert_eq!("3/64".parse(), Ok(shard));
        assert_eq!(shard.to_string(), "3/64");
        assert_eq!(Shard::from_file_stem("3-of-64"), Some(shard));
        for text in ["", "3", "64/64", "-1/4", "0/0", "1/2/3", "a/b", "0/1000001", "1 / 2"] {
            assert!(text.parse::<Shard>().unwrap_err().contains("such as 3/64"), "{text}");
        }
        assert_eq!(["03-of-64", "3-of-2", "x-of-y", "journal"].map(Shard::from_file_stem), [None; 4]);
    }
}
