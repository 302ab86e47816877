"""What the tests share: the project's own files, and the program."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
import wiperlab as wl

#: The project, whose data, fits and program are compared with.
ROOT = Path(__file__).resolve().parents[2]
#: The program as cargo builds it; without one the tests that compare with it are skipped.
PROGRAM = os.environ.get("WIPERLAB_PROGRAM")
SCENE = ROOT / "data/scenes/actual-blade.toml"
RECORDING = ROOT / "data/actual-blade-twin"
EXPORT = RECORDING / "synthetic-tracker-export.txt"
#: A job on features, and one on traces.
FEATURES = ROOT / "fits/published-simulation/job.toml"
TRACES = ROOT / "fits/actual-blade-twin/job.toml"


@pytest.fixture(scope="session")
def scene() -> wl.Scene:
    return wl.Scene.load(SCENE)


@pytest.fixture(scope="session")
def recording() -> wl.Recording:
    return wl.Recording.load(RECORDING)


def program(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Runs the program that cargo built."""
    if PROGRAM is None:
        pytest.skip("WIPERLAB_PROGRAM does not name the program")
    command = [PROGRAM, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)
