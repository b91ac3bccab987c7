"""Remedies: settings with the options that a verdict names, and none that the fit has already."""

from dataclasses import replace

import pytest

from plateviz.verdict import causes as module
from plateviz.verdict.cause_words import Said
from plateviz.verdict.remedy import remedied
from plateviz.verdict.verdict import orbit_verdict
from solver.data.settings import FitSettings
from solver.data.subset import Subset
from solver.errors import InputError
from tests.plateviz.verdict.test_verdict import with_chances

PAPER = FitSettings()


def settings(**changes):
    return PAPER.with_(**changes)


@pytest.mark.parametrize(
    ("before", "options", "after"),
    [
        ({}, ["--drift 2"], {"drift": 2}),
        ({"drift": 2}, ["--drift 3"], {"drift": 3}),
        # The default of the option changes a setting, too.
        ({"order": 3}, ["--order 5"], {"order": 5}),
        ({}, ["--noise-scale"], {"noise_scale": True}),
        (
            {"exclusions": Subset(sources=frozenset({7}))},
            ["--exclude source=7", "--exclude source=-8", "--exclude exposure=0/3"],
            {"exclusions": Subset(sources=frozenset({7, -8}), exposures=frozenset({(0, 3)}))},
        ),
        (
            {"prior_widths": {"distortion_x": 2.0}},
            ["--prior sources=1.30"],
            {"prior_widths": {"distortion_x": 2.0, "sources": 1.3}},
        ),
    ],
)
def test_options_are_added_to_the_settings(before, options, after):
    assert remedied(settings(**before), options) == settings(**after)


@pytest.mark.parametrize(
    ("before", "options"),
    [
        ({}, []),
        ({"drift": 3}, ["--drift 2"]),
        ({"order": 9}, ["--order 9"]),
        ({"robust": True}, ["--robust"]),
        ({"exclusions": Subset(detectors=frozenset({1, 2}))}, ["--exclude detector=1"]),
        ({"prior_widths": {"sources": 2.0}}, ["--prior sources=1.30"]),
    ],
)
def test_what_is_there_already_is_no_remedy(before, options):
    assert remedied(settings(**before), options) is None


def test_unknown_option_is_named():
    with pytest.raises(InputError, match="polish"):
        remedied(PAPER, ["--polish"])


def test_every_option_that_a_verdict_names_is_a_remedy(monkeypatch, fit_result):
    with_chances(monkeypatch, fit_result, drift=-40.0, noise=-40.0, outliers=-40.0)
    causes = orbit_verdict(fit_result).causes
    assert len(causes) > 1
    assert all(remedied(fit_result.settings, cause.options) for cause in causes)


def test_option_that_the_fit_has_is_not_named_again(monkeypatch, fit_result):
    with_chances(monkeypatch, fit_result, drift=-40.0)
    here = f"--order {fit_result.settings.order}"
    said = Said("drift", "it drifts", "Evidence.", "raise the order", (here,))
    monkeypatch.setattr(module, "said_of", lambda _: said)
    cause = orbit_verdict(replace(fit_result)).causes[0]
    assert cause.options == ()
    assert f"What to do: the fit has {here} already" in cause.sentence()
