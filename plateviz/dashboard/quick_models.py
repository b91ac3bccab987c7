"""Quick models: what Bokeh works out anew for every model of a page, worked out once for its class.

After each change, Bokeh and Panel walk through all models of a page to find those that are new. At
each step Bokeh lists the properties of the model's class that may have other models, and computes
the default of each that was not set. This was half of the server's time for a page.
"""

from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

from bokeh.core.has_props import HasProps
from bokeh.core.property.descriptors import PropertyDescriptor
from bokeh.model import Model
from bokeh.model import util as bokeh_models
from bokeh.settings import settings

# What holds no model and does not change, so that instances may share it as a default.
_PLAIN = frozenset({type(None), bool, int, float, str, bytes})
_UNKNOWN = object()
# It has no public name.
_BOKEH_DEFAULT: Any = PropertyDescriptor._get_default  # noqa: SLF001

Visitor = Callable[[Model], object]


def make_models_quick() -> None:
    """Let Bokeh in this process look up what it would compute for every model."""
    # Help for who writes a page: whether each callback takes what it is given, and each new page is
    # whole.
    settings.perform_error_diagnostics = False
    settings.perform_document_validation = False
    names: Any = bokeh_models
    names.visit_immediate_value_references = _visit_models_of
    names.visit_value_and_its_immediate_references = _visit_models_in
    descriptor: Any = PropertyDescriptor
    descriptor._get_default = _default  # noqa: SLF001
    owner: Any = HasProps
    owner.themed_values = _themed_values


def _visit_models_of(value: Any, visitor: Visitor) -> None:  # noqa: ANN401 as Bokeh
    """Visit the models that a model refers to, or those in another value."""
    if not isinstance(value, HasProps):
        _visit_models_in(value, visitor)
        return
    given = value._property_values  # noqa: SLF001
    for name, descriptor in _descriptors_with_models(type(value)):
        child = given.get(name, _UNKNOWN)
        if child is _UNKNOWN or descriptor is None:
            if descriptor is not None and _plain_default(descriptor, type(value)) is not _UNKNOWN:
                continue
            child = getattr(value, name)
        _visit_models_in(child, visitor)


def _visit_models_in(value: Any, visitor: Visitor) -> None:  # noqa: ANN401 as Bokeh
    """Visit a model, or those in a container."""
    kind = type(value)
    if kind in _PLAIN:
        return
    if issubclass(kind, Model):
        visitor(value)
    elif issubclass(kind, list | tuple):
        # A column of thousands of texts has no model.
        if not _PLAIN.issuperset(map(type, value)):
            for item in value:
                _visit_models_in(item, visitor)
    elif issubclass(kind, dict):
        _visit_models_in([*value, *value.values()], visitor)
    elif issubclass(kind, HasProps):
        _visit_models_of(value, visitor)
    elif is_dataclass(value):
        for field in fields(value):
            _visit_models_in(getattr(value, field.name, None), visitor)


@cache
def _descriptors_with_models(kind: type[HasProps]) -> list[tuple[str, PropertyDescriptor | None]]:
    """Return the properties of a class that may have models; None for another kind of property."""
    found = []
    for name in kind.properties_with_refs():
        descriptor = kind.lookup(name)
        is_usual = type(descriptor).__get__ is PropertyDescriptor.__get__
        found.append((name, descriptor if is_usual else None))
    return found


def _default(descriptor: Any, owner: HasProps) -> Any:  # noqa: ANN401 of any property
    """Return the value of a property that was not set."""
    themed = _themed_values(owner)
    if themed is None or descriptor.name not in themed:
        default = _plain_default(descriptor, type(owner))
        if default is not _UNKNOWN:
            return default
    return _BOKEH_DEFAULT(descriptor, owner)


@cache
def _plain_default(descriptor: Any, kind: type[HasProps]) -> Any:  # noqa: ANN401 of any property
    """Return the default of a property, unless instances may have different ones."""
    if descriptor.has_unstable_default(kind):
        return _UNKNOWN
    default = descriptor.class_default(kind)
    return default if type(default) in _PLAIN else _UNKNOWN


def _themed_values(owner: Any) -> dict[str, Any] | None:  # noqa: ANN401 as Bokeh
    return owner.__dict__.get("__themed_values__")
