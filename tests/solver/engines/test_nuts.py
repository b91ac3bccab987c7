"""The nuts engine compared with the marginal sigmas of gauss-newton, on a small orbit."""

import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from solver.data.engine_settings import NutsSettings, SviSettings
from solver.data.result import FitStatus
from solver.data.settings import FitSettings
from solver.engines.nuts import Chains, _mixing
from solver.errors import CancelledError
from solver.fit import fit_orbit
from solver.results.agreement import compare_engines
from tests.solver.small_orbit import make_orbit

ENGINES = {
    "gauss-newton": FitSettings(),
    "svi": FitSettings(engine="svi", svi=SviSettings(seed=3)),
    "nuts": FitSettings(engine="nuts", nuts=NutsSettings(warmup=100, samples=200)),
}


@pytest.fixture(scope="module")
def results(optimised):
    """A small orbit fitted by every engine."""
    orbit = make_orbit()
    return {
        name: fit_orbit(orbit.data, orbit.instrument, settings)
        for name, settings in ENGINES.items()
    }


@pytest.mark.full
@pytest.mark.slow
def test_engines_agree(results):
    rows = compare_engines(results)
    assert {row.engine for row in rows} == {"svi", "nuts"}
    for row in rows:
        assert row.agrees, row


@pytest.mark.full
@pytest.mark.slow
def test_engines_find_the_same_evidence(results):
    found = [result.summary["log_evidence"] for result in results.values()]
    assert found == pytest.approx([found[0]] * 3, abs=0.1)


@pytest.mark.full
@pytest.mark.slow
def test_wrong_results_do_not_agree(results):
    """Sigmas are twice as large and positions are one sigma off."""
    exact = results["gauss-newton"]
    sources = exact.sources.assign(
        sigma_ra_conditional=2.0 * exact.sources["sigma_ra_conditional"],
        sigma_dec_marginal=2.0 * exact.sources["sigma_dec_marginal"],
        offset_ra=exact.sources["offset_ra"] + exact.sources["sigma_ra_marginal"],
    )
    wrong = {name: replace(result, sources=sources) for name, result in results.items()}
    assert not any(row.agrees for row in compare_engines({**wrong, "gauss-newton": exact}))


@pytest.mark.full
@pytest.mark.slow
def test_summary_describes_the_mixing_of_the_chains(results):
    summary = results["nuts"].summary
    assert summary["converged"]
    assert summary["reason"] == FitStatus.SAMPLED.value
    assert summary["divergences"] == 0
    assert summary["samples"] == 400
    assert 1.0 <= summary["largest_r_hat"] < 1.05
    assert summary["smallest_effective_samples"] > 100
    assert len(results["nuts"].trace) == 2


@pytest.mark.full
@pytest.mark.slow
def test_calibration_uncertainties_agree_with_gauss_newton(results):
    exact, found = (results[name].calibration for name in ("gauss-newton", "nuts"))
    ratio = found["sigma_marginal"] / exact["sigma_marginal"]
    effective = results["nuts"].summary["smallest_effective_samples_of_sigmas"]
    assert np.abs(ratio - 1.0).max() < 4.5 / np.sqrt(2.0 * effective)


def test_run_can_be_cancelled(small_orbit, monkeypatch):
    """Cancellation takes effect between two blocks of samples."""

    def cancel(row):
        raise CancelledError("now")

    monkeypatch.setattr("solver.engines.nuts._run_chains", lambda *given: given[-1](250, 1.0))
    settings = FitSettings(engine="nuts")
    with pytest.raises(CancelledError):
        fit_orbit(small_orbit.data, small_orbit.instrument, settings, cancel)


def chains(*values):
    """Return two chains of one parameter each."""
    samples = np.stack(values)[..., None]
    return Chains(samples, np.stack([samples, samples], axis=-2), 0, 1)


def test_separated_chains_have_a_large_r_hat():
    rng = np.random.default_rng(0)
    together, apart = rng.standard_normal((2, 500)), rng.standard_normal((2, 500))
    apart[1] += 3.0
    assert _mixing(chains(*together)).r_hat < 1.05
    assert _mixing(chains(*apart)).r_hat > 1.5


def test_arviz_is_used_if_installed(monkeypatch):
    """The stub has the functions and arguments of ArviZ 0.23 and 1.3."""
    dataset = SimpleNamespace(max=lambda: 1.01, min=lambda: 321.0)
    answer = {"free": dataset, "squares": dataset}
    module = SimpleNamespace(
        convert_to_dataset=lambda values: answer if set(values) == set(answer) else None,
        rhat=lambda data: data,
        ess=lambda data: data,
    )
    monkeypatch.setitem(sys.modules, "arviz", module)
    mixing = _mixing(chains(*np.random.default_rng(0).standard_normal((2, 50))))
    assert mixing == (1.01, 321.0, 321.0, "ArviZ")
