"""Numbers at ticks, as the browser writes them."""

import pytest

from plateviz.figures.tick_numbers import tick_numbers

pytestmark = [pytest.mark.ui, pytest.mark.slow]

WRITTEN = """([code, ticks]) => {
  const written = new Function('tick', 'index', 'ticks', code);
  return ticks.map((tick, index) => written(tick, index, ticks)); }"""


@pytest.fixture(scope="module")
def page(browser):
    page = browser.new_page()
    yield page
    page.close()


@pytest.mark.parametrize(
    ("ticks", "expected"),
    [
        ([0, 0.5, 1, 1.5], ["0.0", "0.5", "1.0", "1.5"]),
        ([-0.1, -0.0, 0.1 + 0.2], ["−0.1", "0.0", "0.3"]),
        ([2028, 2029, 2030], ["2028", "2029", "2030"]),
        ([0, 5000], ["0", "5000"]),
        ([5000, 25_000, 2_000_000], ["5,000", "25,000", "2,000,000"]),
        ([-20_000, 0], ["−20,000", "0"]),
        ([1e-7, 2e-7], ["1e−7", "2e−7"]),
        ([1e13, 2e13], ["10000000000000", "20000000000000"]),
        ([0.00025, 0.0005], ["0.00025", "0.00050"]),
        ([0], ["0"]),
    ],
    ids=str,
)
def test_ticks_are_written_as_a_journal_prints_them(page, ticks, expected):
    assert page.evaluate(WRITTEN, [tick_numbers().code, ticks]) == expected
