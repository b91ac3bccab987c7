"""Whether a page is read on the machine that serves it."""

from collections.abc import Mapping
from ipaddress import ip_address
from urllib.parse import urlsplit

# What a proxy adds to what it passes on.
_OF_PROXIES = {"forwarded", "via", "x-forwarded-for", "x-forwarded-host", "x-real-ip"}


def is_same_machine(address: str, headers: Mapping[str, str]) -> bool:
    """Return whether a request comes from this machine, and through no proxy.

    A tunnel to this machine, as by SSH, cannot be told from it.

    Parameters
    ----------
    address : from which the request comes
    headers : of the request
    """
    names = {name.lower(): value for name, value in headers.items()}
    if _OF_PROXIES & names.keys():
        return False
    try:
        host = urlsplit(f"//{names.get('host', '')}").hostname or ""
        return ip_address(address).is_loopback and (
            host == "localhost" or ip_address(host).is_loopback
        )
    except ValueError:
        return False
