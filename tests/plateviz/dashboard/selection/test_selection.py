"""Selection in an address: what is read back, and what is told of invalid values."""

import pytest

from plateviz.dashboard.selection.selection import ALL, Selection
from plateviz.dashboard.session.session import Session
from solver.data.instrument import MINI_MOCK
from solver.errors import InputError
from tests.plateviz.dashboard.session.test_session import FakeStore


def test_address_restores_the_selection(fit_result):
    numbers = [d.detector_id for d in MINI_MOCK.detectors]
    first, second = Selection(), Selection()
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
    selection = Selection()
    problems = selection.restore(address) + selection.limit_to(fit_result, [1, 2])
    assert len(problems) == len(told)
    assert all(text.startswith(words) for text, words in zip(problems, told, strict=True))
    lowest, highest = selection.param["plates"].bounds
    assert lowest <= selection.plates[0] <= selection.plates[1] <= highest
    assert selection.field in selection.param["field"].objects
    # It is told once.
    assert selection.limit_to(fit_result, [1, 2]) == []


def test_address_has_what_is_shown_once_an_orbit_is_there(fit_result):
    untouched, requesting = Selection(), Selection()
    assert untouched.address() == {}
    wanted = {"field": "2", "plates": "1-1"}
    requesting.restore(wanted)
    assert requesting.address() == wanted
    other = Selection()
    for selection in (untouched, requesting, other):
        assert selection.limit_to(fit_result, [1, 2]) == []
    assert untouched.address() == {"field": "0", "plates": "0-0", "detector": "1"}
    assert requesting.address() == wanted | {"detector": "1"}
    # An address of before is requested again, until its orbit is there or somebody chooses.
    other.restore(wanted)
    assert other.address() == requesting.address()
    other.field = "3"
    other.limit_to(fit_result, [1, 2])
    assert other.address() == requesting.address() | {"field": "3"}


def test_address_names_an_orbit(fit_result):
    selection = Session(FakeStore(fit_result)).selection
    assert selection.orbit_of({"orbit": "1"}) == 1
    assert selection.orbit_of({}) == selection.orbit == 0
    with pytest.raises(InputError, match="orbit: expected one of 0, 1, found '7'"):
        selection.orbit_of({"orbit": "7"})


@pytest.mark.parametrize("count", [1, 20])
def test_address_has_a_few_selected_sources(count):
    first, second = Selection(), Selection()
    first.sources = frozenset(range(2**63 - count, 2**63))
    second.restore(first.address())
    assert second.sources == first.sources


def test_back_and_forward_restore_the_very_selection(fit_result):
    first, second = Selection(), Selection()
    large = [frozenset(range(21)), frozenset(range(100, 140))]
    addresses = []
    for sources in large:
        first.sources = sources
        addresses.append(first.address())
    for address, sources in [*zip(addresses, large, strict=True)] * 2:
        assert first.restore({}) == []
        assert first.sources == frozenset()
        assert first.restore(address) == []
        assert first.sources == sources
    # Who opens the address elsewhere is told, also where many others are selected.
    second.sources = large[1]
    assert "room for 20" in second.restore(addresses[0])[0]
    assert second.sources == frozenset()


@pytest.mark.parametrize(
    "text", ["", "x", "1,", "99999999999999999999", "1;2", "9223372036854775808", "1," * 20 + "1"]
)
def test_invalid_selected_sources_of_an_address_are_ignored_and_told(text):
    selection = Selection()
    (told,) = selection.restore({"sources": text})
    assert told.startswith("sources: expected 20 ids or fewer, found ")
    assert selection.sources == frozenset()
