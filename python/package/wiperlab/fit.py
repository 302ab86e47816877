"""Fits: the posterior density of a job's unknowns, the fit itself, its result and its report."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import tables
from ._wiperlab import Job as NativeJob
from ._wiperlab import describe_verdict
from .errors import InputError, MissingFileError
from .figure import Figure
from .paths import existing
from .program import run

if TYPE_CHECKING:
    import pandas as pd


class Job:
    """A job with its scenes and recordings, and the posterior density of its unknowns.

    A point ``x`` has the value of every unknown in the order of ``names``, in SI units: the free parameters, and
    in a job on traces also what is not known of the cameras and the constants that are freed. ``residuals``,
    ``log_posterior`` and ``prior_transform`` take what SciPy, emcee and nested samplers call them with. A Job can
    be sent to other processes; it is read again there.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._native = NativeJob(existing(path))

    @property
    def path(self) -> Path:
        """Its file."""
        return Path(self._native.path)

    @property
    def title(self) -> str:
        """Its title."""
        return self._native.title

    @property
    def names(self) -> list[str]:
        """Names of the unknowns."""
        return self._native.names

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Least and greatest value of every unknown, one row each."""
        return np.array(self._native.bounds, dtype=np.float64).reshape(-1, 2)

    def residuals(self, x: ArrayLike) -> NDArray[np.float64]:
        """Distances of model and data in standard deviations; not a number where the model shows none.

        Of a job on features one a feature, in its order; of a job on traces one a fitted frame, recording by
        recording, tip before head, with the starting states of the segments where they fit best.
        """
        return self._native.residuals(point(x))

    def log_prior(self, x: ArrayLike) -> float:
        """Logarithm of the prior density; minus infinity beyond a bound."""
        return self._native.log_prior(point(x))

    def log_likelihood(self, x: ArrayLike) -> float:
        """Logarithm of the likelihood up to a constant; minus infinity where the model does not run."""
        return self._native.log_likelihood(point(x))

    def log_posterior(self, x: ArrayLike) -> float:
        """Logarithm of the posterior density up to a constant."""
        return self._native.log_posterior(point(x))

    def prior_transform(self, u: ArrayLike) -> NDArray[np.float64]:
        """The values at a place in the unit box: uniform places have the prior for density."""
        return self._native.prior_transform(point(u))

    def fit(
        self,
        resume: bool = False,
        *,
        max_evaluations: int | None = None,
        force: bool = False,
        quiet: bool = True,
    ) -> FitResult:
        """Fits as ``wiperlab fit`` does: journal and result are written next to the job.

        With ``resume`` a fit goes on from its journal. On Ctrl-C what is done is in the journal. A fit that did
        not converge, or whose model does not explain the recording, is a result and says so.
        """
        options = ["--resume"] if resume else []
        options += [] if max_evaluations is None else ["--max-evaluations", str(max_evaluations)]
        options += ["--force"] if force else []
        run("fit", self.path, options, quiet=quiet)
        return self.result()

    def result(self) -> FitResult:
        """The result next to the job."""
        return FitResult.load(self.path.parent)

    def __reduce__(self) -> tuple[Any, ...]:
        return (_job, (str(self.path), self._native.fingerprint))

    def __repr__(self) -> str:
        return f"<wiperlab.Job {self.title!r}, unknowns {', '.join(self.names)}>"

    def _repr_html_(self) -> str:
        rows = [(name, *map(float, ends)) for name, ends in zip(self.names, self.bounds)]
        return tables.html(self.title, ["unknown", "least", "greatest"], rows)


def _job(path: str, fingerprint: str) -> Job:
    job = Job(path)
    if job._native.fingerprint != fingerprint:
        raise InputError(f"{path}: changed since the Job was read; read it again")
    return job


def point(x: ArrayLike) -> NDArray[np.float64]:
    values = np.ascontiguousarray(x, dtype=np.float64)
    if values.ndim != 1:
        raise InputError(f"found {values.ndim} dimensions, expected one row with a number for each unknown")
    return values


class FitResult(Mapping[str, Any]):
    """What result.json holds, as a mapping."""

    def __init__(self, content: Mapping[str, Any], folder: Path) -> None:
        self._content = dict(content)
        self.folder = folder

    @classmethod
    def load(cls, folder: str | os.PathLike[str]) -> FitResult:
        """Reads the result in the folder of a fit."""
        path = Path(folder) / "result.json"
        if not path.exists():
            raise MissingFileError(f"{path}: no such file; fit the job first")
        return cls(json.loads(path.read_text(encoding="utf-8")), Path(folder))

    def __getitem__(self, key: str) -> Any:
        return self._content[key]

    def __iter__(self) -> Any:
        return iter(self._content)

    def __len__(self) -> int:
        return len(self._content)

    @property
    def status(self) -> str:
        """How the search ended."""
        return str(self["status"])

    @property
    def explained(self) -> bool | None:
        """Whether the model explains the recordings; None if the search did not end."""
        explained: bool | None = self["explained"]
        return explained

    @property
    def findings(self) -> list[dict[str, Any]]:
        """Why the model does not explain the recordings, and what would explain them."""
        return list(self.get("findings", []))

    @property
    def law(self) -> dict[str, Any] | None:
        """Which law of friction the recordings support: ``verdict``, ``chosen``, ``sentence``, ``candidates``.

        None if laws were not compared, as in a fit of features.
        """
        law: dict[str, Any] | None = self.get("law")
        return law

    @property
    def chatter(self) -> dict[str, Any] | None:
        """Where and why the fitted blade chatters: ``sentences``, and their numbers with intervals.

        None if the model does not explain the recordings.
        """
        chatter: dict[str, Any] | None = self.get("chatter")
        return chatter

    @property
    def verdict(self) -> list[str]:
        """The verdict in the words of the terminal: the first sentence, then the reasons that it leaves out.

        The sentences have no full stop. Raises an InputError if `result.json` is damaged.
        """
        path = self.folder / "result.json"
        first, reasons = describe_verdict(str(path), path.read_text(encoding="utf-8"))
        return [first, *reasons]

    @property
    def parameters(self) -> dict[str, dict[str, Any]]:
        """Estimate, interval and verdict of each parameter."""
        return dict(self["parameters"])

    def to_pandas(self) -> pd.DataFrame:
        """The parameters, a row each."""
        import pandas

        return pandas.DataFrame(self.parameters).T

    def report(self, out: str | os.PathLike[str], *, force: bool = False) -> Report:
        """Writes figures and page, as ``wiperlab report`` does."""
        run("report", self.folder, "--out", out, ["--force"] if force else [])
        return Report(Path(out))

    def __repr__(self) -> str:
        estimates = ", ".join(f"{name} {p['estimate']:.4g}" for name, p in self.parameters.items())
        return f"<wiperlab.FitResult {self.status}: {estimates}>"

    def _repr_html_(self) -> str:
        keys = ["estimate", "lower_95", "upper_95", "verdict"]
        rows = [[name, *(parameter.get(key) for key in keys)] for name, parameter in self.parameters.items()]
        return tables.html(". ".join([*self.verdict, f"Search {self.status}"]), ["parameter", *keys], rows)


class Report:
    """A written report: a page and its figures."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @property
    def page(self) -> Path:
        """The page."""
        return self.folder / "index.html"

    @property
    def figures(self) -> dict[str, Figure]:
        """The figures, by name."""
        paths = sorted(self.folder.glob("*.svg"))
        return {path.stem: Figure(path.read_text(encoding="utf-8"), path.stem) for path in paths}

    def __repr__(self) -> str:
        return f"<wiperlab.Report {self.page}>"

    def _repr_html_(self) -> str:
        from html import escape

        page = escape(self.page.read_text(encoding="utf-8"), quote=True)
        return f'<iframe srcdoc="{page}" width="100%" height="800" sandbox></iframe>'
