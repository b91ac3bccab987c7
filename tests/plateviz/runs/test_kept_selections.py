"""Kept selections on disk: read back, of two people at once, damaged, too many."""

import json
import threading

import pytest

from plateviz.runs.kept_selections import FILE, MOST, KeptSelections, TakenError
from plateviz.runs.kept_solutions import KeptSolutions
from solver.data.subset import Subset
from solver.errors import InputError

CORNER = Subset(
    frozenset({-(2**62), 4_057_482_027_171_038_209}), frozenset({(0, 3), (1, -2)}), frozenset({1})
)
OTHER = Subset(detectors=frozenset({2}))
NAME = "<img src=x onerror=alert(1)> “corner”"


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "solutions"


@pytest.fixture
def kept(folder):
    return KeptSelections(folder)


def test_selection_is_read_back_by_another_server(kept, folder):
    assert kept.all() == {}
    kept.keep(NAME, CORNER, None)
    kept.keep("b", OTHER, None)
    assert KeptSelections(folder).all() == {NAME: CORNER, "b": OTHER} == kept.all()
    # It is no kept solution.
    assert KeptSolutions(folder).all() == []


def test_selection_of_somebody_else_is_neither_replaced_nor_forgotten(kept, folder):
    other = KeptSelections(folder)
    kept.keep("a", CORNER, None)
    with pytest.raises(TakenError):
        other.keep("a", OTHER, None)
    other.forget("a", OTHER)
    assert kept.all() == {"a": CORNER}
    other.keep("a", OTHER, CORNER)
    assert kept.all() == {"a": OTHER}
    kept.forget("a", OTHER)
    kept.forget("gone", OTHER)
    assert other.all() == {}


def test_two_people_at_once_lose_nothing(folder):
    def keep(person):
        for number in range(6):
            KeptSelections(folder).keep(f"{person} {number}", OTHER, None)

    threads = [threading.Thread(target=keep, args=(person,)) for person in "abc"]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert len(KeptSelections(folder).all()) == 18


def content(**changes):
    selections = {"a": {"sources": [1], "exposures": [[0, 1]], "detectors": []}}
    whole = {"format": "plateviz selections", "version": 1, "selections": selections}
    return json.dumps(whole | changes)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "kept selections"),
        ("{", "kept selections"),
        ("[]", "another file"),
        ('{"format": "x"}', "another file"),
        (content(version=2), "expected version 1, found '2'"),
        (content(selections=[]), "by their names"),
        (content(selections={"a": {"sources": ["1"]}}), "others in 'a'"),
        (content(selections={"a": {"exposures": [[1, 2, 3]]}}), "others in 'a'"),
        (content(selections={"a": {"detectors": [True]}}), "others in 'a'"),
        (content(selections={"a": 3}), "others in 'a'"),
        (" " * 2_000_001, "bytes or fewer"),
    ],
)
def test_damaged_file_is_named_and_left_as_it_is(kept, folder, text, says):
    folder.mkdir()
    (folder / FILE).write_text(text, encoding="utf-8")
    for act in (kept.all, lambda: kept.keep("b", OTHER, None), lambda: kept.forget("a", OTHER)):
        with pytest.raises(InputError, match=says):
            act()
    assert (folder / FILE).read_text(encoding="utf-8") == text


def test_only_so_many_are_kept(kept):
    for number in range(MOST):
        kept.keep(f"{number}", OTHER, None)
    with pytest.raises(InputError, match=f"{MOST} selections"):
        kept.keep("one more", OTHER, None)
    kept.keep("3", CORNER, OTHER)
    assert len(kept.all()) == MOST
