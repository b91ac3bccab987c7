"""Pixel axes that are mirrored or turned against the instrument: told, or fitted where allowed."""

import re
from dataclasses import replace

import numpy as np
import pytest

from solver.data.settings import FitSettings
from solver.engines.gauss_newton import find_mode
from solver.errors import InputError
from solver.problem.problem import build_problem


@pytest.fixture
def problem_of(small_orbit):
    """Return the problem of the small orbit with other columns of its measurements."""

    def build(change, settings=None):
        rows = small_orbit.data.measurements
        data = replace(small_orbit.data, measurements=rows.assign(**change(rows)))
        return build_problem(data, small_orbit.instrument, settings or FitSettings())

    return build


MIRRORED = {
    "sign of nx": lambda rows: {"nx": -rows["nx"]},
    "sign of ny": lambda rows: {"ny": -rows["ny"]},
    "exchanged": lambda rows: {"nx": rows["ny"], "ny": rows["nx"]},
}


@pytest.mark.parametrize("change", MIRRORED.values(), ids=MIRRORED)
def test_mirrored_axes_are_told(problem_of, change):
    with pytest.raises(InputError, match="found the sky mirrored on detector 0, 1, 2, 3: exchange"):
        find_mode(problem_of(change), FitSettings())


def test_detector_that_alone_is_mirrored_is_named(problem_of):
    def change(rows):
        return {"nx": rows["nx"].where(rows["detector_id"] != 2, -rows["nx"])}

    with pytest.raises(InputError, match="mirrored on detector 2: exchange"):
        find_mode(problem_of(change), FitSettings())


def both_signs(rows):
    return {"nx": -rows["nx"], "ny": -rows["ny"]}


def exchanged(rows):
    return {"detector_id": rows["detector_id"].replace({0: 1, 1: 0})}


@pytest.mark.parametrize(
    ("change", "named", "turns_deg"),
    [(both_signs, "0, 1, 2, 3", [180] * 4), (exchanged, "0, 1", [-90, 90])],
    ids=["signs", "ids"],
)
def test_detectors_that_are_turned_are_named(problem_of, change, named, turns_deg):
    message = f"found detector {named} turned by about (.*) deg against it"
    with pytest.raises(InputError, match=message) as found:
        find_mode(problem_of(change), FitSettings())
    told = [int(one) for one in re.search(message, str(found.value))[1].split(", ")]
    away = np.remainder(np.array(told) - turns_deg + 180, 360) - 180
    assert np.abs(away).max() < 15


def test_detectors_are_turned_where_the_prior_allows_it(problem_of):
    settings = FitSettings(prior_widths={"detector_rotation": 648_000.0})
    problems = [problem_of(change, settings) for change in (dict, both_signs)]
    as_it_is, turned = (find_mode(problem, settings) for problem in problems)
    assert turned.status.is_solution
    sigma = as_it_is.reduced.sigmas[1]
    assert np.abs((turned.sources - as_it_is.sources) / sigma).max() < 1e-2


def test_detectors_that_are_exchanged_are_told_whatever_their_turns_may_be(problem_of):
    settings = FitSettings(prior_widths={"detector_rotation": 648_000.0})
    with pytest.raises(InputError, match="found the sky elsewhere on them .*check the ids"):
        find_mode(problem_of(exchanged, settings), settings)


def test_detectors_whose_places_are_not_known_are_left_to_the_fit(problem_of):
    widths = {"detector_rotation": 648_000.0, "detector_x": 1e5, "detector_y": 1e5}
    settings = FitSettings(prior_widths=widths)
    assert len(find_mode(problem_of(exchanged, settings), settings).trace) > 1


def test_wrong_identifications_are_not_taken_for_turned_detectors(problem_of):
    def shuffled(rows):
        return {"source_id": np.random.default_rng(1).permutation(rows["source_id"])}

    assert not find_mode(problem_of(shuffled), FitSettings()).status.is_solution
