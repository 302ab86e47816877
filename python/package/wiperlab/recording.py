"""Recordings and what is in them."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import tables
from ._wiperlab import Recording as NativeRecording
from ._wiperlab import analyse
from .errors import InputError
from .figure import Figure
from .paths import existing

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

#: Columns of a recording.
COLUMNS = ("tip_x_m", "tip_y_m", "head_x_m", "head_y_m", "tip_confidence", "head_confidence")


def _fill_masked(column: ArrayLike) -> NDArray[np.float64]:
    """The numbers of a column; a masked one is missing."""
    if isinstance(column, np.ma.MaskedArray):
        column = np.ma.filled(np.ma.asarray(column, dtype=np.float64), np.nan)
    return np.ascontiguousarray(column, dtype=np.float64)


class Recording:
    """Tracked positions of tip and head on the frame grid, m; not a number where a point was not tracked."""

    def __init__(self, native: NativeRecording) -> None:
        self._native = native

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Recording:
        """Reads the folder of a recording (``wiperlab import`` makes it), or a trace.csv alone."""
        return cls(NativeRecording.load(existing(path)))

    @classmethod
    def from_arrays(
        cls,
        columns: Mapping[str, ArrayLike] | pd.DataFrame,
        frame_rate_hz: float | None = None,
        *,
        time_s: ArrayLike | None = None,
        frame_rate_sd_hz: float | None = None,
        start_s: float = 0.0,
        exposure_s: float | None = None,
        name: str = "recording",
        synthetic: bool = False,
    ) -> Recording:
        """A recording from columns (``tip_x_m``, ``tip_y_m``, ``head_x_m``, ``head_y_m``, any of them), or from a
        data frame. The frames lie on the grid of ``frame_rate_hz`` or, if they lie on no grid, at ``time_s``.
        ``frame_rate_sd_hz`` is the standard deviation of the rate. Say so where it is ``synthetic``."""
        unknown = [key for key in columns.keys() if key not in COLUMNS]
        if unknown:
            raise InputError(f"columns: found {unknown[0]!r}, expected some of {', '.join(COLUMNS)}")
        arrays = {key: _fill_masked(columns[key]) for key in columns.keys()}
        if time_s is not None and frame_rate_hz is None and start_s == 0.0:
            clock: float | NDArray[np.float64] = np.ascontiguousarray(time_s, dtype=np.float64)
        elif frame_rate_hz is not None and time_s is None:
            clock = float(frame_rate_hz)
        else:
            raise InputError("expected frame_rate_hz (and start_s) for frames on a grid, or time_s alone for others")
        native = NativeRecording.from_columns(
            name,
            clock,
            arrays,
            start_s=start_s,
            frame_rate_sd_hz=frame_rate_sd_hz,
            exposure_s=exposure_s,
            synthetic=synthetic,
        )
        return cls(native)

    @property
    def columns(self) -> dict[str, NDArray[np.float64]]:
        """Positions by name."""
        return self._native.columns()

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        return self.columns[name]

    @property
    def time_s(self) -> NDArray[np.float64]:
        """Instants of the frames, s."""
        return self._native.time_s

    @property
    def name(self) -> str:
        """Its name."""
        return self._native.name

    @property
    def frame_rate_hz(self) -> float:
        """Frames per second, 1/s; the mean rate without gaps where the frames lie on no grid."""
        return self._native.frame_rate_hz

    @property
    def frame_rate_sd_hz(self) -> float | None:
        """Standard deviation of the frame rate, 1/s, where known."""
        return self._native.frame_rate_sd_hz

    @property
    def start_s(self) -> float:
        """Instant of the first frame, s."""
        return self._native.start_s

    @property
    def exposure_s(self) -> float | None:
        """Exposure of a frame, s, where known."""
        return self._native.exposure_s

    @property
    def is_synthetic(self) -> bool:
        """Whether a computer made it."""
        return self._native.is_synthetic

    def to_pandas(self) -> pd.DataFrame:
        """The positions, by time."""
        return tables.frame({"time_s": self.time_s, **self.columns}, "time_s")

    def to_xarray(self) -> xr.Dataset:
        """The positions along ``time_s``."""
        import xarray

        variables = {name: ("time_s", column) for name, column in self.columns.items()}
        attributes = {"name": self.name, "frame_rate_hz": self.frame_rate_hz, "synthetic": int(self.is_synthetic)}
        return xarray.Dataset(variables, {"time_s": self.time_s}, attributes)

    def __len__(self) -> int:
        return len(self._native)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Recording) and self._native == other._native

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> tuple[Any, ...]:
        uneven = self._native.has_true_times
        kept = {
            "time_s": self.time_s if uneven else None,
            "frame_rate_sd_hz": self.frame_rate_sd_hz,
            "start_s": 0.0 if uneven else self.start_s,
            "exposure_s": self.exposure_s,
            "name": self.name,
            "synthetic": self.is_synthetic,
        }
        return (_recording, (self.columns, None if uneven else self.frame_rate_hz, kept))

    def __repr__(self) -> str:
        kind = ", synthetic" if self.is_synthetic else ""
        return f"<wiperlab.Recording {self.name!r}, {len(self)} frames at {self.frame_rate_hz:.6g}/s{kind}>"

    def _repr_html_(self) -> str:
        tracked = [
            (name, f"{np.count_nonzero(~np.isnan(column))} of {len(self)} frames")
            for name, column in self.columns.items()
        ]
        return tables.html(repr(self)[10:-1], ["column", "tracked"], tracked)


def _recording(columns: Mapping[str, ArrayLike], frame_rate_hz: float | None, kept: dict[str, Any]) -> Recording:
    return Recording.from_arrays(columns, frame_rate_hz, **kept)


class Spectrum:
    """The components of a window: what ``wiperlab spectrum`` writes."""

    def __init__(self, files: Mapping[str, bytes]) -> None:
        self._files = dict(files)
        #: What components.json holds: ``frequency_hz``, ``frequency_sd_hz``, ``amplitude_m``, ``damping_ratio``,
        #: ``verdict``, ... of each component, the largest first.
        self.components: list[dict[str, Any]] = json.loads(files["components.json"])["components"]
        #: The stick-slip cycle that is counted in the path of the tip: ``count``, ``rate_hz``, ``period_s``,
        #: ``period_scatter``, ``size_m``, ``slips``, ...; without a cycle ``count`` is 0 and ``reason`` says why.
        self.cycles: dict[str, Any] = json.loads(files["components.json"])["cycles"]
        #: What spectrum.json holds: what was analysed, and how.
        self.description: dict[str, Any] = json.loads(files["spectrum.json"])

    @property
    def columns(self) -> dict[str, NDArray[np.float64]]:
        """The columns of spectrum.csv: amplitudes and noise floor over the frequency."""
        rows = list(csv.reader(io.StringIO(self._files["spectrum.csv"].decode())))
        by_column = zip(*rows[1:]) if len(rows) > 1 else ([] for _ in rows[0])
        values = [np.array([float(cell) if cell else np.nan for cell in column]) for column in by_column]
        return dict(zip(rows[0], values))

    @property
    def figures(self) -> dict[str, Figure]:
        """The figures, by name."""
        drawn = {name: text for name, text in self._files.items() if name.endswith(".svg") and "/" not in name}
        return {name[:-4]: Figure(text.decode(), name[:-4]) for name, text in drawn.items()}

    def to_pandas(self) -> pd.DataFrame:
        """The components, a row each."""
        import pandas

        return pandas.DataFrame(self.components)

    def __len__(self) -> int:
        return len(self.components)

    def __repr__(self) -> str:
        listed = ", ".join(f"{c['frequency_hz']:.6g} Hz {c['verdict']}" for c in self.components) or "no components"
        return f"<wiperlab.Spectrum of {self.description['channel']}: {listed}>"

    def _repr_html_(self) -> str:
        keys = ["frequency_hz", "frequency_sd_hz", "amplitude_m", "damping_ratio", "verdict"]
        rows = [[component.get(key) for key in keys] for component in self.components]
        return tables.html(f"Components of {self.description['channel']}", keys, rows)

    def _repr_svg_(self) -> str | None:
        return next((figure.svg for figure in self.figures.values()), None)


def spectrum(
    recording: Recording | ArrayLike,
    channel: str = "deflection",
    window: str = "..",
    *,
    frame_rate_hz: float | None = None,
    detrend: str = "auto",
    band_hz: tuple[float, float] | None = None,
    max_components: int | None = None,
    exposure_s: float | None = None,
) -> Spectrum:
    """What a window of a recording is made of, or a signal of one row at ``frame_rate_hz``.

    ``channel`` is ``deflection``, ``head-drop``, ``tip-x`` or ``head-x``; ``window`` is ``before``, ``stick``,
    ``flip`` or ``after``, instants in s (``0.10..0.25``), or all (``..``). The numbers are those that
    ``wiperlab spectrum`` writes.
    """
    if not isinstance(recording, Recording):
        if frame_rate_hz is None:
            raise InputError("frame_rate_hz: expected the rate of the samples, 1/s, as they are no Recording")
        samples = np.ascontiguousarray(recording, dtype=np.float64)
        if samples.ndim != 1:
            raise InputError(f"found {samples.ndim} dimensions, expected a Recording or one row of samples in m")
        recording = Recording.from_arrays({"tip_x_m": samples}, frame_rate_hz, name="samples")
        channel = "tip-x"
    elif frame_rate_hz is not None:
        raise InputError("frame_rate_hz: a Recording has its own; leave it out")
    return Spectrum(analyse(recording._native, channel, window, detrend, band_hz, max_components, exposure_s))
