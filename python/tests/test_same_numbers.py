"""The numbers are those of the program, bit for bit."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import wiperlab as wl
from conftest import RECORDING, ROOT, SCENE, TRACES, program


def table(path: Path) -> dict[str, list[str]]:
    rows = list(csv.reader(path.open(encoding="utf-8")))
    return {name: list(column) for name, column in zip(rows[0], zip(*rows[1:]))}


def assert_same(column: np.ndarray, cells: list[str]) -> None:
    assert len(column) == len(cells) > 10
    for value, cell in zip(column, cells):
        assert (cell == "" and np.isnan(value)) or float(cell) == value


def test_a_run(scene: wl.Scene, tmp_path: Path) -> None:
    assert program("simulate", SCENE, "--out", tmp_path).returncode == 0
    motion = wl.simulate(scene, predict_errors=True)
    for name in ["state.csv", "trace.csv"]:
        for column, cells in table(tmp_path / name).items():
            if column == "mode":
                assert list(motion.mode) == cells
            else:
                assert_same(motion[column], cells)
    events = table(tmp_path / "events.csv")
    assert len(events["time_s"]) == 380
    assert_same(motion.events["time_s"], events["time_s"])
    predicted = [float(cell) for cell in events["predicted_time_error_s"]]
    assert np.allclose(motion.events["predicted_time_error_s"], predicted, rtol=1e-2, atol=0.0)
    assert "undetermined_after_s" not in wl.simulate(scene).summary
    for column in ["from", "to", "cause"]:
        assert list(motion.events[column]) == events[column]
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert {**motion.summary, "wall_s": 0} == {**summary, "wall_s": 0}


def test_a_study(tmp_path: Path) -> None:
    study = ROOT / "data/sweeps/flip.toml"
    axes = {"drive.amplitude_m": (0.02, 0.06), "friction.c": (0.1, 0.5)}
    text = study.read_text(encoding="utf-8").replace("points = 17", "points = 3")
    text = text.replace("../scenes/actual-blade.toml", str(SCENE))
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    done = program("sweep", tmp_path / "study.toml", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    rows = table(tmp_path / "out/sweep.csv")
    X = np.array([[float(cell) for cell in rows[name]] for name in axes]).T
    assert len(X) == 9
    Y, status = wl.simulate_many(wl.Scene.load(SCENE), list(axes), X, read=tmp_path / "study.toml")
    columns = [name for name in rows if name not in (*axes, "status", "stopped_at_s", "missing", "source")]
    assert Y.shape == (9, len(columns))
    for value, name in zip(Y.T, columns):
        for found, cell in zip(value, rows[name]):
            assert (cell == "" and np.isnan(found)) or float(cell) == found
    assert list(status) == rows["status"]
    for workers in [1, 2]:
        again, _ = wl.simulate_many(
            wl.Scene.load(SCENE), list(axes), X, read=tmp_path / "study.toml", workers=workers
        )
        assert again.tobytes() == Y.tobytes()


def test_a_spectrum(recording: wl.Recording, tmp_path: Path) -> None:
    done = program("spectrum", RECORDING, "--channel", "head-drop", "--window", "after", "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    found = wl.spectrum(recording, "head-drop", "after")
    written = json.loads((tmp_path / "components.json").read_text())
    assert {"components": found.components, "cycles": found.cycles} == written
    assert abs(found.components[0]["frequency_hz"] - 74.8) < 1.0
    for name, cells in table(tmp_path / "spectrum.csv").items():
        assert_same(found.columns[name], cells)
    for name, figure in found.figures.items():
        assert figure.svg == (tmp_path / f"{name}.svg").read_text(encoding="utf-8")


def test_a_result() -> None:
    result = wl.Job(TRACES).result()
    assert dict(result) == json.loads((TRACES.parent / "result.json").read_text())


def test_the_version() -> None:
    assert program("--version").stdout.split()[1] == wl.__version__
