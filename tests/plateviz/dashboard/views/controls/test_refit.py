"""The card of the causes of errors: each cause of the settings has a control on the page."""

import pytest

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.views.controls.fit_controls import width_input
from plateviz.dashboard.views.controls.refit import RefitView
from solver.data.parameters import OPTIONAL_GROUPS
from solver.data.settings import SETTINGS
from tests.plateviz.dashboard.fake_survey import SurveyStore


@pytest.fixture
def view(fit_result):
    navigation = Navigation(Session(SurveyStore(fit_result, [])))
    navigation.begin({"view": "orbit"})
    return RefitView(navigation)


def test_every_cause_can_be_switched_on_and_its_priors_follow(view):
    (card,) = [one for one in view.__panel__() if getattr(one, "title", "") == "Causes of errors"]
    assert not len(card.objects)
    card.collapsed = False
    shown = {getattr(one, "label", "") for one in card}
    causes = {name: one for name, one in SETTINGS.items() if one.is_cause}
    assert len(causes) > 10
    for name, one in causes.items():
        assert any(label.startswith(one.label) for label in shown), name
    choices = view._session.choices
    for group in OPTIONAL_GROUPS:
        label = width_input(choices, group).label
        (entry,) = [one for one in card if getattr(one, "label", "") == label]
        before = getattr(choices, group.setting)
        assert entry.visible == bool(before), group.name
        setattr(choices, group.setting, True if isinstance(before, bool) else 2)
        assert entry.visible, group.name
