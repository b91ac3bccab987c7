"""ShownPart: what of an orbit is shown, what can be, and how an address says it."""

import pytest

from plateviz.dashboard.session.session import Session
from plateviz.dashboard.session.shown_part import ALL, ShownPart
from solver.data.instrument import MINI_MOCK
from solver.errors import InputError
from tests.plateviz.dashboard.fake_store import FakeStore


def test_address_restores_what_is_shown(fit_result):
    numbers = [d.detector_id for d in MINI_MOCK.detectors]
    first, second = ShownPart(), ShownPart()
    first.limit_to(fit_result, numbers)
    last = first.param["plates"].bounds[1]
    first.param.update(field=ALL, detector=str(numbers[-1]), plates=(last, last))
    second.restore(first.address())
    second.limit_to(fit_result, numbers)
    assert second.address() == first.address()


@pytest.mark.parametrize(
    ("address", "told"),
    [
        (
            {"field": "99", "detector": "none", "plates": "many", "unknown": "x"},
            ["plates: expected FIRST-LAST", "field: expected all, 0, 1, 2, 3, found '99'", "detec"],
        ),
        ({"plates": "3", "field": ""}, ["plates: expected FIRST-LAST", "field: expected all"]),
        ({"plates": "1-900"}, ["plates: expected exposures from 0 to 2"]),
        ({"plates": "0-1", "field": "2"}, []),
    ],
    ids=["nonsense", "half", "beyond", "valid"],
)
def test_invalid_address_is_ignored_and_told(fit_result, address, told):
    part = ShownPart()
    problems = part.restore(address) + part.limit_to(fit_result, [1, 2])
    assert len(problems) == len(told)
    assert all(text.startswith(words) for text, words in zip(problems, told, strict=True))
    lowest, highest = part.param["plates"].bounds
    assert lowest <= part.plates[0] <= part.plates[1] <= highest
    assert part.field in part.param["field"].objects
    # It is told once.
    assert part.limit_to(fit_result, [1, 2]) == []


def test_address_has_what_is_shown_once_an_orbit_is_there(fit_result):
    untouched, requesting = ShownPart(), ShownPart()
    assert untouched.address() == {}
    wanted = {"field": "2", "plates": "1-1"}
    requesting.restore(wanted)
    assert requesting.address() == wanted
    other = ShownPart()
    for part in (untouched, requesting, other):
        assert part.limit_to(fit_result, [1, 2]) == []
    assert untouched.address() == {"field": "0", "plates": "0-0", "detector": "1"}
    assert requesting.address() == wanted | {"detector": "1"}
    # An address of before is requested again, until its orbit is there or somebody chooses.
    other.restore(wanted)
    assert other.address() == requesting.address()
    other.field = "3"
    other.limit_to(fit_result, [1, 2])
    assert other.address() == requesting.address() | {"field": "3"}


def test_address_names_an_orbit(fit_result):
    part = Session(FakeStore(fit_result)).shown_part
    assert part.orbit_of({"orbit": "1"}) == 1
    assert part.orbit_of({}) == part.orbit == 0
    with pytest.raises(InputError, match="orbit: expected one of 0, 1, found '7'"):
        part.orbit_of({"orbit": "7"})


def test_part_has_the_exposures_and_detectors_of_the_solution(fit_result):
    part = ShownPart()
    part.limit_to(fit_result, [0, 1, 2, 3])
    assert part.field == "0"
    assert part.exposures_of(fit_result) == [(0, 0)]
    part.field = ALL
    part.plates = (0, 1)
    assert len(part.exposures_of(fit_result)) == 8
    assert part.detector_id == 0
    part.detector = ALL
    assert part.detector_id is None


@pytest.mark.parametrize(
    ("name", "value"), [("plates", (0, 99)), ("detector", "17"), ("field", "9")]
)
def test_part_out_of_range_is_refused(fit_result, name, value):
    part = ShownPart()
    part.limit_to(fit_result, [0, 1, 2, 3])
    with pytest.raises(ValueError, match=name):
        setattr(part, name, value)
