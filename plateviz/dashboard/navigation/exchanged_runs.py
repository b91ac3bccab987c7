"""Blink of two runs: the one on the screen is exchanged with the one that it is compared with."""

import param

from plateviz.dashboard.navigation.navigation import Navigation


def exchange_runs(navigation: Navigation) -> None:
    """Show the other run, and compare it with the one on the screen; nothing if there is none."""
    comparison, before = navigation.session.run_comparison, navigation.run_name
    other = comparison.run(before, navigation.known_runs)
    if other is None or before is None or not other.is_there():
        return
    # Who hears of either finds both changed.
    with param.parameterized.discard_events(comparison):
        comparison.other = before
    navigation.run_name = other.name
