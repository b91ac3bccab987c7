"""Keys: what the keys of the keyboard do, without Panel."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

from plateviz.dashboard.navigation.exchanged_runs import exchange_runs
from plateviz.dashboard.navigation.navigation import Navigation, View


class Key(NamedTuple):
    """What a key does.

    Attributes
    ----------
    does : in a few words, for the list of the keys
    act : does it on the page of a navigation; nothing where there is nothing to do
    is_of_orbit : whether it does something on the Orbit view only
    is_repeated : whether it does it again and again while it is held
    """

    does: str
    act: Callable[[Navigation], None]
    is_of_orbit: bool = True
    is_repeated: bool = False


def press(navigation: Navigation, key: str) -> None:
    """Do what a key does; a key without a meaning does nothing.

    Parameters
    ----------
    key : as browsers name it (`KeyboardEvent.key`)
    """
    if key in KEYS:
        if navigation.view is View.ORBIT or not KEYS[key].is_of_orbit:
            KEYS[key].act(navigation)
    elif key in DIGITS:
        workspaces = navigation.workspaces_of_view
        number = DIGITS.index(key)
        if number < len(workspaces):
            navigation.turn_to_workspace(workspaces[number])


def _turn_to_next_view(navigation: Navigation) -> None:
    views = list(View)
    navigation.turn_to(views[(views.index(navigation.view) + 1) % len(views)])


def _blink(navigation: Navigation) -> None:
    if navigation.view is View.ORBIT:
        navigation.session.exchange()
    elif navigation.view is View.SURVEY:
        exchange_runs(navigation)


def _step_orbit(navigation: Navigation, step: int) -> None:
    session = navigation.session
    orbits = session.shown_part.param["orbit"].objects
    place = orbits.index(session.shown_part.orbit) + step
    if 0 <= place < len(orbits):
        navigation.choose_orbit(orbits[place])


def _step_exposures(navigation: Navigation, step: int) -> None:
    """Move the range of exposures, as long as it is, within those of the orbit."""
    part = navigation.session.shown_part
    first, last = (plate + step for plate in part.plates)
    lowest, highest = part.param["plates"].bounds
    if lowest <= first and last <= highest:
        part.plates = (first, last)


def _step_detector(navigation: Navigation, step: int) -> None:
    part = navigation.session.shown_part
    detectors = list(part.param["detector"].objects)
    place = detectors.index(part.detector) + step
    part.detector = detectors[place % len(detectors)]


KEYS: Mapping[str, Key] = MappingProxyType(
    {
        "v": Key("Next view: Survey, Orbit, Source", _turn_to_next_view, is_of_orbit=False),
        "]": Key("Next orbit", lambda n: _step_orbit(n, 1)),
        "[": Key("Previous orbit", lambda n: _step_orbit(n, -1)),
        ".": Key("Next exposure", lambda n: _step_exposures(n, 1), is_repeated=True),
        ",": Key("Previous exposure", lambda n: _step_exposures(n, -1), is_repeated=True),
        "d": Key("Next detector", lambda n: _step_detector(n, 1)),
        "D": Key("Previous detector", lambda n: _step_detector(n, -1)),
        "b": Key("Blink: exchange the two solutions, or the two runs", _blink, is_of_orbit=False),
        "f": Key("Fit with the settings of the controls", lambda n: n.session.refit()),
        "k": Key("Add the what-if to the list of solutions", lambda n: n.session.list_what_if()),
    }
)
"""Key -> what it does, in the order of the list that "?" shows."""

DIGITS = tuple("123456789")
"""The keys of the workspaces of the view on the screen."""
