"""High-speed video of a windshield wiper blade against a stick-slip model of it.

The same numbers as the program `wiperlab`, as NumPy arrays: recordings and their spectra, runs of scenes, and
the posterior density of the unknowns of a fit. All quantities are in SI units; names carry them.
"""

from ._wiperlab import __version__
from .errors import InputError, InternalError, MissingFileError, WiperlabError
from .figure import Figure
from .fit import FitResult, Job, Report
from .program import run
from .recording import Recording, Spectrum, spectrum
from .scene import Motion, Scene, simulate, simulate_many

__all__ = [
    "Figure",
    "FitResult",
    "InputError",
    "InternalError",
    "Job",
    "MissingFileError",
    "Motion",
    "Recording",
    "Report",
    "Scene",
    "Spectrum",
    "WiperlabError",
    "__version__",
    "run",
    "simulate",
    "simulate_many",
    "spectrum",
]
