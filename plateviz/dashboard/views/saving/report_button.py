"""Button that saves the report of the view on the screen."""

from functools import partial

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.saving.page_report import page_report
from plateviz.dashboard.views.saving.save_button import SaveButton


def report_button(navigation: Navigation, place: str) -> SaveButton:
    """Return the button.

    Parameters
    ----------
    place : where it stands, one of those of `SaveButton`
    """
    session = navigation.session
    button = SaveButton(
        "the view on the screen",
        {"HTML": partial(page_report, navigation)},
        text="Report",
        place=place,
        theme=session.theme,
    )
    session.param.watch(lambda event: button.param.update(theme=event.new), "theme")
    return button
