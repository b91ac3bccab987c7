"""`plateviz serve`: where it listens, and from which pages it takes a websocket."""

import pytest

from plateviz.dashboard.server import check_origin, check_prefix
from solver.errors import InputError


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--allow-origin", "https://astro.example.org"], "expected a host such as"),
        (["--allow-origin", "*"], "found '*'"),
        (["--prefix", "a b"], "--prefix: expected a path such as plateviz, found 'a b'"),
        (["--prefix", "../up?x"], "--prefix: expected a path"),
    ],
    ids=["address", "any host", "space", "query"],
)
def test_a_proxy_that_cannot_be_is_refused(run, tmp_path, options, message):
    code, _, err = run("serve", tmp_path, "--port", "0", "--no-open", *options)
    assert code == 2
    assert message in err


def test_hosts_are_compared_as_browsers_send_them():
    assert check_origin("Astro.Example.org:8443 ") == "astro.example.org:8443"


def test_slashes_around_a_path_do_not_matter():
    assert check_prefix("/groups/plateviz/") == "groups/plateviz"
    assert check_prefix("") == ""


@pytest.mark.parametrize("text", ["", "host:", "host:80:80", ".example.org"])
def test_what_is_no_host_is_refused(text):
    with pytest.raises(InputError, match="--allow-origin"):
        check_origin(text)
