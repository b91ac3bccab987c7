"""A run and a store of a survey that the dashboard's tests show, without files or a solver."""

from dataclasses import replace
from pathlib import Path

from plateviz.runs.run import RunProgress
from plateviz.solving.origin import SurveyFolder
from solver.data.settings import FitSettings
from tests.plateviz.dashboard.fake_store import FakeStore

SOURCE_COUNTS = ("source_id", "is_reference", "is_artificial", "n_orbits", "n_obs")


class FakeRun:
    """A run of two orbits, the second not fitted; `settings` are those of the first."""

    def __init__(self, name, survey, result, settings=None, is_complete=True):
        self.name, self.is_complete = name, is_complete
        self.is_gathered = is_complete
        self._survey = survey
        self._settings = settings or FitSettings()
        self._result = replace(result, settings=self._settings)
        self.survey = Path("sky")
        self.n_fitted = 2 if is_complete else 1
        self.read, self.expected, self.also_written = [], [], {}

    def test_table(self, name):
        return None

    def stamp(self):
        return self.progress()

    def header(self):
        return {"settings": self._settings.to_dict()}

    def progress(self):
        found = RunProgress(2, self.n_fitted, 0, self.is_gathered, self.is_complete)
        return found._replace(**self.also_written)

    def has_fitted(self, orbit):
        return orbit == 0

    def result(self, orbit):
        self.read.append(orbit)
        return self._result

    def expect(self, orbit):
        self.expected += [] if orbit is None else [orbit]

    def history(self, source_id):
        rows = self._survey.history
        return rows[rows["source_id"] == source_id].reset_index(drop=True)

    def orbits(self):
        return self._survey.orbits

    def motions(self):
        return self._survey.motions

    def counts(self):
        return self._survey.motions[list(SOURCE_COUNTS)]

    def motion(self, source_id):
        rows = self._survey.motions
        found = rows[rows["source_id"] == source_id]
        return None if found.empty else found.astype(object).iloc[0]


class SurveyStore(FakeStore):
    """A store over a survey with runs."""

    origin = SurveyFolder("sky")

    def __init__(self, result, runs):
        super().__init__(result)
        self._runs = runs

    def runs(self):
        return self._runs
