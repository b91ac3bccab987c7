"""Settings that differ, in words that tell an unset one from a set one."""

import pytest

from plateviz.verdict.changes import setting_changes
from solver.data.settings import FitSettings
from solver.data.subset import Subset


@pytest.mark.parametrize(
    ("changed", "row"),
    [
        ({"order": 3}, ("Distortion order", "order 5", "order 3")),
        ({"drift": 2}, ("Drift of the distortion", "none", "drift 2")),
        ({"robust": True}, ("Leave out outliers", "no", "without outliers")),
        ({"aberration": False}, ("Stellar aberration", "yes", "no aberration")),
        ({"engine": "svi"}, ("Engine", "gauss-newton", "svi")),
        ({"exclusions": Subset(detectors=frozenset({1}))}, ("Leave out", "none", None)),
        ({"prior_widths": {"sources": 2.0}}, ("Prior widths", "default", "sources 2")),
    ],
    ids=lambda one: next(iter(one)) if isinstance(one, dict) else "",
)
def test_setting_that_differs_is_said_of_both(changed, row):
    (found,) = setting_changes(FitSettings(), FitSettings(**changed))
    label, of_a, of_b = row
    assert found[:2] == (label, of_a)
    assert of_b in (None, found[2])
    assert setting_changes(FitSettings(**changed), FitSettings()) == [
        (label, found[2], found[1], "")
    ]


def test_equal_settings_have_no_rows():
    assert setting_changes(FitSettings(drift=2), FitSettings(drift=2)) == []
