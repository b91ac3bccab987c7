"""A component of the page that changes while the browser draws it, in a real Chromium."""

import pytest
from playwright.sync_api import expect

from tests.ui.conftest import serving

expect.set_options(timeout=60_000)
pytestmark = [pytest.mark.ui, pytest.mark.slow]

# The server changes a button after it was drawn, and before it follows its model.
LATE = """document.addEventListener('DOMContentLoaded', () => {
  const models = Bokeh.Models.get('panel.models.esm.ReactiveESM').prototype, { watch } = models;
  models.watch = function (view, name, ...rest) {
    if (name === 'label' && this.data.label === 'All solutions')
      this.data.setv({ label: 'Changed meanwhile' }, { sync: false });
    watch.call(this, view, name, ...rest);
  };
}, { once: true })"""

# The parts of a container are others after it was drawn, and before it follows their list.
LATE_PARTS = """document.addEventListener('DOMContentLoaded', () => {
  const kind = Bokeh.Models.get('panel.models.esm.ReactComponent');
  const view = kind.prototype.default_view.prototype, { on_child_render } = view;
  view.on_child_render = function (name, callback) {
    const parts = this.model.data[name];
    if (!window.late && Array.isArray(parts) && parts.length > 1) {
      window.late = { view: this, name };
      this.model.data.setv({ [name]: [...parts].reverse() }, { silent: true });
    }
    on_child_render.call(this, name, callback);
  };
}, { once: true })"""
ARE_SHOWN = """() => {
  if (!window.late) return false;
  const { view, name } = window.late;
  const parts = view.model.data[name].map(part => part.id);
  const shown = [...view.shadow_el.querySelectorAll('.child-wrapper')].map(one => one.id);
  return shown.filter(id => parts.includes(id)).join() === parts.join();
}"""


@pytest.fixture
def served(small_survey, chromium_path):
    """The address of a survey of sparse orbits that nobody has fitted."""
    with serving("serve", str(small_survey), "--port", "0") as address:
        yield address


@pytest.mark.newest
def test_what_changes_while_a_component_is_drawn_is_shown(served, browser):
    with browser.new_context() as context:
        context.add_init_script(LATE)
        page = context.new_page()
        page.goto(f"{served}?view=orbit&orbit=0")
        expect(page.get_by_role("button", name="Changed meanwhile")).to_be_visible()
        assert page.get_by_role("button", name="All solutions").count() == 0


def test_parts_that_change_while_their_container_is_drawn_are_shown(served, browser):
    with browser.new_context() as context:
        context.add_init_script(LATE_PARTS)
        page = context.new_page()
        page.goto(f"{served}?view=orbit&orbit=0")
        page.wait_for_function(ARE_SHOWN, timeout=60_000)
