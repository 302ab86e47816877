"""The examples run, and show what they say."""

from __future__ import annotations

import runpy
from pathlib import Path

import nbformat
import numpy as np
import pytest
from conftest import ROOT
from nbclient import NotebookClient

EXAMPLES = ROOT / "python/examples"


def test_sobol_indices() -> None:
    found = runpy.run_path(str(EXAMPLES / "sobol_indices.py"))["indices"](32)
    assert set(found) == {"stick fraction", "flip duration"}
    for of in found.values():
        assert of["missing"] < 0.5 and all(np.isfinite(value) for value in of.values())
        assert max(of.values()) > 0.3


def test_sample_posterior(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(EXAMPLES))
    import sample_posterior

    names, chains, accepted = sample_posterior.sampled(steps=12, walkers=10)
    assert chains.shape == (60, len(names)) and np.isfinite(chains).all()
    assert accepted > 0.0


def test_the_notebook(tmp_path: Path) -> None:
    notebook = nbformat.read(EXAMPLES / "export_to_report.ipynb", as_version=4)  # type: ignore[no-untyped-call]
    resources = {"metadata": {"path": str(EXAMPLES)}}
    NotebookClient(notebook, timeout=300, kernel_name="python3", resources=resources).execute()
    shown = [
        output.get("data", {}).get("text/html", "") + output.get("data", {}).get("image/svg+xml", "")
        for cell in notebook.cells
        for output in cell.get("outputs", [])
    ]
    text = "\n".join("".join(part) for part in shown)
    assert "synthetic" in text and "<svg" in text and "Components of head-drop" in text
    assert not any(output.output_type == "error" for cell in notebook.cells for output in cell.get("outputs", []))
