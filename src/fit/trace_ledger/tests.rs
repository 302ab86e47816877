use super::*;
use crate::checkpoint::read_checkpoint;
use crate::fit::trace_checkpoint::tests::{header, iterate};

/// Number of iterates in each chain of a complete search.
const STEPS: usize = 6;
const STARTS: usize = 2;

fn next(before: Option<&Iterate>) -> Option<Iterate> {
    let step = before.map_or(0, |before| 3 * before.stage + before.number + 1);
    (step < STEPS).then(|| iterate(step))
}

/// Result of a search: reason why it stopped, number of iterates that the ledger counts, and number of
/// iterates that were computed.
#[derive(Debug, PartialEq)]
struct SearchTally {
    stopped: Option<TraceStopReason>,
    iterates: usize,
    made: usize,
}

/// Runs the searches of two starts that continue `journal`, in the same way as the real search.
fn searched(journal: &mut String, most: usize, asked_to_stop_at: usize) -> SearchTally {
    let before = journal.clone();
    let found = read_checkpoint::<IterateRecord>("j", &before).unwrap();
    journal.truncate(found.as_ref().map_or(0, |found| found.end.intact_bytes));
    let resume = found.as_ref().map(|found| ("j", found));
    let mut on_iterate = |now: &TraceProgress| {
        if now.iterates == asked_to_stop_at { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let mut ledger = TraceLedger::new(&header(), resume, most, journal, &mut on_iterate).unwrap();
    let mut made = 0;
    'all: for start in 0..STARTS {
        let mut last: Option<Iterate> = None;
        for step in 0.. {
            let known = ledger.find_iterate(start, step);
            let fresh = known.is_none();
            let Some(iterate) = known.or_else(|| next(last.as_ref())) else { break };
            if fresh && ledger.store_iterate(start, step, &iterate).is_break() {
                break 'all;
            }
            made += usize::from(fresh);
            last = Some(iterate);
        }
    }
    SearchTally { stopped: ledger.stop_reason().cloned(), iterates: ledger.count_iterates(), made }
}

const WHOLE: SearchTally = SearchTally { stopped: None, iterates: STARTS * STEPS, made: STARTS * STEPS };

#[test]
fn a_search_that_is_cut_anywhere_goes_on_with_the_same_lines() {
    let mut whole = String::new();
    assert_eq!(searched(&mut whole, usize::MAX, usize::MAX), WHOLE);
    let header = whole.find('\n').unwrap() + 1;
    for cut in (header..whole.len()).step_by(97).chain([whole.len()]) {
        let mut journal = whole[..cut].to_owned();
        let kept = journal.matches('\n').count() - 1;
        let again = searched(&mut journal, usize::MAX, usize::MAX);
        assert_eq!(
            (again, &journal),
            (SearchTally { made: WHOLE.made - kept, ..WHOLE }, &whole),
            "cut at {cut}"
        );
    }
}

#[test]
fn a_search_stops_when_it_is_asked_to_and_extends() {
    let (mut whole, mut stopped) = (String::new(), String::new());
    searched(&mut whole, usize::MAX, usize::MAX);
    assert_eq!(searched(&mut stopped, usize::MAX, 4).stopped, Some(TraceStopReason::Interrupted));
    assert_eq!(stopped.matches('\n').count(), 5, "a line an iterate");
    assert_eq!(searched(&mut stopped, 7, usize::MAX).stopped, Some(TraceStopReason::Budget));
    assert_eq!(stopped.matches('\n').count(), 8);
    assert!(whole.starts_with(&stopped));
    assert_eq!((searched(&mut stopped, usize::MAX, usize::MAX).iterates, stopped), (WHOLE.iterates, whole));
}

#[test]
fn a_journal_that_cannot_be_written_ends_the_search() {
    struct Full;
    impl CheckpointSink for Full {
        fn append(&mut self, _: &str) -> Result<(), String> {
            Err("no space".to_owned())
        }
    }
    let (mut full, mut on_iterate) = (Full, |_: &TraceProgress| ControlFlow::Continue(()));
    let mut ledger = TraceLedger::new(&header(), None, usize::MAX, &mut full, &mut on_iterate).unwrap();
    assert!(ledger.store_iterate(0, 0, &iterate(0)).is_break());
    assert_eq!(
        (ledger.stop_reason(), ledger.count_iterates()),
        (Some(&TraceStopReason::Journal("no space".to_owned())), 0)
    );
}

#[test]
fn an_iterate_that_the_model_does_not_give_is_refused() {
    let mut whole = String::new();
    searched(&mut whole, usize::MAX, usize::MAX);
    let journal = read_checkpoint::<IterateRecord>("j", &whole).unwrap().unwrap();
    assert_eq!(recheck_iterates("j", &journal, |_, before| next(before)), Ok(()));
    let other =
        |before: Option<&Iterate>| next(before).map(|found| Iterate { cost: found.cost + 1e-9, ..found });
    let refused = recheck_iterates("j", &journal, |_, before| other(before)).unwrap_err().to_string();
    assert!(refused.contains("cost"), "{refused}");
}

#[test]
fn a_journal_of_another_seed_is_refused() {
    let mut whole = String::new();
    searched(&mut whole, usize::MAX, usize::MAX);
    let journal = read_checkpoint::<IterateRecord>("j", &whole).unwrap().unwrap();
    let mut other = header();
    other.body.seed += 1;
    let (mut sink, mut on_iterate) = (String::new(), |_: &TraceProgress| ControlFlow::Continue(()));
    let refused = TraceLedger::new(&other, Some(("j", &journal)), 9, &mut sink, &mut on_iterate);
    assert!(matches!(refused.err(), Some(FitError::OtherSeed { found: 3, expected: 4, .. })));
}
