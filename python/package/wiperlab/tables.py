"""Columns as data frames and as HTML."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd


def frame(columns: Mapping[str, Any], index: str | None = None) -> pd.DataFrame:
    """A data frame of columns, with one of them as its index."""
    import pandas

    made = pandas.DataFrame(dict(columns))
    return made if index is None else made.set_index(index)


def html(title: str, header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table of HTML; all texts are escaped."""

    def cells(tag: str, row: Sequence[object]) -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(shown(cell))}</{tag}>" for cell in row) + "</tr>"

    body = "".join(cells("td", row) for row in rows)
    return f"<table><caption>{escape(title)}</caption><thead>{cells('th', header)}</thead><tbody>{body}</tbody></table>"


def shown(cell: object) -> str:
    """A cell as text: numbers with six digits, nothing for what is missing."""
    if cell is None:
        return ""
    return f"{cell:.6g}" if isinstance(cell, float) else str(cell)
