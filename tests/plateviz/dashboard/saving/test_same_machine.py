"""Which requests come from the machine itself."""

import pytest

from plateviz.dashboard.saving.same_machine import is_same_machine

HERE = {"Host": "localhost:5006"}


@pytest.mark.parametrize(
    ("address", "headers", "is_here"),
    [
        ("127.0.0.1", HERE, True),
        ("::1", {"host": "[::1]:5006"}, True),
        ("127.0.0.1", {"Host": "127.0.0.1:5006"}, True),
        ("192.0.2.7", HERE, False),
        ("127.0.0.1", {"Host": "astro.example.org"}, False),
        ("127.0.0.1", {}, False),
        ("127.0.0.1", {**HERE, "X-Forwarded-For": "127.0.0.1"}, False),
        ("", HERE, False),
        ("127.0.0.1", {"Host": "[::1"}, False),
    ],
    ids=["IPv4", "IPv6", "number", "other", "proxy", "no host", "forwarded", "socket", "damaged"],
)
def test_request_of_the_machine_itself(address, headers, is_here):
    assert is_same_machine(address, headers) is is_here
