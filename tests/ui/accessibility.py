"""Whether everybody can read a page and work with it, outside of the canvases.

`PLATEVIZ_AXE=axe.min.js` names the program of axe-core (`npm pack axe-core`), which then looks at
every page, too. It is too large to be kept with the tests.
"""

import os
from pathlib import Path

_CHECK = (Path(__file__).parent / "accessibility.js").read_text("utf-8")
_AXE = """async () => (await axe.run(document, {resultTypes: ['violations']})).violations
  .filter(one => ['serious', 'critical'].includes(one.impact))
  .flatMap(one => one.nodes.map(node => `${one.id}: ${node.html.slice(0, 120)}`))"""
# The page completes what is new in it a moment later.
_COMPLETED_MS = 600


def require_accessible(page):
    """Fail if a control has no name, a text no contrast, or a part no place in the page."""
    page.mouse.move(0, 0)
    page.wait_for_timeout(_COMPLETED_MS)
    # What widgets leave out is added a moment after they are made.
    for _ in range(20):
        found = page.evaluate(_CHECK.partition("\n")[2])
        if found == []:
            break
        page.wait_for_timeout(500)
    axe = os.environ.get("PLATEVIZ_AXE")
    if axe:
        page.evaluate(Path(axe).read_text("utf-8"))
        found += page.evaluate(_AXE)
    assert found == [], found
