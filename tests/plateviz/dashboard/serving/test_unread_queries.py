"""Addresses that Panel cannot read."""

import pytest
from panel.io.location import Location

from plateviz.dashboard.serving.unread_queries import ignore_unreadable_queries, readable


@pytest.mark.newest
@pytest.mark.parametrize("value", ["²", "1" * 5000])
def test_query_with_what_only_looks_like_a_number_is_no_error(value):
    ignore_unreadable_queries()
    location = Location()
    location.search = f"?orbit={value}"
    # Later versions of Panel read a superscript as a text.
    assert location.query_params in ({}, {"orbit": value})
    location.search = "?orbit=3"
    assert location.query_params == {"orbit": 3}


def test_theme_is_one_that_there_is():
    others = {"view": [b"\xff"], "orbit": [b"1", b"2"]}
    assert readable({"theme": [b"\xff"], **others}) == others
    assert readable({"theme": [b"dark", b"default"], **others}) == others
    assert readable({"theme": [b"dark"], **others}) == {"theme": [b"dark"], **others}
