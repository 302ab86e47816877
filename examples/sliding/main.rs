//! Compares the speed at which steady sliding of random blades becomes stable, from eigenvalues, with the
//! speed at which perturbations of simulated runs stop growing and with the start of chatter in runs whose
//! head becomes slower; and the speed at which the stick-slip cycle ends with the end of chatter in runs
//! whose head becomes faster.
//!
//! `cargo run --release --example sliding -- [BLADES]`

#[path = "../../tests/common/blade.rs"]
#[allow(dead_code)]
mod blade;
mod chatter;
mod growth;

use blade::{Parts, STROKE};
use chatter::{simulated_chatter_end, simulated_chatter_start};
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
    let (mut stable, mut at_top) = (0, 0);
    let (mut growth, mut start, mut end) =
        (Comparison::default(), Comparison::default(), Comparison::default());
    let mut chatter = ChatterCount::default();
    for _ in 0..count {
        let scene = Parts::random(&mut rng).scene(STROKE);
        let intervals = SlideFinder::new(&scene.linkage, 1.0).find_intervals([0.0, TOP], 100);
        chatter.add(&scene, unstable_range(&intervals), &mut end);
        match unstable_range(&intervals) {
            None => stable += 1,
            Some([_, end]) if end >= TOP => at_top += 1,
            Some([_, end]) => {
                // not comparable if a run has a transition or no steady sliding is found near the end
                growth.add("perturbations grow up to", end, simulated_end(&scene, [0.97 * end, 1.03 * end]));
                start.add("chatter starts at", end, simulated_chatter_start(&scene, end));
            }
        }
    }
    println!("blades {count}: never unstable {stable}, unstable up to {TOP} m/s {at_top}");
    println!("end of the instability against perturbations: {growth:?}");
    println!("end of the instability against the start of chatter in sweeps down: {start:?}");
    println!("end of the cycle against the end of chatter in sweeps up: {end:?}");
    println!("cycles: {chatter:?}");
}

/// Computed speeds against those of simulated runs.
#[derive(Debug, Default)]
struct Comparison {
    compared: usize,
    within_two_percent: usize,
    /// Largest relative difference.
    worst: f64,
    /// Speeds that the runs do not give.
    not_comparable: usize,
}

impl Comparison {
    fn add(&mut self, what: &str, computed: f64, simulated: Option<f64>) {
        let Some(simulated) = simulated else {
            self.not_comparable += 1;
            return;
        };
        let difference = (simulated / computed - 1.0).abs();
        self.compared += 1;
        self.within_two_percent += usize::from(difference < 0.02);
        self.worst = self.worst.max(difference);
        if difference >= 0.02 {
            println!("{what} {simulated:.4} m/s in runs, computed {computed:.4} m/s");
        }
    }
}

/// Ends of the cycles of the blades.
#[derive(Debug, Default)]
struct ChatterCount {
    no_cycle: usize,
    up_to_top: usize,
    undecided: usize,
    folds: usize,
    corners: usize,
    grazing: usize,
    /// Cycles that are unstable below their end, which no run follows.
    unstable_cycles: usize,
    /// Cycles that lose their stick below their end.
    without_stick: usize,
    slowest_s: f64,
}

impl ChatterCount {
    fn add(&mut self, scene: &Scene, unstable: Option<[f64; 2]>, ends: &mut Comparison) {
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
        let Some(end) = branch.fold_m_per_s() else {
            println!("{:?} at {:.4} m/s {}", branch.end, branch.end_m_per_s, branch.problem);
            return;
        };
        self.without_stick += usize::from(!branch.sticks_below_end());
        if branch.is_stable_below_end() {
            ends.add("chatter ends at", end, simulated_chatter_end(scene, &branch));
        } else {
            self.unstable_cycles += 1;
        }
    }
}
