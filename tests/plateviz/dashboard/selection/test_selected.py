"""What is selected: its words and its address."""

import pytest

from plateviz.dashboard.selection.large_selections import LargeSelections
from plateviz.dashboard.selection.selected import (
    FEW,
    address_of,
    checked_name,
    keys_of,
    parsed,
    selection_words,
)
from plateviz.dashboard.selection.selection import Selection
from solver.data.subset import NOTHING, Subset
from solver.errors import InputError

LARGEST = 2**63 - 1


def of(sources=(), exposures=(), detectors=()):
    return Subset(frozenset(sources), frozenset(exposures), frozenset(detectors))


@pytest.mark.parametrize(
    ("selected", "text"),
    [
        (of([7]), "1 source"),
        (of(range(1320)), "1,320 sources"),
        (of([], [(0, 3)]), "exposure 0/3"),
        (of([], [(0, n) for n in range(3, 8)]), "exposures 0/3 to 0/7"),
        (of([], [(1, 0), (0, 23), (0, 5)]), "exposures 0/5, 0/23, 1/0"),
        (of([], [(0, n) for n in (1, 3, 5, 7)]), "4 exposures"),
        (of([], [], [2]), "detector 2"),
        (of([], [], [0, 1, 2, 3]), "4 detectors"),
        (
            of(range(132), [(0, n) for n in range(3, 8)], [2]),
            "132 sources, exposures 0/3 to 0/7, detector 2",
        ),
        (NOTHING, ""),
    ],
)
def test_selection_in_words(selected, text):
    assert selection_words(selected) == text


@pytest.mark.parametrize(
    "selected",
    [
        NOTHING,
        of(range(LARGEST - FEW + 1, LARGEST + 1)),
        of([-5], [(0, 3), (12, 7)], [2, 0]),
        of([], [(0, n) for n in range(FEW)]),
        of([], [(-LARGEST, LARGEST), (0, 2028030112)], [-LARGEST]),
    ],
)
def test_address_of_a_few_is_read_back(selected):
    assert parsed(address_of(selected)) == (selected, [])


def test_address_has_a_key_of_the_kinds_of_which_many_are_selected():
    selected = of(range(FEW + 1), [(0, 1)], [1])
    address, key = address_of(selected), keys_of(selected)["sources"]
    assert address == {"sources": f"many:{key}", "exposures": "0/1", "detectors": "1"}
    assert key == keys_of(of(range(FEW, -1, -1)))["sources"]
    assert key != keys_of(of(range(1, FEW + 2)))["sources"]
    known = LargeSelections()
    known.remember(selected)
    assert parsed(address, known.find) == (selected, [])
    found, (told,) = parsed(address)
    assert found == of([], [(0, 1)], [1])
    assert "room for 20" in told
    assert "Keep gives them a name" in told


def test_large_selections_are_remembered_up_to_a_number():
    many = [of(range(n, n + 30), [(n, plate) for plate in range(30)]) for n in range(450)]
    known = LargeSelections()
    for selected in many:
        known.remember(selected)
    found = [parsed(address_of(selected), known.find) for selected in many]
    assert found[-10:] == [(selected, []) for selected in many[-10:]]
    assert found[0][0] == NOTHING
    largest = of(range(2_000_000))
    known.remember(largest)
    # It makes room for itself, and is there.
    assert parsed(address_of(largest), known.find) == (largest, [])
    assert parsed(address_of(many[-5]), known.find)[0] == NOTHING


@pytest.mark.parametrize("kind", ["sources", "exposures", "detectors"])
@pytest.mark.parametrize(
    "text",
    ["", "x", "1,", "0/1/2", "9" * 20, "1;2", str(LARGEST + 1), "1/", "<b>", f"1/{LARGEST + 1}"],
)
def test_invalid_address_selects_nothing(kind, text):
    found, (told,) = parsed({kind: text})
    assert found == NOTHING
    assert told.startswith(f"{kind}: expected {FEW} ids or fewer, found ")


@pytest.mark.parametrize("text", ["many", "many:", "many:<b>", "many:" + "0" * 16])
def test_key_that_is_not_known_selects_nothing_and_is_told(text):
    selection = Selection()
    selection.select(of(range(30)))
    (told,) = selection.restore({"sources": text})
    assert told.startswith("sources: ")
    assert selection.selected == NOTHING


def test_name_is_text_that_can_be_seen():
    assert checked_name("  the <b>odd</b>\n corner ") == "the <b>odd</b> corner"
    for text in ("", "   ", "n" * 61, "a\u202eb", "a\x00b"):
        with pytest.raises(InputError, match="name of a selection"):
            checked_name(text)


def test_name_of_a_selection_is_in_the_address():
    first, second = Selection(), Selection()
    corner = of([5, 6], [(0, 1)])
    first.select(corner)
    assert "selection" not in first.address()
    first.kept = {"<i>corner</i> & more": corner}
    second.restore(first.address())
    assert second.selected == corner
    assert second.kept == first.kept
    first.select(of(range(FEW + 1), [(0, 1)]))
    first.kept = {"many": first.selected}
    assert first.address()["selection"] == "many"
    second.kept = first.kept
    assert second.restore(first.address()) == []
    assert second.selected == first.selected
    second.select(NOTHING)
    # As a person may write it.
    assert second.restore({"selection": "many"}) == []
    assert second.selected == first.selected


@pytest.mark.parametrize(
    ("kept", "told"),
    [
        ({}, ["sources: an address has room", "selection: nothing is kept under 'corner'"]),
        (
            {"corner": of(range(1, FEW + 2), [(0, 1)])},
            ["sources: an address has room", "selection: something else is kept under 'corner'"],
        ),
        ({"corner": of(range(FEW + 1))}, ["selection: something else is kept under 'corner'"]),
    ],
    ids=["gone", "other-ids", "fewer-kinds"],
)
def test_name_that_is_gone_or_means_another_selection_is_told(kept, told):
    first, second = Selection(), Selection()
    first.select(of(range(FEW + 1), [(0, 1)]))
    first.kept = {"corner": first.selected}
    second.kept = kept
    problems = second.restore(first.address())
    assert len(problems) == len(told)
    assert all(text.startswith(words) for text, words in zip(problems, told, strict=True))
    assert second.selected <= first.selected
    assert second.exposures == first.exposures
    assert second.kept == kept


def test_small_selection_does_not_replace_what_is_kept_under_its_name():
    selection, kept = Selection(), {"corner": of([9])}
    selection.kept = kept
    (told,) = selection.restore({"sources": "5", "selection": "corner"})
    assert told == "selection: something else is kept under 'corner' by now"
    assert (selection.sources, selection.kept) == (frozenset({5}), kept)


@pytest.mark.parametrize("name", ["", "n" * 99, "a\u202eb"])
def test_invalid_name_in_an_address_keeps_nothing(name):
    selection = Selection()
    selection.restore({"sources": "5", "selection": name})
    assert selection.sources == frozenset({5})
    assert selection.kept == {}
