"""Paths that a user names."""

from __future__ import annotations

import os
from pathlib import Path

from .errors import InputError, MissingFileError


def existing(path: str | os.PathLike[str]) -> Path:
    """The path, if something is there."""
    place = Path(path)
    if not place.exists():
        raise MissingFileError(f"{place}: no such file; check the path")
    return place


def text_of(path: Path) -> str:
    """The text of a UTF-8 file."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: byte {error.start} is not UTF-8; save the file as UTF-8") from None
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from None
