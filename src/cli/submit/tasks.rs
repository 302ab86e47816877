//! The list of those tasks of an array that are to run.

use std::collections::BTreeSet;
use std::fmt;
use std::str::FromStr;

/// Maximum number of tasks of an array: the default limit of Slurm (MaxArraySize 1001).
pub(crate) const MAX_TASKS: usize = 1000;

/// Numbers of tasks, in ascending order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct TaskList(Vec<usize>);

impl TaskList {
    pub(crate) fn all(shards: usize) -> Self {
        (0..shards).collect()
    }

    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.0.iter().copied()
    }

    pub(crate) fn last(&self) -> Option<usize> {
        self.0.last().copied()
    }
}

/// Makes a list from numbers in any order.
impl FromIterator<usize> for TaskList {
    fn from_iter<I: IntoIterator<Item = usize>>(numbers: I) -> Self {
        Self(numbers.into_iter().collect::<BTreeSet<usize>>().into_iter().collect())
    }
}

/// Formats the numbers as an array list, such as `0,3-5`.
impl fmt::Display for TaskList {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, run) in self.0.chunk_by(|a, b| a + 1 == *b).enumerate() {
            let comma = if place == 0 { "" } else { "," };
            match run {
                [first, .., last] => write!(f, "{comma}{first}-{last}")?,
                [task] => write!(f, "{comma}{task}")?,
                [] => {}
            }
        }
        Ok(())
    }
}

impl FromStr for TaskList {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || format!("expected numbers of tasks from 0 to {}, such as 3,7-12", MAX_TASKS - 1);
        let mut tasks = Vec::new();
        for part in text.split(',') {
            let (first, last) = part.split_once('-').unwrap_or((part, part));
            let (first, last) = parse_task(first).zip(parse_task(last)).ok_or_else(expected)?;
            if first > last {
                return Err(format!("found {part}, expected the smaller number first; {}", expected()));
            }
            tasks.extend(first..=last);
        }
        Ok(tasks.into_iter().collect())
    }
}

fn parse_task(text: &str) -> Option<usize> {
    let digits = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    digits.then(|| text.parse().ok())?.filter(|task| *task < MAX_TASKS)
}

/// Parses the number of shards, for [`clap`].
pub(crate) fn parse_shard_count(text: &str) -> Result<usize, String> {
    crate::cli::args::parse_count(text).ok().filter(|shards| *shards <= MAX_TASKS).ok_or_else(|| {
        format!(
            "expected a whole number from 1 to {MAX_TASKS}, as Slurm takes no longer array; a task does any \
             number of points, and --threads gives it more cores"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_of_tasks_is_read_and_written() {
        let read = |text: &str| text.parse::<TaskList>().map(|tasks| tasks.to_string());
        assert_eq!(read("3,7-12"), Ok("3,7-12".to_owned()));
        assert_eq!(read("12,7-9,8-11,3"), Ok("3,7-12".to_owned()));
        assert_eq!(read("0-1"), Ok("0-1".to_owned()));
        assert_eq!(TaskList::all(64).to_string(), "0-63");
        assert_eq!(TaskList::from_iter([8, 0, 4, 3, 5, 7, 3]).to_string(), "0,3-5,7-8");
        assert_eq!(TaskList::from_iter([]).to_string(), "");
        for text in ["", "a", "3,", "-1", "3-", "1-2-3", "1000", "0-1000", "+3", " 3", "99999999999999999999"]
        {
            assert!(read(text).unwrap_err().contains("such as 3,7-12"), "{text}");
        }
        assert!(read("9-3").unwrap_err().contains("the smaller number first"));
    }

    #[test]
    fn an_array_has_at_most_a_thousand_tasks() {
        assert_eq!(parse_shard_count("1000"), Ok(1000));
        for text in ["0", "1001", "-3", "x"] {
            assert!(parse_shard_count(text).unwrap_err().contains("from 1 to 1000, as Slurm"), "{text}");
        }
    }
}
