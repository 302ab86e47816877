"""Points a second of `simulate_many` and of `wiperlab sweep`, in pairs, and of both over the number of threads.

    python compare_speed.py [PAIRS]

The study is the flip of the actual blade on a grid of 40 by 40, read from a temporary folder. A pair runs one
after the other, in turn first, so that a slow machine slows both; the median of their ratios is printed. The time
of the program has its start and the writing of its files in it.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import wiperlab as wl

ROOT = Path(__file__).resolve().parents[2]
NAMES = ["drive.amplitude_m", "friction.c"]
RANGES = [(0.02, 0.06), (0.1, 0.5)]
POINTS = 40


def study(folder: Path) -> Path:
    """The study with more points, its scene named from anywhere."""
    text = (ROOT / "data/sweeps/flip.toml").read_text(encoding="utf-8").replace("points = 17", f"points = {POINTS}")
    path = folder / "study.toml"
    path.write_text(text.replace("../scenes", (ROOT / "data/scenes").as_posix()), encoding="utf-8")
    return path


def seconds(pairs: int, threads: int, folder: Path) -> tuple[list[float], list[float]]:
    """Times of both, s."""
    path, scene = study(folder), wl.Scene.load(ROOT / "data/scenes/actual-blade.toml")
    axes = [np.linspace(low, high, POINTS) for low, high in RANGES]
    X = np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=1)

    def here() -> None:
        wl.simulate_many(scene, NAMES, X, read=path, workers=threads)

    def program() -> None:
        wl.run("sweep", path, "--out", folder / "out", "--threads", str(threads), "--force")

    times: dict[str, list[float]] = {"here": [], "program": []}
    for pair in range(pairs):
        for name, call in sorted({"here": here, "program": program}.items(), reverse=pair % 2 == 1):
            start = time.perf_counter()
            call()
            times[name].append(time.perf_counter() - start)
    return times["here"], times["program"]


if __name__ == "__main__":
    pairs = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    alone: dict[str, float] = {}
    for threads in [1, 2]:
        with tempfile.TemporaryDirectory() as folder:
            here, program = seconds(pairs, threads, Path(folder))
        ratio = statistics.median(a / b for a, b in zip(here, program))
        middle = {"simulate_many": statistics.median(here), "wiperlab sweep": statistics.median(program)}
        for name, took in middle.items():
            alone.setdefault(name, took)
            times_faster = alone[name] / took
            print(f"{threads} threads, {name}: {POINTS**2 / took:.0f} points/s, {times_faster:.2f} times one thread")
        print(f"{threads} threads, time of simulate_many over that of wiperlab sweep: {ratio:.3f}")
