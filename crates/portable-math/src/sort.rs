//! Sorting items by a number, and selecting a number by its rank.

/// Sorts items by a key, the smallest first, in the order of [`f64::total_cmp`]. Items with equal keys keep
/// their order. The negative of a key reverses the order.
///
/// Only one copy of the sort is compiled for all types of items, which keeps the program small.
///
/// ```
/// let mut lengths_m = [("long", 2.0), ("short", 0.5)];
/// portable_math::sort_by_number(&mut lengths_m, |length| length.1);
/// assert_eq!(lengths_m[0].0, "short");
/// ```
pub fn sort_by_number<T>(items: &mut [T], number: impl Fn(&T) -> f64) {
    for (a, b) in find_swaps(&items.iter().map(number).collect::<Vec<f64>>()) {
        items.swap(a, b);
    }
}

/// The swaps that sort `numbers`, in order.
fn find_swaps(numbers: &[f64]) -> Vec<(usize, usize)> {
    let mut from: Vec<usize> = (0..numbers.len()).collect();
    from.sort_by(|&a, &b| numbers[a].total_cmp(&numbers[b]));
    let mut swaps = Vec::new();
    for start in 0..from.len() {
        let mut place = start;
        while from[place] != start {
            let next = from[place];
            swaps.push((place, next));
            from[place] = place;
            place = next;
        }
        from[place] = place;
    }
    swaps
}

/// Number of values of the sample from which [`select_number`] guesses the place of a rank.
const SAMPLE: usize = 4096;
/// Number of values of the sorted sample on either side of the guess between which the rank is looked for:
/// four standard deviations of the rank of a sampled median.
const MARGIN: usize = 128;
/// Number of values that are compared at once.
const BLOCK: usize = 512;

/// The value with the given rank (0 is the smallest) in the order of [`f64::total_cmp`]; `values` may be
/// reordered.
///
/// The result is that of `select_nth_unstable_by`. Of many values, only those near the value with this rank
/// in a sample are compared with each other.
///
/// # Panics
/// If there are no more than `rank` values.
///
/// ```
/// assert_eq!(portable_math::select_number(&mut [3.0, -1.0, 2.0], 1), 2.0);
/// ```
pub fn select_number(values: &mut [f64], rank: usize) -> f64 {
    let selected = if values.len() < 8 * SAMPLE { None } else { select_by_sample(values, rank) };
    selected.unwrap_or_else(|| *values.select_nth_unstable_by(rank, f64::total_cmp).1)
}

/// The value with the given rank; `None` if the sample misleads, or if the value is not a number.
fn select_by_sample(values: &[f64], rank: usize) -> Option<f64> {
    let mut sample: Vec<f64> = values.iter().step_by(values.len() / SAMPLE).copied().collect();
    sample.sort_unstable_by(f64::total_cmp);
    let guess = (rank as f64 / values.len() as f64 * sample.len() as f64) as usize;
    let low = guess.checked_sub(MARGIN).and_then(|at| sample.get(at)).copied().unwrap_or(f64::NEG_INFINITY);
    let high = sample.get(guess + MARGIN).copied().unwrap_or(f64::INFINITY);
    let (mut below, mut between) = (0, Vec::with_capacity(values.len() * 4 * MARGIN / SAMPLE));
    // (without branches in its loops, a block takes a fraction of the time; what is no number is between)
    for block in values.chunks(BLOCK) {
        below += block.iter().map(|value| usize::from(*value < low)).sum::<usize>();
        let (mut kept, mut count) = ([0.0; BLOCK], 0);
        for value in block {
            kept[count % BLOCK] = *value;
            count += usize::from(!(*value < low || *value > high));
        }
        between.extend_from_slice(&kept[..count]);
    }
    let within = rank.checked_sub(below).filter(|within| *within < between.len())?;
    let selected = *between.select_nth_unstable_by(within, f64::total_cmp).1;
    (!selected.is_nan()).then_some(selected)
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};

    use super::*;

    #[test]
    fn items_are_sorted_as_the_stable_sort_does() {
        let mut draws = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(3);
        let special = [0.0, -0.0, f64::NAN, -f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
        for count in 0..60 {
            let draw = |i| match draws.random_range(0..20) {
                at @ 0..6 => (special[at], i),
                number => (number as f64, i), // many are equal
            };
            let items: Vec<(f64, usize)> = (0..count).map(draw).collect();
            let places = |items: &[(f64, usize)]| items.iter().map(|item| item.1).collect::<Vec<usize>>();
            let (mut ours, mut theirs) = (items.clone(), items);
            sort_by_number(&mut ours, |item| item.0);
            theirs.sort_by(|a, b| a.0.total_cmp(&b.0));
            assert_eq!(places(&ours), places(&theirs));
            sort_by_number(&mut ours, |item| -item.0);
            theirs.sort_by(|a, b| b.0.total_cmp(&a.0));
            assert_eq!(places(&ours), places(&theirs));
        }
    }

    #[test]
    fn a_number_is_selected_as_the_standard_library_does() {
        let mut draws = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(5);
        let special = [0.0, -0.0, f64::NAN, -f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0];
        for count in [1, 2, 3, 40, 40_000, 100_000] {
            let random: Vec<f64> = (0..count).map(|_| draws.random::<f64>() - 0.5).collect();
            let few = (0..count).map(|_| special[draws.random_range(0..special.len())]).collect();
            // (every value of the sample has the same remainder)
            let misleading =
                (0..count).map(|i| if i % (count / SAMPLE).max(1) == 0 { 9.0 } else { i as f64 });
            for values in [random, few, misleading.collect::<Vec<f64>>()] {
                for rank in [0, count / 100, count / 2, count - 1] {
                    let expected = *values.clone().select_nth_unstable_by(rank, f64::total_cmp).1;
                    assert_eq!(select_number(&mut values.clone(), rank).to_bits(), expected.to_bits());
                }
            }
        }
    }
}
