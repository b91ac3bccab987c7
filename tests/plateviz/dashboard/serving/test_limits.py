"""Limits of one client, and of the pages that are open."""

import pytest

from plateviz.dashboard.serving import limits
from plateviz.dashboard.serving.limits import PageLimit, Rate, RateLimit


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


def test_each_client_may_ask_so_often_at_once_and_then_so_often_a_second():
    clock = Clock()
    limit = RateLimit(Rate(at_once=3, per_second=2), clock)
    assert [limit.allows("a") for _ in range(4)] == [True, True, True, False]
    assert limit.allows("b")
    clock.now += 0.5
    assert [limit.allows("a") for _ in range(2)] == [True, False]
    clock.now += 1000.0
    assert [limit.allows("a") for _ in range(4)] == [True, True, True, False]


def test_clients_are_forgotten_before_they_are_too_many(monkeypatch):
    monkeypatch.setattr(limits, "_MOST_REMEMBERED", 10)
    clock = Clock()
    limit = RateLimit(Rate(at_once=2, per_second=1), clock)
    for number in range(1000):
        clock.now += 0.5
        limit.allows(str(number))
    assert len(limit._left) <= 10
    # One that has asked too much is remembered as long as there is room.
    assert [limit.allows("a") for _ in range(3)] == [True, True, False]
    for number in range(3):
        limit.allows(f"other {number}")
    assert not limit.allows("a")


@pytest.mark.parametrize(
    ("opened", "client", "reason"),
    [
        (["a"], "a", ""),
        (["a", "a"], "a", "2 pages at once to one address"),
        (["a", "a"], "b", ""),
        (["a", "a"], None, ""),
        (["a", "b", "c"], "d", "3 pages at once, and all"),
        (["a", "b", "c"], None, "3 pages at once, and all"),
    ],
)
def test_pages_are_counted_in_all_and_for_each_client(opened, client, reason):
    limit = PageLimit(in_all=3, per_client=2)
    for one in opened:
        limit.enter(one)
    assert reason in limit.reason(client)
    assert bool(limit.reason(client)) == bool(reason)
    limit.leave(opened[0])
    assert limit.reason(client) == ""
