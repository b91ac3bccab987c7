"""Stage: the state of the solution on the screen of a session; RequestState: and why, in words."""

from collections.abc import Iterable
from enum import Enum
from typing import Any

import param

from plateviz.solving.job import Job

# A what-if is over sooner, as a rule, and nobody could read words on it.
_BRIEF_SECONDS = 1.0
_NOTICE = "Not all that was asked for can be shown: "


class Stage(Enum):
    """State of the solution on the screen."""

    LOADING = "the first solution is being computed"
    READY = "the solution is the requested one"
    STALE = "another solution is being computed"
    FAILED = "the last request failed"


class RequestState(param.Parameterized):
    """State of what was asked for last.

    `stage` and `message` are the state of the last request, and `is_brief` is whether it is a
    what-if that has only begun, of which nothing is said yet. `notice` says what of the last
    address, or saved view, cannot be shown, `remark` why the last drag has selected nothing,
    `advice` what to do for the last change of the settings to take effect, and `loss` that the run
    on the screen is gone, or another one.
    """

    stage = param.ClassSelector(class_=Stage, default=Stage.LOADING)
    message = param.String(default="")
    is_brief = param.Boolean(default=False)
    notice = param.String(default="")
    remark = param.String(default="")
    advice = param.String(default="")
    loss = param.String(default="")

    def refuse(self, message: str) -> None:
        """Show why a request failed; the last solution stays."""
        self.param.update(stage=Stage.FAILED, message=message, is_brief=False)

    def follow(self, job: Job, **changes: Any) -> None:  # noqa: ANN401 values of any parameters
        """Take over how far a job is, with other changes of the state."""
        is_brief = bool(job.request.get("what_if")) and job.seconds < _BRIEF_SECONDS
        self.param.update(message=job.progress_text, is_brief=is_brief, **changes)

    def note(self, problems: Iterable[str]) -> None:
        """Add what of an address cannot be shown to the notice."""
        before = self.notice.removeprefix(_NOTICE).rstrip(".")
        told = "; ".join(filter(None, [before, *problems]))
        self.notice = f"{_NOTICE}{told}." if told else ""
