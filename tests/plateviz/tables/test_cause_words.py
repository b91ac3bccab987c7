from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from plateviz.tables.cause_words import said_of
from solver.data.settings import FitSettings
from solver.results.diagnosis.table import Test


@pytest.mark.parametrize(("step", "field"), [(0, 7), (1, 2)])
def test_step_is_at_the_field_that_comes_first_in_time(step, field):
    # In time, the fields are 5, 7 and 2.
    exposures = pd.DataFrame({"field_id": [2, 5, 7], "obstime": [61_803.0, 61_801.0, 61_802.0]})
    number = np.array([2, 0, 1])
    patterns = SimpleNamespace(times=(number >= [[1], [2]]) - 0.5, n_steps=2)
    test = Test("distortion between fields", "step", (2, step), 50.0, 6.0, 3.0, -20.0, 5.0, 0.1)
    case = SimpleNamespace(
        found=SimpleNamespace(test=test),
        diagnosis=SimpleNamespace(patterns=patterns),
        result=SimpleNamespace(exposures=exposures),
    )
    said = said_of(case)
    assert said.title == f"the distortion changes at field {field}"
    assert said.words == (
        "The terms of the second degree are not the same before and after: 100 nm rms on the focal "
        "plane; χ², scaled to the scatter that is left, would fall by 50 with 6 parameters more."
    )
    assert said.options == ("--field-distortion 2",)


@pytest.mark.parametrize("robust", [False, True])
@pytest.mark.parametrize(("kurtosis", "title"), [(0.3, "more large errors"), (-0.3, "fewer large")])
def test_noise_that_is_not_normal_has_more_or_fewer_large_errors(kurtosis, title, robust):
    test = Test("kurtosis", "kurtosis", (), kurtosis, 0.0, 0.01, -400.0, 30.0)
    result = SimpleNamespace(settings=FitSettings(robust=robust))
    said = said_of(SimpleNamespace(found=SimpleNamespace(test=test), result=result))
    assert title in said.title
    assert f"is {kurtosis:+.3f}" in said.words
    # Small outliers, which a robust fit keeps, make large errors and no small ones.
    assert ("outliers" in said.words) == (robust and kurtosis > 0.0)
