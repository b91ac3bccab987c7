"""A change of a control is taken when it arrives, not some time later."""

import pytest

from plateviz.dashboard.session.fit_choices import FitChoices
from plateviz.dashboard.views.controls.fit_controls import controls, width_input
from plateviz.dashboard.views.controls.shown_part import ShownPartView
from solver.data.parameters import BY_NAME
from solver.data.setting_kinds import Whole


class Document:
    """A document that notes how long callbacks are put off."""

    session_context = "of a browser"

    def __init__(self):
        self.put_off = []

    def add_timeout_callback(self, callback, milliseconds):
        self.put_off.append(milliseconds)


@pytest.mark.parametrize(
    "control",
    [
        lambda navigation: controls(FitChoices(), Whole)["order"],
        lambda navigation: width_input(FitChoices(), BY_NAME["sources"]),
        lambda navigation: ShownPartView(navigation).__panel__()[2],
    ],
    ids=["order", "prior", "exposures"],
)
def test_change_is_taken_at_once(navigation, control):
    document = Document()
    control(navigation)._server_change(document, "of the page", None, "value", None, 3)
    assert document.put_off == [0]
