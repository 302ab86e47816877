"""What users of Python expect: exceptions, threads, forks, pickles, Ctrl-C, notebooks."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import wiperlab as wl
from conftest import EXPORT, FEATURES, SCENE, TRACES, program


def test_bad_input_has_the_words_of_the_program(tmp_path: Path) -> None:
    text = SCENE.read_text(encoding="utf-8").replace("[friction]", "[frictoin]")
    wrong = tmp_path / "scene.toml"
    wrong.write_text(text, encoding="utf-8")
    with pytest.raises(wl.InputError) as refused:
        wl.Scene.load(wrong)
    said = program("simulate", wrong, "--out", tmp_path / "out").stderr
    assert said.splitlines()[0].removeprefix("error: ") == str(refused.value).splitlines()[0]
    assert "frictoin" in str(refused.value) and str(wrong) in str(refused.value)


def test_a_missing_file_is_also_the_usual_exception() -> None:
    for read in [wl.Scene.load, wl.Recording.load, wl.Job, wl.FitResult.load]:
        with pytest.raises(FileNotFoundError, match="nowhere"):
            read("nowhere/file.toml")
        with pytest.raises(ValueError):
            read("nowhere/file.toml")


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda s: s.replace({"friction.q": 1.0}), "friction.q"),
        (lambda s: s.replace({"friction.a": -1.0}), "friction.a"),
        (lambda s: s.replace({"friction.a": float("nan")}), "friction.a"),
        (lambda s: wl.simulate(s, [0.2, 0.1]), "rising"),
        (lambda s: wl.simulate(s, [[0.2]]), "rising"),
        (lambda s: wl.simulate_many(s, ["friction.q"], [[1.0]]), "friction.q"),
        (lambda s: wl.simulate_many(s, ["friction.a"], [[1.0, 2.0]]), "2 columns, expected 1"),
        (lambda s: wl.simulate_many(s, ["friction.a"], [1.0]), "dimensions"),
        (lambda s: wl.simulate_many(s, ["friction.a"], [[0.2]], workers=0), "workers"),
        (lambda s: wl.simulate_many(s, ["friction.a"], [[0.2]], read=[{"name": "x", "kind": "y"}]), "kind"),
        (lambda s: wl.simulate_many(s, ["friction.a"], [[0.2]], read=[]), "map"),
        (lambda s: wl.spectrum([1.0, 2.0, 3.0]), "frame_rate_hz"),
        (lambda s: wl.spectrum(np.zeros(3), frame_rate_hz=1000.0), "found 3 frames"),
        (lambda s: wl.spectrum(np.zeros(100), frame_rate_hz=-1.0), "frame_rate_hz"),
        (lambda s: wl.Recording.from_arrays({"tip": [1.0]}, 100.0), "tip"),
        (lambda s: wl.Recording.from_arrays({"tip_x_m": [1.0, 2.0], "head_x_m": [1.0]}, 100.0), "head_x_m"),
        (lambda s: wl.Job(TRACES).log_posterior([1.0]), "friction.a"),
        (lambda s: wl.run("simulate", "nowhere.toml", "--out", "x"), "nowhere.toml"),
    ],
)
def test_refusals_say_what_was_found(scene: wl.Scene, call: object, says: str) -> None:
    with pytest.raises(wl.InputError, match=says):
        call(scene)  # type: ignore[operator]


def test_a_value_that_a_scene_refuses_is_an_outcome(scene: wl.Scene) -> None:
    Y, status = wl.simulate_many(scene, ["friction.a"], [[0.2], [-1.0], [np.nan], [0.3]])
    assert list(status) == ["completed", "no-start", "no-start", "completed"]
    assert np.isnan(Y[1:3]).all() and np.isfinite(Y[[0, 3]]).all()


def test_no_points_give_no_rows(scene: wl.Scene) -> None:
    Y, status = wl.simulate_many(scene, ["friction.a"], np.empty((0, 1)))
    assert Y.shape == (0, 4) and status.shape == (0,)


def test_everything_can_be_pickled(scene: wl.Scene, recording: wl.Recording) -> None:
    other = scene.replace({"friction.a": 0.3})
    assert pickle.loads(pickle.dumps(other)) == other != scene
    assert pickle.loads(pickle.dumps(recording)) == recording
    assert pickle.loads(pickle.dumps(recording)).is_synthetic
    job = pickle.loads(pickle.dumps(wl.Job(FEATURES)))
    assert job.names == wl.Job(FEATURES).names
    motion = pickle.loads(pickle.dumps(wl.simulate(scene)))
    assert motion.tip_x_m.tobytes() == wl.simulate(scene).tip_x_m.tobytes()


def test_a_job_that_changed_meanwhile_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / "fits/a"
    folder.mkdir(parents=True)
    text = FEATURES.read_text(encoding="utf-8")
    root = FEATURES.parents[2]
    text = text.replace("../../data", (root / "data").as_posix())
    (folder / "job.toml").write_text(text, encoding="utf-8")
    pickled = pickle.dumps(wl.Job(folder / "job.toml"))
    (folder / "job.toml").write_text(text.replace("upper = 0.8", "upper = 0.7"), encoding="utf-8")
    with pytest.raises(wl.InputError, match="changed"):
        pickle.loads(pickled)


def ran(scene: wl.Scene) -> bytes:
    Y, _ = wl.simulate_many(scene, ["friction.a"], [[0.2], [0.3]])
    return Y.tobytes() + wl.simulate(scene).tip_x_m.tobytes()


@pytest.mark.parametrize("method", multiprocessing.get_all_start_methods())
def test_processes(scene: wl.Scene, method: str) -> None:
    expected = ran(scene)  # (so that a fork has threads to lose)
    with multiprocessing.get_context(method).Pool(2) as pool:
        assert pool.map(ran, [scene] * 3) == [expected] * 3


def test_threads_go_on_meanwhile(scene: wl.Scene) -> None:
    expected, found, ticks = ran(scene), [], 0
    threads = [threading.Thread(target=lambda: found.append(ran(scene))) for _ in range(4)]
    points = np.linspace(0.1, 0.5, 400).reshape(-1, 1)
    many = threading.Thread(target=wl.simulate_many, args=(scene, ["friction.a"], points))
    many.start()
    for thread in threads:
        thread.start()
    while many.is_alive():
        ticks += 1
        time.sleep(0.001)
    for thread in threads:
        thread.join()
    assert found == [expected] * 4
    assert ticks > 20


LONG = """
    import time, numpy as np, wiperlab as wl
    scene = wl.Scene.load({scene!r})
    points = np.linspace(0.1, 0.5, 1_000_000).reshape(-1, 1)
    print("ready", flush=True)
    try:
        wl.simulate_many(scene, ["friction.a"], points)
    except KeyboardInterrupt:
        print("interrupted", flush=True)
"""


LONG_SIGNAL = """
    import numpy as np, wiperlab as wl
    samples = 1e-5 * np.random.default_rng(1).standard_normal(3_000_000)
    print("ready", flush=True)
    try:
        wl.spectrum(samples, frame_rate_hz=5000.0)
    except KeyboardInterrupt:
        print("interrupted", flush=True)
"""


@pytest.mark.skipif(os.name == "nt", reason="signals of another kind")
@pytest.mark.parametrize("code", [LONG.format(scene=str(SCENE)), LONG_SIGNAL], ids=["runs", "spectrum"])
def test_ctrl_c_ends_what_takes_long_within_a_second(code: str) -> None:
    code = textwrap.dedent(code)
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "ready\n"
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    asked = time.monotonic()
    said, _ = process.communicate(timeout=30)
    assert said == "interrupted\n"
    assert time.monotonic() - asked < 1.0
    assert process.returncode == 0


@pytest.mark.skipif(os.name == "nt", reason="signals of another kind")
def test_ctrl_c_keeps_the_journal_of_a_fit(tmp_path: Path) -> None:
    text = FEATURES.read_text(encoding="utf-8").replace("../../data", (FEATURES.parents[2] / "data").as_posix())
    (tmp_path / "job.toml").write_text(text, encoding="utf-8")
    code = f"import wiperlab as wl\nwl.Job({str(tmp_path / 'job.toml')!r}).fit()"
    process = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True)
    journal = tmp_path / "journal.jsonl"
    patience = time.monotonic() + 60
    while not (journal.exists() and journal.read_bytes().count(b"\n") > 5) and time.monotonic() < patience:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=30)
    assert "KeyboardInterrupt" in said and process.returncode != 0
    assert journal.read_bytes().count(b"\n") > 5 and not (tmp_path / "result.json").exists()


def test_the_program_comes_along(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-m", "wiperlab", "--version"], capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.split()[:2] == ["wiperlab", wl.__version__]
    options = ["--frame-rate-hz", "5000", "--scale", "20um/px", "--y-axis", "up"]
    points = ["--point", "tip=synthetic tip", "--point", "head=synthetic head"]
    assert wl.run("import", EXPORT, "--out", tmp_path / "run", options, points) == 0
    assert wl.Recording.load(tmp_path / "run").frame_rate_hz == 5000.0


def test_a_notebook_shows_the_verdict_of_the_page() -> None:
    fit = Path(__file__).parents[2] / "fits"
    explained = wl.FitResult.load(fit / "actual-blade-twin")
    assert explained.explained and explained.verdict[0].startswith("The model explains the recording")
    assert explained.chatter is not None and explained.chatter["part"] == "neck on the shoulder"
    assert explained.law is not None and explained.law["verdict"] == "preferred"
    assert explained.verdict[0] in explained._repr_html_().replace("&#x27;", "'")
    published = wl.FitResult.load(fit / "published-simulation")
    assert published.verdict == ["The model meets all 3 targets"] and isinstance(published.findings, list)


def test_what_a_notebook_shows_is_escaped(recording: wl.Recording) -> None:
    name = "<script>alert(1)</script>"
    named = wl.Recording.from_arrays(recording.columns, recording.frame_rate_hz, name=name, synthetic=True)
    found = wl.spectrum(named, "head-drop", "after")
    for shown in [named._repr_html_(), found._repr_html_(), found._repr_svg_() or ""]:
        assert "<script" not in shown
    assert "synthetic" in named._repr_html_()
    assert (found._repr_svg_() or "").startswith("<svg")


def test_masked_values_are_missing() -> None:
    column = np.ma.masked_array([1, 2, 3], mask=[False, True, False])
    recording = wl.Recording.from_arrays({"tip_x_m": column}, 100.0, synthetic=True)
    assert np.array_equal(recording["tip_x_m"], [1.0, np.nan, 3.0], equal_nan=True)


def test_frames_at_uneven_times_keep_them(recording: wl.Recording) -> None:
    time_s = np.cumsum(np.resize([0.0199, 0.0213, 0.0204], len(recording)))
    uneven = wl.Recording.from_arrays(recording.columns, time_s=time_s, frame_rate_sd_hz=0.01, synthetic=True)
    assert uneven.time_s.tobytes() == time_s.tobytes() and uneven.frame_rate_sd_hz == 0.01
    assert pickle.loads(pickle.dumps(uneven)) == uneven != recording
    assert "interpolated" in wl.spectrum(uneven, "head-drop").description["note"]
    with pytest.raises(wl.InputError, match="time_s, frame 1: found"):
        wl.Recording.from_arrays(recording.columns, time_s=np.zeros(len(recording)))
    with pytest.raises(wl.InputError, match="frame_rate_hz"):
        wl.Recording.from_arrays(recording.columns, 5000.0, time_s=time_s)


def test_data_frames(scene: wl.Scene, recording: wl.Recording) -> None:
    motion = wl.simulate(scene)
    frame = motion.to_pandas()
    assert frame.index.name == "time_s" and frame["tip_x_m"].iloc[3] == motion.tip_x_m[3]
    assert len(motion.events_to_pandas()) == motion.summary["transitions"]
    data = motion.to_xarray()
    assert data["neck_rate_rad_per_s"].attrs["units"] == "rad/s" and data.attrs["synthetic"]
    assert wl.Recording.from_arrays(recording.to_pandas(), 5000.0)["tip_x_m"].tobytes() == recording["tip_x_m"].tobytes()
    at = wl.simulate(scene, motion.time_s[10:20])
    assert at.tip_x_m.tobytes() == motion.tip_x_m[10:20].tobytes()
