"""What is said of the noise that a fit has estimated."""

from types import SimpleNamespace

import numpy as np
import pytest

from plateviz.verdict.estimated_noise import noise_sentences
from solver.data.settings import FitSettings


def solution(entry, **settings):
    summary = {} if entry is None else {"noise": entry}
    return SimpleNamespace(settings=FitSettings(**settings), summary=summary)


def noise(converged=True, rounds=3, **log_factor):
    sigma = dict.fromkeys(log_factor, 0.01)
    entry = {"converged": converged, "rounds": rounds, "sigma": sigma}
    return {**entry, "log_factor": log_factor}


def test_nothing_is_said_of_a_fit_that_does_not_estimate_the_noise():
    assert noise_sentences(solution(None)) == []


def test_factor_has_its_uncertainty():
    found = noise_sentences(solution(noise(all=np.log(1.1)), noise_scale=True))
    assert found == ["The fit estimates the noise as 1.100 ± 0.011 times the stated uncertainties."]


def test_exposures_have_a_range():
    entry = noise(**{"exposure field 0 plate 1": np.log(0.5), "exposure field 0 plate 2": 0.0})
    (found,) = noise_sentences(solution(entry, noise_by_exposure=True))
    assert "each exposure as 0.500 to 1.000 times" in found


def test_several_parts_make_one_sentence():
    entry = noise(all=0.0, references=np.log(2.0), **{"per magnitude": 0.1})
    entry |= {"floor_pix": 0.002, "floor_sigma_pix": 0.0001}
    settings = {"noise_by_magnitude": True, "noise_floor": True, "reference_scale": True}
    (found,) = noise_sentences(solution(entry, **settings))
    assert "at the mean magnitude as 1.00 ± 0.01 times" in found
    assert "a floor of 2 ± 0.1 mpix" in found
    assert found.endswith(
        "and the errors of the reference stars as 2.00 ± 0.02 times those stated."
    )


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        (noise(converged=False, rounds=20, all=0.0), "had not settled after 20 rounds"),
        (None, "could not be estimated: the stated uncertainties are used"),
    ],
)
def test_estimate_that_failed_is_told(entry, words):
    assert words in noise_sentences(solution(entry, noise_scale=True))[0]
