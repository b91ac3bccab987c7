"""`plateviz watch`: what it prints, and its exit codes."""

import json

import pytest

from plateviz.runs import watch
from plateviz.runs.watch import Event, Watch

FITTED = Event("fitted", 3, "This solution can be trusted.", {"seconds": 2.0, "state": "good"})
EVENTS = [
    Event("watching", None, "watching DIR", {"fitted": 0}),
    Event("waiting", None, "exposures.parquet is missing", {}),
    Event("waiting", 4, "4.parquet is being written", {}),
    FITTED,
    Event("damaged", 5, "5.parquet is short", {}),
    Event("changed", 2, "2.parquet is another file", {}),
    Event("failed", 6, "no reference star", {"seconds": 1.0}),
]


@pytest.fixture
def watching(monkeypatch):
    """Return the function that lets a watch say events, and then do something."""

    def replace(events, then=lambda watcher: None):
        def follow(watcher, interval, ends):
            watcher.has_begun = True
            for event in events:
                watcher.tell(event)
            then(watcher)

        monkeypatch.setattr(Watch, "run", follow)

    return replace


def interrupt(_):
    raise KeyboardInterrupt


def test_each_event_is_a_line(run, watching):
    watching(EVENTS, interrupt)
    code, out, err = run("watch", "DIR")
    assert (code, err) == (0, "")
    lines = [line.partition("  ")[2] for line in out.splitlines()]
    assert lines == [
        "watching DIR",
        "the survey waits: exposures.parquet is missing",
        "orbit 4 waits: 4.parquet is being written",
        "orbit 3 fitted in 2.0 s. This solution can be trusted.",
        "orbit 5 cannot be read: 5.parquet is short",
        "orbit 2 has changed: 2.parquet is another file",
        "orbit 6 has no solution: no reference star",
        "ended; 0 orbits fitted",
    ]


def test_json_is_an_object_per_line(run, watching):
    watching(EVENTS)
    _, out, _ = run("watch", "DIR", "--json")
    found = [json.loads(line) for line in out.splitlines()]
    assert [(one["event"], one["orbit"]) for one in found] == [
        *((event.kind, event.orbit) for event in EVENTS),
        ("ended", None),
    ]
    assert {"time", "message", "seconds", "state"} <= set(found[3])


@pytest.mark.parametrize(
    ("failed", "distrusted", "options", "code", "message"),
    [
        ({6: "why"}, [7], [], 1, "orbits without a solution: 6"),
        ({}, [9, 7], [], 3, "should not be trusted as they are: 7, 9; --accept"),
        ({}, [7], ["--accept"], 0, ""),
    ],
    ids=["failed", "distrusted", "accepted"],
)
def test_exit_code_is_of_the_worst_orbit(run, watching, failed, distrusted, options, code, message):
    def then(watcher):
        watcher.failed, watcher.distrusted = failed, distrusted
        interrupt(watcher)

    watching([], then)
    found, _, err = run("watch", "DIR", *options)
    assert found == code
    assert message in err


def test_folder_without_a_survey_is_refused(run, tmp_path):
    code, out, err = run("watch", tmp_path, "--once")
    assert (code, out) == (2, "")
    assert "expected a survey with a file survey.toml, found none" in err


def test_interval_and_ends_are_those_of_the_options(run, monkeypatch):
    seen = []
    monkeypatch.setattr(watch.Watch, "run", lambda _, *arguments: seen.append(arguments))
    run("watch", "DIR", "--interval", "60", "--once", "--until", "9")
    assert seen == [(60.0, watch.Ends(at_once=True, until=9))]


def test_what_could_not_be_read_at_the_last_look_is_a_failure(run, watching):
    def look(watcher):
        watcher.unread = ["orbit=0001.parquet is no table"]

    watching([FITTED], look)
    code, _, err = run("watch", "DIR", "--once")
    assert code == 1
    assert "could not be read at the last look: orbit=0001.parquet is no table" in err
