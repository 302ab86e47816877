//! Sorting items by a number.

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
}
