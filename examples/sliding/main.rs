//! Compares the speed at which steady sliding of random blades becomes stable, from eigenvalues, with the
//! speed at which perturbations of simulated runs stop growing; and the speed at which the stick-slip cycle
//! ends with the end of chatter in runs whose head becomes faster.
//!
//! `cargo run --release --example sliding -- [BLADES]`

#[path = "../../tests/common/blade.rs"]
#[allow(dead_code)]
mod blade;
mod chatter;
mod growth;

use blade::{Parts, STROKE};
use chatter::simulated_chatter_end;
use growth::simulated_end;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use wiperlab::simulate::scene::Scene;
use wiperlab::stability::cycle_branch::{CycleBranch, CycleEnd};
use wiperlab::stability::speed_intervals::unstable_range;
use wiperlab::stability::steady_sliding::SlideFinder;

/// Highest speed, m/s.
const TOP: f64 = 2.0;

fn main() {
    let count: usize = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(200);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let (mut compared, mut worst, mut stable, mut at_top, mut not_smooth) = (0, 0f64, 0, 0, 0);
    let mut chatter = ChatterCount::default();
    for _ in 0..count {
        let scene = Parts::random(&mut rng).scene(STROKE);
        let intervals = SlideFinder::new(&scene.linkage, 1.0).find_intervals([0.0, TOP], 100);
        chatter.add(&scene, unstable_range(&intervals));
        let Some([_, end]) = unstable_range(&intervals) else {
            stable += 1;
            continue;
        };
        if end >= TOP {
            at_top += 1;
            continue;
        }
        match simulated_end(&scene, [0.97 * end, 1.03 * end]) {
            Some(found) => {
                compared += 1;
                worst = worst.max((found / end - 1.0).abs());
            }
            // a run has a transition, or the blade cannot slide steadily near the end
            None => not_smooth += 1,
        }
    }
    println!("blades {count}: never unstable {stable}, unstable up to {TOP} m/s {at_top}");
    println!(
        "compared {compared}: largest relative difference of the end {worst:.1e}; not comparable {not_smooth}"
    );
    println!("cycles: {chatter:?}");
}

/// Ends of the cycles of the blades, and their comparison with simulated sweeps.
#[derive(Debug, Default)]
struct ChatterCount {
    no_cycle: usize,
    up_to_top: usize,
    undecided: usize,
    folds: usize,
    corners: usize,
    grazing: usize,
    unstable_cycles: usize,
    /// Cycles that lose their stick below their end; a sweep finds the loss of the stick, not the end.
    without_stick: usize,
    compared: usize,
    within_two_percent: usize,
    not_comparable: usize,
    slowest_s: f64,
}

impl ChatterCount {
    fn add(&mut self, scene: &Scene, unstable: Option<[f64; 2]>) {
        let clock = std::time::Instant::now();
        let branch = CycleBranch::from_scene(scene, 1.0, [0.0, TOP], unstable);
        self.slowest_s = self.slowest_s.max(clock.elapsed().as_secs_f64());
        let Some(branch) = branch else {
            self.no_cycle += 1;
            return;
        };
        match branch.end {
            CycleEnd::EndOfRange => self.up_to_top += 1,
            CycleEnd::Undecided => self.undecided += 1,
            CycleEnd::Fold => self.folds += 1,
            CycleEnd::StickLost => self.corners += 1,
            CycleEnd::Grazing => self.grazing += 1,
        }
        let Some(fold) = branch.fold_m_per_s() else {
            println!("{:?} at {:.4} m/s {}", branch.end, branch.end_m_per_s, branch.problem);
            return;
        };
        if !branch.is_stable_below_end() {
            self.unstable_cycles += 1;
            return;
        }
        if !branch.sticks_below_end() {
            self.without_stick += 1;
            return;
        }
        match simulated_chatter_end(scene, &branch) {
            Some(found) => {
                self.compared += 1;
                self.within_two_percent += usize::from((found / fold - 1.0).abs() < 0.02);
                println!("{:?} at {fold:.4} m/s, in sweeps {found:.4} m/s", branch.end);
            }
            None => self.not_comparable += 1,
        }
    }
}
