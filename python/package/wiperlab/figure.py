"""Figures that a notebook shows."""

from __future__ import annotations

import os
from pathlib import Path


class Figure:
    """A figure as SVG text."""

    def __init__(self, svg: str, name: str = "figure") -> None:
        self.svg = svg
        self.name = name

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Writes the SVG, and returns where."""
        place = Path(path)
        place.write_text(self.svg, encoding="utf-8", newline="\n")
        return place

    def _repr_svg_(self) -> str:
        return self.svg

    def __repr__(self) -> str:
        return f"<wiperlab.Figure {self.name}, {len(self.svg)} characters of SVG>"
