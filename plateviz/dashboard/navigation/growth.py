"""Growth of a run that is being fitted: how far it is, and when the rest will be done."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from shlex import quote

from plateviz.runs.run import RunProgress
from plateviz.solving.origin import Origin, SurveyFolder
from plateviz.tables.counts import duration_text, orbits_are

# After so many seconds without another orbit, nobody seems to fit the rest.
_PATIENCE = 120.0
_OPEN = "All orbits that have arrived are done. This page follows when another one arrives."
# Number of new orbits from which their rate is stated.
_FEW = 2


class Growth:
    """What has been seen of one run, look by look."""

    def __init__(
        self, directory: Path, run: str, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Begin without a look.

        Parameters
        ----------
        directory : of the survey
        run : name of the run
        clock : returns a time in seconds
        """
        self._arguments = f"{quote(str(directory))} --run {quote(run)}"
        self._clock = clock
        self._first: tuple[float, int] | None = None
        self._last: tuple[float, RunProgress] | None = None

    def look(self, progress: RunProgress) -> str:
        """Take what the run has now; return how far it is, or "" if nothing is to come."""
        now, done = self._clock(), progress.n_fitted + progress.n_failed
        if self._first is None:
            self._first = now, done
        if self._last is None or self._last[1] != progress:
            self._last = now, progress
        is_over = done >= progress.n_orbits
        if progress.is_complete:
            return ""
        if is_over and progress.is_gathered:
            return _OPEN if progress.grows else ""
        counts = f"{done:,} of {orbits_are(progress.n_orbits)} done"
        if is_over:
            words = f"{counts}; the tables over all of them are missing yet."
        else:
            words = f"{counts}{self._rest(now, progress)}."
        if now - self._last[0] > _PATIENCE:
            command = f"`plateviz {'watch' if progress.grows else 'survey'} {self._arguments}`"
            return f"{words} Nothing has been added for some minutes: {command} continues it."
        return f"{words} This page follows by itself."

    def _rest(self, now: float, progress: RunProgress) -> str:
        """Return the rate and the time that the rest takes at that rate."""
        started, before = self._first or (now, 0)
        done = progress.n_fitted + progress.n_failed
        if done - before < _FEW or self._last is None:
            return ""
        per_second = (done - before) / (self._last[0] - started)
        seconds = (progress.n_orbits - done) / per_second
        return f", {60 * per_second:.2g} per minute, about {duration_text(seconds)} left"


def how_to_make_a_run(origin: Origin) -> str:
    """Return how orbits of an origin become a run."""
    if isinstance(origin, SurveyFolder):
        return (
            "This survey has not been fitted as a whole. "
            f"`plateviz survey {origin.directory}` fits all its orbits; "
            "this page shows them once it has begun."
        )
    return (
        "These are the files of one orbit. For a survey directory, `plateviz survey DIR` "
        "fits all orbits, and `plateviz serve DIR` shows them here."
    )


def how_to_make_another_run(origin: Origin, run: str, options: Sequence[str] = ()) -> str:
    """Return how a survey with one run gets a second one to compare it with.

    Parameters
    ----------
    options : of the command line that the verdict on the run suggests
    """
    directory = quote(origin.directory) if isinstance(origin, SurveyFolder) else "DIR"
    chosen = " ".join(options) or "--order 3"
    what = "what the verdict suggests" if options else "another order, for example"
    return (
        f"This survey has one run, {run}, and two are compared here. "
        f"`plateviz survey {directory} --run other {chosen}` makes a second one with {what}; "
        "this page shows it once it has begun."
    )
