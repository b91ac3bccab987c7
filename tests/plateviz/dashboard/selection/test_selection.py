"""Selection in an address: what is read back, and what is told of invalid values."""

import pytest

from plateviz.dashboard.selection.selection import Selection


@pytest.mark.parametrize("count", [1, 20])
def test_address_has_a_few_selected_sources(count):
    first, second = Selection(), Selection()
    first.sources = frozenset(range(2**63 - count, 2**63))
    second.restore(first.address())
    assert second.sources == first.sources


def test_back_and_forward_restore_the_very_selection(fit_result):
    first, second = Selection(), Selection()
    large = [frozenset(range(21)), frozenset(range(100, 140))]
    addresses = []
    for sources in large:
        first.sources = sources
        addresses.append(first.address())
    for address, sources in [*zip(addresses, large, strict=True)] * 2:
        assert first.restore({}) == []
        assert first.sources == frozenset()
        assert first.restore(address) == []
        assert first.sources == sources
    # Who opens the address elsewhere is told, also where many others are selected.
    second.sources = large[1]
    assert "room for 20" in second.restore(addresses[0])[0]
    assert second.sources == frozenset()


@pytest.mark.parametrize(
    "text", ["", "x", "1,", "99999999999999999999", "1;2", "9223372036854775808", "1," * 20 + "1"]
)
def test_invalid_selected_sources_of_an_address_are_ignored_and_told(text):
    selection = Selection()
    (told,) = selection.restore({"sources": text})
    assert told.startswith("sources: expected 20 ids or fewer, found ")
    assert selection.sources == frozenset()
