"""Components make the same models with parameters that are not copied for them."""

import re
from pathlib import Path

import panel as pn
import panel_material_ui as pmui
import pytest
from bokeh.document import Document
from bokeh.model import Model
from panel.custom import ReactiveESM
from panel.pane.holoviews import find_links, link_axes
from panel.param import link_param_method
from panel.viewable import Viewable
from panel_material_ui.theme import MaterialDesign
from param import parameterized, parameters

from plateviz.dashboard.serving import quick_components
from plateviz.dashboard.views.browser.visibility import Visibility

pytestmark = pytest.mark.newest


@pytest.fixture
def quick(monkeypatch):
    """What another test of this process has made quick is as Panel has it afterwards."""
    for owner, name in (
        (parameterized, "_instantiated_parameter"),
        (ReactiveESM, "_get_model"),
        (ReactiveESM, "_get_properties"),
    ):
        known = getattr(owner, name)
        monkeypatch.setattr(owner, name, getattr(known, "__wrapped__", known))
    monkeypatch.setattr(ReactiveESM, "_bundle_path", vars(ReactiveESM)["_bundle_path"])
    find = MaterialDesign._get_modifiers.__func__
    monkeypatch.setattr(
        MaterialDesign, "_get_modifiers", classmethod(getattr(find, "__wrapped__", find))
    )
    hooks = [link_param_method, link_axes, find_links]
    monkeypatch.setattr(Viewable, "_preprocessing_hooks", hooks)
    return quick_components.make_components_quick


def components():
    return [
        pmui.Column(pmui.Button(label="Fit"), pmui.Select(options=["a", "b"], value="b")),
        pmui.Card(pn.pane.Markdown("words"), title="a card"),
        Visibility(),
    ]


def sent(component):
    document = Document()
    model = component.get_root(document)
    document.add_root(model)
    return [
        (type(one).__name__, one.properties_with_values(include_defaults=False))
        for one in sorted(model.references(), key=lambda one: int(one.id.strip("p")))
        if isinstance(one, Model)
    ]


def in_words(models):
    """Return the kinds and values of models, without the numbers of each component and model."""
    return [
        (
            re.sub(r"\d+$", "", kind),
            {
                name: re.sub(r"\bp\d+|\d{5,}", "", repr(value))
                for name, value in values.items()
                if " object at " not in repr(value)
            },
        )
        for kind, values in models
    ]


def test_models_are_those_of_panel(quick):
    expected = [in_words(sent(one)) for one in components()]
    assert sum(map(len, expected)) > 8
    quick()
    assert [in_words(sent(one)) for one in components()] == expected


def test_no_parameter_is_copied_to_make_a_model(quick):
    quick()
    button = pmui.Button(label="Fit")
    before = set(button._param__private.params)
    button.get_root(Document())
    assert set(button._param__private.params) == before


def test_parameter_that_a_component_has_changed_is_its_own(quick):
    quick()
    one, other = pmui.FloatSlider(start=0.0, end=1.0), pmui.FloatSlider(start=0.0, end=1.0)
    one.param["value"].label = "changed"
    one.get_root(Document())
    assert one.param["value"].label == "changed"
    assert other.param["value"].label != "changed"


def test_files_of_a_class_are_looked_for_once(quick, monkeypatch):
    quick()
    Visibility().get_root(Document())
    looked_for, is_file = [], Path.is_file
    monkeypatch.setattr(Path, "is_file", lambda one: looked_for.append(one.name) or is_file(one))
    Visibility().get_root(Document())
    assert not [name for name in looked_for if name.endswith(".bundle.js")]


def test_theme_of_pictures_and_texts_is_found_once(quick, monkeypatch):
    quick()
    one = pn.pane.Markdown("words", design=MaterialDesign)
    one.get_root(Document())
    found, resolve = [], parameters.Filename._resolve
    monkeypatch.setattr(
        parameters.Filename, "_resolve", lambda own, path: found.append(path) or resolve(own, path)
    )
    assert "words" in one.get_root(Document()).text
    assert found == []


def test_page_is_not_searched_for_what_is_linked(quick, monkeypatch):
    """Panel would go through all of it each time a part changes, as when a figure is drawn."""
    searched, select = [], pmui.Button.select
    monkeypatch.setattr(
        pmui.Button, "select", lambda one, *what: searched.append(one) or select(one, *what)
    )
    pmui.Column(pmui.Button(label="Fit")).get_root(Document())
    assert searched != []
    quick()
    searched.clear()
    pmui.Column(pmui.Button(label="Fit")).get_root(Document())
    assert searched == []
