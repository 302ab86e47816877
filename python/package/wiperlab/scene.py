"""Scenes and their runs."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import tables
from ._wiperlab import Scene as NativeScene
from ._wiperlab import simulate_points, simulate_scene
from .errors import InputError
from .paths import existing, text_of

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

#: What `simulate_many` reads where nothing else is named.
DEFAULT_READ: tuple[Mapping[str, Any], ...] = (
    {"name": "transitions", "kind": "transitions"},
    {"name": "stick fraction", "kind": "stick-fraction"},
    {"name": "longest stick", "kind": "longest-stick"},
    {"name": "least normal force", "kind": "least-normal-force"},
)


class Scene:
    """A blade, its friction, its drive and what is to be computed; it does not change.

    ``scene["friction.a"]`` is the value of a parameter, ``scene.replace({"friction.a": 0.3})`` the same scene
    with another one. The names are the keys of scene.toml with their tables.
    """

    def __init__(self, native: NativeScene) -> None:
        self._native = native

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Scene:
        """Reads a scene.toml."""
        return cls(NativeScene.load(existing(path)))

    @classmethod
    def parse(cls, text: str, file: str = "scene.toml") -> Scene:
        """Reads the text of a scene.toml; ``file`` is its name in refusals, and paths are relative to it."""
        return cls(NativeScene.parse(text, file))

    def replace(self, values: Mapping[str, float]) -> Scene:
        """The same scene with other values of its parameters."""
        return Scene(self._native.replace([(name, float(value)) for name, value in values.items()]))

    def __getitem__(self, name: str) -> float:
        value = self._native.value(name)
        if value is None:
            raise KeyError(name)
        return value

    @property
    def parameters(self) -> dict[str, float]:
        """The parameters as they are written."""
        return dict(self._native.written_values())

    @property
    def title(self) -> str:
        """Its title."""
        return self._native.title

    @property
    def start_s(self) -> float:
        """Start of the run, s."""
        return self._native.start_s

    @property
    def stop_s(self) -> float:
        """End of the run, s."""
        return self._native.stop_s

    @property
    def sample_rate_hz(self) -> float:
        """Rate of the samples, 1/s."""
        return self._native.sample_rate_hz

    @property
    def findings(self) -> list[str]:
        """Numbers that are hard to believe, a sentence each."""
        return self._native.findings

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Scene) and self._native == other._native

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> tuple[Any, ...]:
        return (_scene, (self._native.parts(),))

    def __repr__(self) -> str:
        return f"<wiperlab.Scene {self.title!r}, {self.start_s} s to {self.stop_s} s>"

    def _repr_html_(self) -> str:
        return tables.html(self.title, ["parameter", "value"], list(self.parameters.items()))


def _scene(parts: tuple[str, str, str | None, list[tuple[str, float]]]) -> Scene:
    return Scene(NativeScene.of_parts(parts))


class Motion:
    """A run of a scene: samples, transitions and summary. It is simulated, and says so.

    The columns are those of trace.csv and state.csv (``motion.tip_x_m``, ``motion["tip_x_m"]``), and ``mode``.
    """

    #: A simulation is no measurement.
    is_synthetic = True

    def __init__(
        self, columns: dict[str, NDArray[Any]], events: dict[str, NDArray[Any]], summary: dict[str, Any], title: str
    ) -> None:
        self.columns = columns
        #: Changes of mode: ``time_s``, ``from``, ``to``, ``cause``, and ``predicted_time_error_s`` if asked for.
        self.events = events
        #: What summary.json holds.
        self.summary = summary
        self.title = title

    @property
    def status(self) -> str:
        """How the run ended: ``completed``, or why it stopped early."""
        return str(self.summary["status"])

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.columns[name]

    def __getattr__(self, name: str) -> NDArray[Any]:
        columns: dict[str, NDArray[Any]] = self.__dict__.get("columns", {})
        if name in columns:
            return columns[name]
        raise AttributeError(f"a Motion has no `{name}`; its columns are {', '.join(columns)}")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.columns]

    def __len__(self) -> int:
        return len(self.columns["time_s"])

    def to_pandas(self) -> pd.DataFrame:
        """The samples, by time."""
        return tables.frame(self.columns, "time_s")

    def events_to_pandas(self) -> pd.DataFrame:
        """The transitions, by time."""
        return tables.frame(self.events, "time_s")

    def to_xarray(self) -> xr.Dataset:
        """The samples along ``time_s``, with units and the summary as attributes."""
        import xarray

        units = {"_m": "m", "_s": "s", "_rad": "rad", "_rad_per_s": "rad/s", "_m_per_s": "m/s", "_n": "N"}

        def unit(name: str) -> dict[str, str]:
            fits = [ending for ending in units if name.endswith(ending)]
            return {"units": units[max(fits, key=len)]} if fits else {}

        variables = {name: ("time_s", column, unit(name)) for name, column in self.columns.items() if name != "time_s"}
        coordinates = {"time_s": ("time_s", self.columns["time_s"], unit("time_s"))}
        attributes = {name: value for name, value in self.summary.items() if isinstance(value, (str, int, float))}
        return xarray.Dataset(variables, coordinates, {"title": self.title, **attributes})

    def __repr__(self) -> str:
        counts = f"{len(self)} samples, {self.summary['transitions']} transitions"
        return f"<wiperlab.Motion {self.title!r}, {self.status}, {counts}, simulated>"

    def _repr_html_(self) -> str:
        rows = [(name, value) for name, value in self.summary.items() if isinstance(value, (str, int, float))]
        return tables.html(f"{self.title}, simulated", ["quantity", "value"], rows)


def simulate(scene: Scene, times_s: ArrayLike | None = None, *, predict_errors: bool = False) -> Motion:
    """Runs a scene, with samples at its own rate, or at rising instants ``times_s``.

    With ``predict_errors``, ``motion.events`` has the predicted error of each transition time
    (``predicted_time_error_s``; NaN where it is unknown), and ``motion.summary`` has the largest of them and the
    time after which the order of the transitions is not determined (``undetermined_after_s``). The run then takes
    longer. ``wiperlab simulate`` always predicts errors.

    A run that ends early is a result: ``motion.status`` says why. The numbers are those that
    ``wiperlab simulate`` writes. Other threads go on meanwhile, and Ctrl-C ends the run.
    """
    times = None if times_s is None else instants(times_s)
    columns, modes, events, summary = simulate_scene(scene._native, times, predict_errors)
    return Motion(
        {**columns, "mode": np.array(modes, dtype=str)},
        {name: np.asarray(column) for name, column in events.items()},
        json.loads(summary),
        scene.title,
    )


def instants(times_s: ArrayLike) -> NDArray[np.float64]:
    times = np.ascontiguousarray(times_s, dtype=np.float64)
    if times.ndim != 1 or not np.all(np.isfinite(times)) or np.any(np.diff(times) <= 0.0):
        raise InputError("times_s: expected one row of finite, rising instants in s")
    return times


def simulate_many(
    scene: Scene,
    names: Sequence[str],
    X: ArrayLike,
    *,
    read: str | os.PathLike[str] | Sequence[Mapping[str, Any]] = DEFAULT_READ,
    frame_rate_hz: float | None = None,
    exposure_s: float | None = None,
    workers: int | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.str_]]:
    """Runs the scene with every row of ``X`` as values of the parameters ``names``, in parallel.

    ``read`` says what is read from every run: the tables ``[[map]]`` of a study (docs/sweeps.md) as dictionaries,
    or the path of a study whose maps and camera are taken. ``frame_rate_hz`` and ``exposure_s`` are the camera
    through which the runs are seen (by default the scene's own sample rate, and instantaneous).

    Returns ``Y``, one row a point and one column a reading, in the units of a study's table and not a number
    where a run shows none, and ``status``, how each run ended: ``completed``, or why not. A value that the scene
    refuses ends in ``no-start``. The numbers are those of ``wiperlab sweep`` to the last bit, for any number of
    ``workers``. Other threads go on meanwhile, and Ctrl-C ends the runs.
    """
    points = np.ascontiguousarray(X, dtype=np.float64)
    if points.ndim != 2:
        raise InputError(f"X: found {points.ndim} dimensions, expected 2: one row a point, one column a name")
    if workers is not None and not 1 <= workers <= 1024:
        raise InputError(f"workers: found {workers}, expected a whole number from 1 to 1024, or None for every core")
    if isinstance(read, (str, os.PathLike)):
        if frame_rate_hz is not None or exposure_s is not None:
            raise InputError("frame_rate_hz, exposure_s: the study has a camera; leave them out")
        maps = text_of(existing(read))
    else:
        camera = {"frame_rate_hz": frame_rate_hz or scene.sample_rate_hz, "exposure_s": exposure_s or 0.0}
        maps = study(camera, read)
    table, status = simulate_points(scene._native, list(names), points, maps, workers)
    return table, np.array(status, dtype=str)


def study(camera: Mapping[str, float], maps: Sequence[Mapping[str, Any]]) -> str:
    """The text of a study without axes."""
    tables_of = [("camera", "[camera]", camera), *(("map", "[[map]]", entry) for entry in maps)]
    lines = ["format = 1", 'title = "readings"', 'scene = "scene.toml"']
    for _, heading, entry in tables_of:
        lines += ["", heading, *(f"{key} = {toml_value(value)}" for key, value in entry.items())]
    return "\n".join(lines) + "\n"


def toml_value(value: object) -> str:
    """A value of a table as TOML writes it."""
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(toml_value(part) for part in value) + "]"
    if isinstance(value, (bool, str)):
        return json.dumps(value)
    if isinstance(value, (int, float, np.floating, np.integer)):
        return repr(value.item() if isinstance(value, (np.floating, np.integer)) else value)
    raise InputError(f"read: found {value!r}, expected texts, numbers and lists of them")
