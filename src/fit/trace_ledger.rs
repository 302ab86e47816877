//! The ledger of a trace fit: every iterate is made once, and written before it is counted.
//!
//! An iterate follows from the one before and from nothing else, so that a search that was killed goes on
//! with the same bits. At most the iterates that were being made are lost.

use super::error::FitError;
use super::iterates::{Header, Journal, Step};
use super::ledger::Progress;
use super::stage::Stage;
use super::trace::{Branch, Iterate, Keep};
use crate::journal::{Shard, Sink, header_line, line, sample};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::ControlFlow;

/// How far a trace fit has come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TraceProgress {
    /// Number of the chain: that of the start, or of a [`Branch`].
    pub start: usize,
    /// Iterates of all searches so far, those of the journal included.
    pub iterates: usize,
    /// Those of them that were taken from the journal.
    pub replayed: usize,
    /// Number of the stage, from 0.
    pub stage: usize,
    /// Cost of the last iterate.
    pub cost: f64,
    /// Segments that fit worse than noise ever does.
    pub bad_segments: usize,
    /// All segments.
    pub segments: usize,
}

/// The same as of any fit: an iterate counts as an evaluation.
impl From<TraceProgress> for Progress {
    fn from(now: TraceProgress) -> Self {
        let stage = match Branch::of(now.start) {
            None => Stage::Local,
            Some(Branch::Twin(_)) => Stage::Bootstrap,
            Some(Branch::Shorter | Branch::Side { .. }) => Stage::Profile,
        };
        Self { stage, evaluations: now.iterates, replayed: now.replayed, best_cost: now.cost }
    }
}

/// Called with every iterate; `Break` ends the fit, and what was found so far is kept.
pub type OnIterate<'a> = dyn FnMut(&TraceProgress) -> ControlFlow<()> + Send + 'a;

/// Why no more iterates are made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Stopped {
    /// It was asked to stop.
    Interrupted,
    /// As many iterates as were allowed have been made.
    Budget,
    /// The journal cannot be written.
    Journal(String),
    /// A start that other machines make is not there yet.
    Missing,
}

/// Who makes the iterates of a fit.
pub enum Division<'a> {
    /// This run makes all of them.
    Whole,
    /// This run makes those of a shard. All shards need the starts: each takes what others have written by
    /// then, and makes the rest too.
    Shard(Shard, &'a mut Look<'a>),
    /// This run makes none, and writes those of all shards into its own journal.
    Collected(&'a [(&'a str, &'a Journal)]),
}

/// Gives the iterates that other shards have written since it was called last.
pub type Look<'a> = dyn FnMut() -> Vec<Step> + 'a;

/// The iterates of all searches of a trace fit, and where they are written.
pub struct TraceLedger<'a, 'd> {
    journal: &'a mut dyn Sink,
    on_iterate: &'a mut OnIterate<'a>,
    division: Division<'d>,
    /// Iterates of this journal, those of starts also when they were made by this run.
    known: HashMap<(usize, usize), Iterate>,
    /// Iterates of other journals.
    elsewhere: HashMap<(usize, usize), Iterate>,
    /// Lines of the journal.
    lines: usize,
    /// The header of a new journal, until it is written.
    opening: Option<String>,
    /// Iterates by the number of their start.
    counts: BTreeMap<usize, usize>,
    replayed: usize,
    most: usize,
    stopped: Option<Stopped>,
}

impl<'a, 'd> TraceLedger<'a, 'd> {
    /// Searches that go on from a journal, or begin one with this header; `most` is the number of iterates
    /// allowed, those of the journal included. Journals of other shards have been checked.
    ///
    /// # Errors
    /// [`FitError`] when the journal is that of another fit.
    pub fn new(
        header: &Header,
        resume: Option<(&str, &Journal)>,
        (division, most): (Division<'d>, usize),
        journal: &'a mut dyn Sink,
        on_iterate: &'a mut OnIterate<'a>,
    ) -> Result<Self, FitError> {
        if let Some((file, found)) = resume {
            check_seed(file, found.header.body.seed, header.body.seed)?;
            found.check_problem(file, header)?;
        }
        let records = resume.map_or(&[][..], |(_, journal)| &journal.records);
        let known = records.iter().map(placed).collect();
        let mut division = division;
        let elsewhere = match &mut division {
            Division::Whole => HashMap::new(),
            Division::Shard(_, look) => look().iter().map(placed).collect(),
            Division::Collected(journals) => {
                journals.iter().flat_map(|(_, j)| &j.records).map(placed).collect()
            }
        };
        let opening = resume.is_none().then(|| header_line(header));
        let (lines, counts, replayed, stopped) = (records.len(), BTreeMap::new(), 0, None);
        Ok(Self {
            journal,
            on_iterate,
            division,
            known,
            elsewhere,
            lines,
            opening,
            counts,
            replayed,
            most,
            stopped,
        })
    }

    /// Iterates so far, those of the journal included; of a shard those of its own journal.
    #[must_use]
    pub fn iterates(&self) -> usize {
        match self.division {
            Division::Shard(..) => self.lines,
            Division::Whole | Division::Collected(_) => self.counts.values().sum(),
        }
    }

    /// The same of one start, from 0.
    #[must_use]
    pub fn of_start(&self, start: usize) -> usize {
        self.counts.get(&start).copied().unwrap_or(0)
    }

    /// Why nothing more was made.
    #[must_use]
    pub fn stopped(&self) -> Option<&Stopped> {
        self.stopped.as_ref()
    }

    fn count(&mut self, start: usize, iterate: &Iterate) -> ControlFlow<()> {
        *self.counts.entry(start).or_default() += 1;
        let now = TraceProgress {
            start,
            iterates: self.iterates(),
            replayed: self.replayed,
            stage: iterate.stage,
            cost: iterate.cost,
            bad_segments: iterate.segments.iter().filter(|segment| segment.is_bad()).count(),
            segments: iterate.segments.len(),
        };
        (self.on_iterate)(&now)
    }

    fn write(&mut self, (start, step): (usize, usize), iterate: &Iterate) -> Result<(), String> {
        let made = Step { start, step, iterate: iterate.clone() };
        let lines = self.opening.take().unwrap_or_default() + &line(&made, self.lines);
        self.journal.append(&lines)?;
        self.lines += 1;
        Ok(())
    }

    /// An iterate of another journal, which is copied where journals are collected.
    fn known_elsewhere(&mut self, place: (usize, usize)) -> Option<Iterate> {
        if let Division::Shard(_, look) = &mut self.division
            && !self.elsewhere.contains_key(&place)
            && Branch::of(place.0).is_none()
        {
            self.elsewhere.extend(look().iter().map(placed));
        }
        let found = self.elsewhere.get(&place)?.clone();
        if let Division::Collected(_) = self.division
            && let Err(problem) = self.write(place, &found)
        {
            self.stopped.get_or_insert(Stopped::Journal(problem));
        }
        Some(found)
    }

    fn stop(&mut self, why: Stopped) -> ControlFlow<()> {
        self.stopped.get_or_insert(why);
        ControlFlow::Break(())
    }
}

fn placed(step: &Step) -> ((usize, usize), Iterate) {
    ((step.start, step.step), step.iterate.clone())
}

fn check_seed(file: &str, found: u64, expected: u64) -> Result<(), FitError> {
    if found == expected {
        return Ok(());
    }
    Err(FitError::OtherSeed { file: file.to_owned(), found, expected })
}

impl Keep for TraceLedger<'_, '_> {
    fn known(&mut self, start: usize, step: usize) -> Option<Iterate> {
        let place = (start, step);
        let known = match self.known.get(&place) {
            Some(own) => own.clone(),
            None => self.known_elsewhere(place)?,
        };
        self.replayed += 1;
        if self.count(start, &known).is_break() {
            self.stopped.get_or_insert(Stopped::Interrupted); // (the next new iterate is not made any more)
        }
        Some(known)
    }

    fn begins(&self, start: usize) -> bool {
        matches!(&self.division, Division::Shard(shard, _) if shard.holds(start))
    }

    fn makes(&self, chain: usize) -> bool {
        match &self.division {
            Division::Whole => true,
            Division::Shard(shard, _) => shard.holds(chain),
            Division::Collected(_) => false,
        }
    }

    fn add(&mut self, start: usize, step: usize, iterate: &Iterate) -> ControlFlow<()> {
        if let Some(why) = self.stopped.clone() {
            return self.stop(why);
        }
        if let Division::Collected(_) = self.division {
            return self.stop(Stopped::Missing);
        }
        if self.iterates() >= self.most {
            return self.stop(Stopped::Budget);
        }
        if let Err(problem) = self.write((start, step), iterate) {
            return self.stop(Stopped::Journal(problem));
        }
        if let Division::Shard(..) = self.division
            && Branch::of(start).is_none()
        {
            self.known.insert((start, step), iterate.clone());
        }
        match self.count(start, iterate) {
            ControlFlow::Break(()) => self.stop(Stopped::Interrupted),
            ControlFlow::Continue(()) => ControlFlow::Continue(()),
        }
    }
}

/// Makes some iterates of journals again, each from the one before, and compares them to the last bit: a
/// search that is resumed believes none that the model does not give. `next` gives the iterate after one of a
/// chain, and the first one.
///
/// # Errors
/// [`FitError::Journal`] with the line that differs.
pub fn recheck(
    journals: &[(&str, &Journal)],
    next: impl Fn(usize, Option<&Iterate>) -> Option<Iterate>,
) -> Result<(), FitError> {
    let all = || journals.iter().flat_map(|of| of.1.records.iter().enumerate().map(move |at| (of, at)));
    let places: HashMap<(usize, usize), &Iterate> =
        all().map(|(_, (_, step))| ((step.start, step.step), &step.iterate)).collect();
    let count = all().count();
    let seed = journals.first().map_or(0, |(_, journal)| journal.header.body.seed);
    // others each time, as it grows
    let sampled: BTreeSet<usize> = sample(count, seed.wrapping_add(count as u64)).into_iter().collect();
    for ((file, journal), (place, stored)) in
        all().enumerate().filter(|(number, _)| sampled.contains(number)).map(|(_, one)| one)
    {
        let before = stored.step.checked_sub(1).map(|before| places.get(&(stored.start, before)));
        let again = match before {
            None => next(stored.start, None),
            Some(Some(before)) => next(stored.start, Some(before)),
            Some(None) => continue, // (its line was dropped)
        };
        if let Some(iterate) = again {
            journal.check_again(file, place, &Step { iterate, ..stored.clone() })?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
