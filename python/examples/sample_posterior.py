"""The posterior density of a fit, sampled by emcee in two processes.

    python sample_posterior.py [STEPS]

The job fits published frequencies of a simulation; the chains show what they leave open.
"""

from __future__ import annotations

import multiprocessing
import sys
from pathlib import Path

import emcee
import numpy as np
import wiperlab as wl
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[2]


def sampled(steps: int = 200, walkers: int = 16) -> tuple[list[str], NDArray[np.float64], float]:
    """Names of the unknowns, the second half of all chains, and the share of accepted steps."""
    job = wl.Job(ROOT / "fits/published-simulation/job.toml")
    best = np.array([job.result().parameters[name]["estimate"] for name in job.names])
    rng = np.random.default_rng(1)
    start = np.clip(best * (1.0 + 0.01 * rng.standard_normal((walkers, len(best)))), *job.bounds.T)
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        sampler = emcee.EnsembleSampler(walkers, len(best), job.log_posterior, pool=pool)
        sampler._random = np.random.RandomState(1)
        sampler.run_mcmc(start, steps)
    chains = sampler.get_chain(discard=steps // 2, flat=True)
    return job.names, np.asarray(chains), float(np.mean(sampler.acceptance_fraction))


if __name__ == "__main__":
    names, chains, accepted = sampled(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
    print(f"{len(chains)} points, {100 * accepted:.0f} % of the steps accepted")
    for name, (low, middle, high) in zip(names, np.quantile(chains, [0.025, 0.5, 0.975], axis=0).T):
        print(f"{name}: {middle:.4g}, 95 % from {low:.4g} to {high:.4g}")
