"""The program, started from Python."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Union

from .errors import InputError, InternalError

Argument = Union[str, "os.PathLike[str]"]

#: Exit code of a command that ran, but stopped early, did not converge, or whose model does not explain the
#: recording.
STOPPED_EARLY = 3


def run(*arguments: Argument | Sequence[Argument], quiet: bool = True) -> int:
    """Runs a command of the program, such as ``run("init", "data/run7", "--out", "fits/run7")``.

    Prints what the command says unless ``quiet``, and returns its exit code: 0, or 3 where it ran but stopped
    early, did not converge, or found that the model does not explain the recording. On Ctrl-C the command is
    asked to stop, writes what it has, and ``KeyboardInterrupt`` is raised.

    Raises ``InputError`` where it refuses its input (exit code 2), and ``InternalError`` where it fails.
    """
    words: list[str] = []
    for argument in arguments:
        alone = isinstance(argument, (str, os.PathLike))
        words.extend(os.fspath(word) for word in ([argument] if alone else argument))  # type: ignore[arg-type, union-attr]
    # the package that is running, not one that lies in the working directory
    paths = [str(Path(__file__).parents[1]), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "PYTHONSAFEPATH": "1"}
    command = [sys.executable, "-m", "wiperlab", *words, *(["--quiet"] if quiet else [])]
    # in a group of its own: an interrupt reaches it once, from here
    own_group = {"creationflags": 0x00000200} if os.name == "nt" else {"start_new_session": True}
    process = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        encoding="utf-8",
        env=environment,
        **own_group,
    )
    try:
        said, refused = process.communicate()
    except KeyboardInterrupt:
        process.send_signal(getattr(signal, "CTRL_BREAK_EVENT", signal.SIGINT))
        process.communicate()
        raise
    if process.returncode == 2:
        raise InputError(refused.strip().removeprefix("error: "))
    if process.returncode not in (0, STOPPED_EARLY):
        raise InternalError(refused.strip().removeprefix("error: ") or f"exit code {process.returncode}")
    if not quiet:
        print(said, end="")
    return int(process.returncode)
