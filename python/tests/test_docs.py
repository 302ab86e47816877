"""The code of the pages runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from conftest import ROOT

BLOCKS = [
    pytest.param(page, code, id=f"{page.name}-{number}")
    for page in [ROOT / "docs/python.md", ROOT / "python/README.md"]
    for number, code in enumerate(re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL))
]


@pytest.mark.parametrize(("page", "code"), BLOCKS)
def test_a_block(page: Path, code: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # where the page says it is, with files written elsewhere
    monkeypatch.chdir(ROOT if page.parent.name == "docs" else page.parent)
    exec(code.replace('save("', f'save("{tmp_path.as_posix()}/'), {})


def test_the_pages_have_code() -> None:
    assert len(BLOCKS) == 3
