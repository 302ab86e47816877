"""Sobol indices of what a run shows, by SALib: which parameter decides the flip's duration, and the damping?

    python sobol_indices.py [N]

takes N base points (256 if left out): N (2 D + 2) runs. Runs without a value are counted, and replaced by the
median of the others, as SALib needs a value for every point.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import wiperlab as wl
from SALib.analyze import sobol
from SALib.sample import sobol as sample

ROOT = Path(__file__).resolve().parents[2]
NAMES = ["friction.a", "friction.c", "drive.amplitude_m"]
PROBLEM = {"num_vars": len(NAMES), "names": NAMES, "bounds": [[0.08, 0.14], [0.25, 0.35], [0.03, 0.05]]}
READ = [{"name": "stick fraction", "kind": "stick-fraction"}, {"name": "flip duration", "kind": "flip-duration"}]


def indices(base: int = 256) -> dict[str, dict[str, float]]:
    """Total indices of every reading by parameter, and the share of the runs without a value."""
    scene = wl.Scene.load(ROOT / "data/scenes/actual-blade.toml")
    X = sample.sample(PROBLEM, base, seed=1)
    Y, status = wl.simulate_many(scene, NAMES, X, read=READ)
    endings, counts = np.unique(status, return_counts=True)
    print("runs:", dict(zip(endings.tolist(), counts.tolist())))
    found = {}
    for values, reading in zip(Y.T, READ):
        missing = np.isnan(values)
        filled = np.where(missing, np.nanmedian(values), values)
        total = sobol.analyze(PROBLEM, filled, seed=1)["ST"]
        found[reading["name"]] = {**dict(zip(NAMES, total.tolist())), "missing": float(missing.mean())}
    return found


if __name__ == "__main__":
    for name, of in indices(int(sys.argv[1]) if len(sys.argv) > 1 else 256).items():
        print(f"{name}: " + ", ".join(f"{key} {value:.3f}" for key, value in of.items()))
