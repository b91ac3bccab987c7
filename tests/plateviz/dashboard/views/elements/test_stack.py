"""Stack: parts that are made when they are first shown, and then hidden and shown again."""

import panel as pn

from plateviz.dashboard.views.elements.stack import Stack


def test_part_is_made_once_when_it_is_first_shown():
    made = []

    def maker(name):
        def make():
            made.append(name)
            return pn.Column(name)

        return make

    stack = Stack({name: maker(name) for name in "abc"})
    assert made == []
    for name in "bab":
        stack.show(name)
    assert made == ["b", "a"]


def test_only_the_shown_part_is_visible():
    parts = {"a": pn.Column(), "b": pn.Column()}
    stack = Stack({name: lambda part=part: part for name, part in parts.items()})
    stack.show("a")
    stack.show("b")
    assert [part.styles["visibility"] for part in parts.values()] == ["hidden", "inherit"]
    assert list(stack.__panel__()) == list(parts.values())
