use super::*;
use crate::checkpoint::read_checkpoint;
use crate::fit::checkpoint::tests::{iterate, trace_header};

/// Number of iterates in each chain of a complete search.
const STEPS: usize = 6;
const STARTS: usize = 2;

fn next(before: Option<&Iterate>) -> Option<Iterate> {
    let step = before.map_or(0, |before| 3 * before.stage + before.number + 1);
    (step < STEPS).then(|| iterate(step))
}

/// Result of a search: reason why it stopped, number of iterates that the journal counts, and number of
/// iterates that were computed.
#[derive(Debug, PartialEq)]
struct SearchTally {
    stopped: Option<StopReason>,
    iterates: usize,
    made: usize,
}

/// Runs the searches of two starts that continue the text of a journal; `compute` makes the iterates.
fn searched_with(
    text: &mut String,
    (most, asked_to_stop_at): (Option<usize>, usize),
    compute: fn(Option<&Iterate>) -> Option<Iterate>,
) -> SearchTally {
    let before = text.clone();
    let found = read_checkpoint::<FitRecord>("j", &before).unwrap();
    text.truncate(found.as_ref().map_or(0, |found| found.end.intact_bytes));
    let resume = found.as_ref().map(|found| ("j", found));
    let context = FitContext { fingerprint: "f", version: "1", max_evaluations: most, resume };
    let mut replayed = 0;
    let mut on_progress = |now: &FitProgress| {
        replayed = now.replayed;
        let stop = now.evaluations == asked_to_stop_at;
        if stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let mut journal = Journal::new(&context, trace_header(), text, &mut on_progress).unwrap();
    let mut stopped = None;
    for chain in 0..STARTS {
        let mut last: Option<Iterate> = None;
        for step in 0.. {
            match journal
                .compute_iterates(&[(chain, step)], &|_| compute(last.as_ref()), &|_, _| String::new())
            {
                Ok(made) if made.is_empty() => break,
                Ok(made) => last = made.into_iter().next(),
                Err(stop) => {
                    stopped.get_or_insert(stop);
                    break;
                }
            }
        }
    }
    let iterates = journal.count_evaluations();
    SearchTally { stopped, iterates, made: iterates - replayed }
}

fn searched(text: &mut String, most: Option<usize>, asked_to_stop_at: usize) -> SearchTally {
    searched_with(text, (most, asked_to_stop_at), next)
}

const WHOLE: SearchTally = SearchTally { stopped: None, iterates: STARTS * STEPS, made: STARTS * STEPS };

#[test]
fn a_search_that_is_cut_anywhere_goes_on_with_the_same_lines() {
    let mut whole = String::new();
    assert_eq!(searched(&mut whole, None, usize::MAX), WHOLE);
    let header = whole.find('\n').unwrap() + 1;
    for cut in (header..whole.len()).step_by(97).chain([whole.len()]) {
        let mut journal = whole[..cut].to_owned();
        let kept = journal.matches('\n').count() - 1;
        let again = searched(&mut journal, None, usize::MAX);
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
    searched(&mut whole, None, usize::MAX);
    assert_eq!(searched(&mut stopped, None, 4).stopped, Some(StopReason::Interrupted));
    assert_eq!(stopped.matches('\n').count(), 5, "a line an iterate");
    assert_eq!(searched(&mut stopped, Some(7), usize::MAX).stopped, Some(StopReason::Budget));
    assert_eq!(stopped.matches('\n').count(), 8);
    assert!(whole.starts_with(&stopped));
    assert_eq!((searched(&mut stopped, None, usize::MAX).iterates, stopped), (WHOLE.iterates, whole));
}

#[test]
fn a_journal_that_cannot_be_written_ends_the_search() {
    struct Full;
    impl CheckpointSink for Full {
        fn append(&mut self, _: &str) -> Result<(), String> {
            Err("no space".to_owned())
        }
    }
    let (mut full, mut on_progress) = (Full, |_: &FitProgress| ControlFlow::Continue(()));
    let mut journal =
        Journal::new(&FitContext::default(), trace_header(), &mut full, &mut on_progress).unwrap();
    assert!(journal.compute_iterates(&[(0, 0)], &|_| next(None), &|_, _| String::new()).is_err());
    assert_eq!(journal.count_evaluations(), 0);
    assert_eq!(journal.check_sound(), Err(FitError::JournalWrite { problem: "no space".to_owned() }));
}

#[test]
fn an_iterate_that_the_model_does_not_give_is_refused() {
    let mut text = String::new();
    searched(&mut text, None, usize::MAX);
    assert_eq!(searched(&mut text, None, usize::MAX).stopped, None);
    let other =
        |before: Option<&Iterate>| next(before).map(|found| Iterate { cost: found.cost + 1e-9, ..found });
    let refused = searched_with(&mut text, (None, usize::MAX), other).stopped;
    assert!(
        matches!(&refused, Some(StopReason::Refused(error)) if error.to_string().contains("cost")),
        "{refused:?}"
    );
}

#[test]
fn a_journal_of_another_seed_is_refused() {
    let mut text = String::new();
    searched(&mut text, None, usize::MAX);
    let journal = read_checkpoint::<FitRecord>("j", &text).unwrap().unwrap();
    let context =
        FitContext { fingerprint: "f", version: "1", max_evaluations: None, resume: Some(("j", &journal)) };
    let header = FitHeader { seed: 4, ..trace_header() };
    let (mut sink, mut on_progress) = (String::new(), |_: &FitProgress| ControlFlow::Continue(()));
    let refused = Journal::new(&context, header, &mut sink, &mut on_progress).err();
    assert!(matches!(refused, Some(FitError::OtherSeed { found: 3, expected: 4, .. })));
}
