"""Controls of a fit: what a person types is completed, and a fault is said beside it."""

import pytest

from plateviz.dashboard.session.fit_choices import FitChoices
from plateviz.dashboard.views.controls.fit_controls import controls, width_input
from solver.data.parameters import BY_NAME
from solver.data.text_setting import LeftOut

DETECTOR_X = BY_NAME["detector_x"]


@pytest.fixture
def choices():
    return FitChoices()


@pytest.mark.parametrize(
    ("typed", "shown"),
    [("3", "3 um"), (" 0.5 ", "0.5 um"), ("2e1", "2e1 um"), ("2 mm", "2 mm"), ("flat", "flat")],
)
def test_a_width_without_a_unit_is_shown_with_its_unit(choices, typed, shown):
    entry = width_input(choices, DETECTOR_X)
    entry.value = typed
    assert entry.value == choices.prior_widths["detector_x"] == shown
    assert not entry.error_state
    assert choices.settings().prior_widths.keys() == {"detector_x"}


def test_an_empty_width_is_the_paper_s(choices):
    entry = width_input(choices, DETECTOR_X)
    before = entry.value
    for typed in ("3 um", "", "4", "  "):
        entry.value = typed
    assert entry.value == choices.prior_widths["detector_x"] == before
    assert choices.settings().prior_widths == {}


def test_a_factor_has_no_unit(choices):
    entry = width_input(choices, BY_NAME["sources"])
    entry.value = "2"
    assert entry.value == "2"


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ("wide", "Expected a width such as '1 um' or flat, found 'wide'."),
        ("-3", "Expected a positive prior width for detector_x, found -3.0."),
        ("3 deg", "Expected a unit such as um, found 'deg'."),
    ],
)
def test_a_fault_is_said_below_its_entry_until_it_is_mended(choices, typed, said):
    entry = width_input(choices, DETECTOR_X)
    entry.value = typed
    assert entry.error_state
    assert entry.helper_text == said
    entry.value = "3"
    assert (entry.error_state, entry.helper_text) == (False, "")


def test_a_fault_in_what_is_left_out_is_said_below_it(choices):
    (entry,) = controls(choices, LeftOut).values()
    assert entry.helper_text == ""
    choices.exclusions = "detectors 2"
    assert entry.error_state
    assert "found" in entry.helper_text
