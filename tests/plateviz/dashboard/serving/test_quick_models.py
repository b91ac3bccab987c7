"""Bokeh finds the same models and the same defaults with what is looked up once for a class."""

import re
from contextlib import suppress

import pytest
from bokeh.core.has_props import HasProps
from bokeh.core.property.descriptors import PropertyDescriptor, UnsetValueError
from bokeh.core.property.vectorization import Expr
from bokeh.core.serialization import Serializer
from bokeh.model import Model, get_class
from bokeh.model import util as bokeh_models
from bokeh.models import ColumnDataSource, CumSum, Plot, Scatter, Title
from bokeh.plotting import figure
from bokeh.settings import settings
from bokeh.util.warnings import BokehDeprecationWarning

from plateviz.dashboard.serving import quick_models

pytestmark = pytest.mark.newest


@pytest.fixture
def quick(monkeypatch):
    """What another test of this process has made quick is as Bokeh has it afterwards."""
    for owner, name in (
        (bokeh_models, "visit_immediate_value_references"),
        (bokeh_models, "visit_value_and_its_immediate_references"),
        (PropertyDescriptor, "_get_default"),
        (HasProps, "themed_values"),
        (HasProps, "__init__"),
        (HasProps, "query_properties_with_values"),
    ):
        monkeypatch.setattr(owner, name, getattr(owner, name))
    monkeypatch.setattr(PropertyDescriptor, "_get_default", quick_models._BOKEH_DEFAULT)
    monkeypatch.setattr(HasProps, "query_properties_with_values", quick_models._BOKEH_VALUES)
    yield quick_models.make_models_quick
    for one in (settings.perform_error_diagnostics, settings.perform_document_validation):
        one.unset_value()


def every_model():
    """Yield a model of every class that can be made without arguments."""
    get_class("Plot")
    for name, kind in sorted(Model.model_class_reverse_map.items()):
        # Some are deprecated, and others cannot be made without arguments.
        with suppress(TypeError, ValueError, RuntimeError, BokehDeprecationWarning):
            yield name, kind()


def values(model):
    found = {}
    for name in type(model).properties():
        with suppress(UnsetValueError, BokehDeprecationWarning):
            found[name] = getattr(model, name)
    return found


def plain(value):
    """Return a text that is the same for models that are made anew."""
    return (
        type(value).__name__
        if isinstance(value, HasProps)
        else re.sub(r"id='p\d+'", "", repr(value))[:40]
    )


def test_defaults_are_those_of_bokeh(quick):
    def defaults():
        return {
            (kind, name): plain(value)
            for kind, model in every_model()
            for name, value in values(model).items()
            if not callable(value) and "0x" not in plain(value) and name != "id"
        }

    expected = defaults()
    assert len(expected) > 5000
    quick()
    assert defaults() == expected


def test_what_is_sent_of_a_model_is_the_same(quick):
    def sent():
        drawn = figure(title="a figure", tooltips="@x", x_axis_type="log")
        drawn.scatter([1.0, 2.0], [1.0, 2.0], legend_label="points")
        drawn.tags.append("seen")
        drawn.apply_theme({"min_border": 7, "tags": ["themed"]})
        models = {kind: model for kind, model in every_model() if isinstance(model, Model)}
        texts = {}
        for kind, model in {**models, "a figure": drawn}.items():
            # Some are not whole without what they belong to.
            with suppress(UnsetValueError):
                content = Serializer().serialize(model).content
                texts[kind] = re.sub(r"'p\d+'|0x\w+", "", repr(content))
        return texts

    expected = sent()
    assert len(expected) > 200
    quick()
    found = sent()
    assert {kind: found[kind] for kind in expected} == expected


def test_no_container_is_made_until_somebody_looks_at_it(quick):
    quick()
    one = Plot()
    one.references()
    Serializer().serialize(one)
    own = one._unstable_default_values
    assert "toolbar" in own
    assert not {"tags", "renderers", "stylesheets"} & set(own)
    assert one.tags == []
    assert "tags" in own


def test_default_that_may_change_is_not_shared(quick):
    quick()
    one, other = Plot(), Plot()
    one.tags.append("seen")
    assert other.tags == []
    assert one.toolbar is not other.toolbar


def test_theme_takes_precedence_over_a_default(quick):
    quick()
    title = Title()
    assert title.text_alpha == 1.0
    title.apply_theme({"text_alpha": 0.5, "standoff": 7})
    assert (title.text_alpha, title.standoff) == (0.5, 7)
    title.unapply_theme()
    assert (title.text_alpha, title.standoff) == (1.0, 10)


def test_the_same_models_are_found(quick):
    drawn = figure(title="a figure", tooltips="@name")
    source = ColumnDataSource({"x": [1.0, 2.0], "name": ["a", "b"], "held": [Title(), None]})
    drawn.scatter("x", "x", source=source)
    drawn.add_glyph(source, Scatter(x=Expr(CumSum(field="x")), y="x"))
    drawn.line([1, 2], [1, 2], legend_label="line")
    holder = Title(tags=["text", drawn, 3.0, {"key": (Title(), [Title()])}])
    roots = [drawn, holder]
    for model in (model for _, model in every_model() if isinstance(model, Model)):
        # Some are not whole without what they belong to.
        with suppress(UnsetValueError):
            model.references()
            roots.append(model)
    assert len(roots) > 200
    expected = [[one.id for one in root.references()] for root in roots]
    assert len(expected[1]) > 40
    quick()
    assert bokeh_models.visit_immediate_value_references.__module__ == quick_models.__name__
    found = [root.references() for root in roots]
    assert [{one.id for one in models} for models in found] == [set(ids) for ids in expected]
    assert {type(one).__name__ for one in found[0]} >= {"CumSum", "Legend", "Title", "HoverTool"}
