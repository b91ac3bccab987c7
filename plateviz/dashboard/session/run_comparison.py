"""RunComparison: the run that the run on the screen is compared with, without Panel.

    view=survey&workspace=compare-runs&run=B&other=A&figure=orbit-health

The run on the screen is B, the other one A.
"""

from collections.abc import Mapping

import param

from plateviz.dashboard.address_parts import chosen
from plateviz.plots.comparison.both_runs import comparable_survey_figures
from plateviz.runs.run import Run
from solver.errors import InputError

OF_RUNS = ("other", "figure")
"""Parts of an address."""


class RunComparison(param.Parameterized):
    """The other run of one browser session, and the figure that is drawn of both.

    `other` is empty for the first run that is not on the screen. `state` changes once anything of
    the other run is written, or the run is removed.
    """

    other = param.String(default="", doc="name of the run that is compared with")
    figure = param.String(default="orbit-health", doc="name of what is drawn of both runs")
    state = param.Parameter(default=None, doc="see `Run.stamp`; why there is none if so")

    def run(self, on_screen: str | None, runs: Mapping[str, Run]) -> Run | None:
        """Return the run that is compared with; None if the survey has no second one.

        Parameters
        ----------
        on_screen : name of the run on the screen
        runs : all runs of the survey, by name
        """
        others = {name: run for name, run in runs.items() if name != on_screen}
        return others.get(self.other) or next(iter(others.values()), None)

    def look(self, on_screen: str | None, runs: Mapping[str, Run]) -> None:
        """Look whether anything of the other run has been written, or it is gone."""
        other = self.run(on_screen, runs)
        try:
            self.state = None if other is None else other.stamp()
        except InputError as error:
            self.state = str(error)

    def restore(
        self, address: Mapping[str, str], on_screen: str | None, runs: Mapping[str, Run]
    ) -> list[str]:
        """Compare what an address requests; return what of it is invalid, in words."""
        problems: list[str] = []
        others = [name for name in runs if name != on_screen]
        figures = [one.name for one in comparable_survey_figures()]
        self.param.update(
            other=chosen("other", address, others, self.other, problems),
            figure=chosen("figure", address, figures, self.figure, problems),
        )
        return problems

    def address(self, on_screen: str | None, runs: Mapping[str, Run]) -> dict[str, str]:
        """Return what is compared as the query of the page's address; `restore` reads it back."""
        other = self.run(on_screen, runs)
        return {} if other is None else {"other": other.name, "figure": self.figure}
