"""Parts of an address: those that are written are known, and others are told."""

import pytest

from plateviz.dashboard.address_parts import repeated_parts, unknown_parts
from plateviz.dashboard.navigation.navigation import View
from plateviz.plots.explore.explored_rows import ExploredColumns
from plateviz.plots.explore.explored_text import parts_of
from plateviz.plots.workspace import OrbitWorkspace
from solver.data.subset import Subset
from tests.plateviz.dashboard.navigation.test_navigation import again


@pytest.mark.parametrize(
    ("names", "told"),
    [
        ([], []),
        (["view", "bokeh-session-id", "theme"], []),
        (["viw"], ["'viw'"]),
        (["a", "view", "b", "c", "d", "e"], ["'a', 'b', 'c' and 2 more"]),
        (["x" * 99], ["'" + "x" * 39 + "…"]),
    ],
)
def test_unknown_parts_are_named(names, told):
    problems = unknown_parts(dict.fromkeys(names, "1"), {"view"})
    assert problems == [f"unknown parts, as of another version: {words}" for words in told]


def test_address_with_an_unknown_part_shows_the_rest(navigation):
    navigation.begin({"view": "orbit", "workspace": "sky", "tilt": "<b>3</b>"})
    assert navigation.workspace is OrbitWorkspace.SKY
    assert navigation.session.shown.run == "default"
    assert "unknown parts, as of another version: 'tilt'" in navigation.session.notice


def test_every_part_that_is_written_is_known(navigation, survey):
    navigation.open_source(str(survey.motions["source_id"].iloc[0]))
    navigation.open_orbit(0)
    session = navigation.session
    session.selection.select(Subset(frozenset({1}), frozenset({(0, 1)}), frozenset({2})))
    session.selection.kept = {"all": session.selection.selected}
    session.units.unit = "mpix"
    session.compare_with(session.shown._replace(run="other"))
    for workspace in OrbitWorkspace:
        navigation.turn_to_workspace(workspace)
        assert "unknown" not in again(navigation).session.notice
    drawn = ExploredColumns(
        "x", "y", "c", "o", 0.0, 1.0, True, True, True, ((0, 1), (0, 1)), "exposures"
    )
    explored = parts_of("sources", drawn)
    assert len(explored) == 9
    navigation.begin({"view": View.SURVEY.value, **explored})
    assert "unknown" not in navigation.session.notice


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"orbit": [b"3"], "unit": [b"mas", b"mas"]}, []),
        (
            {"view": [b"orbit", b"survey"], "unit": [b"mas", b"mas"], "orbit": [b"3"]},
            ["the address gives 'view' 2 times, and the first one is shown"],
        ),
        (
            {"view": [b"orbit", b"survey"], "unit": [b"mas", b"own", b"mas"]},
            ["the address gives 'view' 2 times, 'unit' 3 times, and the first of each is shown"],
        ),
        (
            dict.fromkeys("abcde", [b"1", b"2"]),
            [
                "the address gives 'a' 2 times, 'b' 2 times, 'c' 2 times and 2 more, "
                "and the first of each is shown"
            ],
        ),
    ],
    ids=["none", "one", "two", "many"],
)
def test_parts_that_an_address_repeats_are_told(given, told):
    assert repeated_parts(given) == told
