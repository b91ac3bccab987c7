"""The words at the pointer stand apart from the figures, and take the theme of the page."""

import pytest

from plateviz.dashboard.views.browser.system_theme import SystemTheme
from plateviz.figures.theme import THEMES


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_words_at_the_pointer_have_the_theme_of_the_page(theme):
    system = SystemTheme()
    system.follow(theme)
    assert f"--tooltip-color: {THEMES[theme].background};" in system.style
    assert f"--tooltip-text: {THEMES[theme].text};" in system.style
