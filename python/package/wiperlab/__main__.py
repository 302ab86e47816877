"""The program `wiperlab`."""

import os
import sys
import sysconfig
from typing import NoReturn

from ._wiperlab import run_program


def main() -> NoReturn:
    """Runs the program with the arguments of this process, and ends the process with its exit code."""
    name = "wiperlab.exe" if os.name == "nt" else "wiperlab"
    installed = os.path.join(sysconfig.get_path("scripts"), name)
    path = installed if os.path.exists(installed) else None
    sys.exit(run_program(["wiperlab", *sys.argv[1:]], path))


if __name__ == "__main__":
    main()
