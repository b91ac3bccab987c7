"""CodeDialog: the code that makes what is on the screen."""

import pytest

from plateviz.dashboard.views.dialogs.code_dialog import _unbroken


@pytest.mark.parametrize(
    ("text", "markup"),
    [
        ("Without --orbits, all.", "Without <span class='option'>--orbits</span>, all."),
        ("report -o a-b.html", "report <span class='option'>-o</span> a-b.html"),
        ("--leave-out 'a<b'", "<span class='option'>--leave-out</span> &#x27;a&lt;b&#x27;"),
        ("solution(x=-1, y=2 - x)", "solution(x=-1, y=2 - x)"),
    ],
)
def test_options_stay_in_one_line(text, markup):
    assert _unbroken(text) == markup
