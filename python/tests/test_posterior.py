"""The posterior density: what is known of it exactly, and where a fit ends."""

from __future__ import annotations

import json

import numpy as np
import pytest
import wiperlab as wl
from conftest import FEATURES, TRACES

KINDS = [pytest.param(FEATURES, id="features"), pytest.param(TRACES, id="traces")]


@pytest.mark.parametrize("path", KINDS)
def test_the_prior_is_the_density_of_its_transform(path: str) -> None:
    job = wl.Job(path)
    middle = np.full(len(job.names), 0.5)
    least, greatest = job.bounds.T
    np.testing.assert_allclose(job.prior_transform(0.0 * middle), least, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(job.prior_transform(2.0 * middle), greatest, rtol=1e-9, atol=1e-12)
    # the product of all slopes is one over the density
    steps = 1e-6 * np.eye(len(middle))
    slopes = [(job.prior_transform(middle + s) - job.prior_transform(middle - s)).sum() / 2e-6 for s in steps]
    assert job.log_prior(job.prior_transform(middle)) == pytest.approx(-np.log(slopes).sum(), abs=1e-4)


@pytest.mark.parametrize("path", KINDS)
def test_beyond_a_bound_there_is_nothing(path: str) -> None:
    job = wl.Job(path)
    beyond = job.bounds[:, 1] * 1.01
    assert job.log_prior(beyond) == job.log_posterior(beyond) == -np.inf


def test_residuals_and_likelihood_of_features_belong_together() -> None:
    job = wl.Job(FEATURES)
    result = job.result()
    x = np.array([result.parameters[name]["estimate"] for name in job.names])
    residuals = job.residuals(x)
    assert len(residuals) == len(result["components"]) + len(result["features"])
    assert np.isfinite(residuals).all()
    assert job.log_posterior(x) == pytest.approx(job.log_prior(x) + job.log_likelihood(x))
    off = x * np.array([1.3, *np.ones(len(x) - 1)])
    assert job.log_likelihood(off) < job.log_likelihood(x)


def test_the_fit_to_traces_ends_at_the_top() -> None:
    job = wl.Job(TRACES)
    result = json.loads((TRACES.parent / "result.json").read_text())
    known = {name: parameter["estimate"] for name, parameter in result["parameters"].items()}
    for nuisance in result.get("nuisances", []):
        of = nuisance.get("recording")
        known[f"{of}: {nuisance['name']}" if of else nuisance["name"]] = nuisance["estimate"]
    x = np.array([known[name] for name in job.names])
    residuals = job.residuals(x)
    # (of a camera whose noise is what the job says, less what the starting states take)
    assert 0.8 < np.nanmean(residuals**2) < 1.1
    best = job.log_posterior(x)
    for i, name in enumerate(job.names):
        if name in result["parameters"]:
            parameter = result["parameters"][name]
            for end in ["lower_95", "upper_95"]:
                moved = x.copy()
                moved[i] = parameter["estimate"] + 2.0 * (parameter[end] - parameter["estimate"])
                assert job.log_posterior(moved) < best, name
    assert job.log_posterior(x) == best
