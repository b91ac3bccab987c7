"""Quick models: what Bokeh works out anew for every model of a page, worked out once for its class.

After each change, Bokeh and Panel walk through all models of a page to find those that are new. At
each step Bokeh lists the properties of the model's class that may have other models, and computes
the default of each that was not set. This was half of the server's time for a page.

A new model asks each of its properties whether its default may change, and gets a container of its
own for each that can be filled, and seldom is. To send a model, Bokeh reads all its properties.
"""

from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

from bokeh.core.has_props import HasProps
from bokeh.core.property.descriptors import PropertyDescriptor
from bokeh.core.property.singletons import Intrinsic, Undefined
from bokeh.core.property.wrappers import PropertyValueContainer
from bokeh.model import Model
from bokeh.model import util as bokeh_models
from bokeh.settings import settings

# What holds no model and does not change, so that instances may share it as a default.
_PLAIN = frozenset({type(None), bool, int, float, str, bytes})
_UNKNOWN = object()
# It has no public name.
_BOKEH_DEFAULT: Any = PropertyDescriptor._get_default  # noqa: SLF001
_BOKEH_VALUES: Any = HasProps.query_properties_with_values

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
    owner.__init__ = _begin
    owner.query_properties_with_values = _values


def _begin(self: Any, **properties: Any) -> None:  # noqa: ANN401 as Bokeh
    """Begin a model with some values, and with the defaults that no other model may share."""
    super(HasProps, self).__init__()
    self._property_values = {}
    self._unstable_default_values = {}
    self._unstable_themed_values = {}
    for name, value in properties.items():
        if value is not Undefined and value is not Intrinsic:
            setattr(self, name, value)
    for descriptor in _own_defaults(type(self)):
        if descriptor.name not in properties:
            descriptor._get(self)  # noqa: SLF001 it keeps the default
    self._initialized = True


@cache
def _own_defaults(kind: type[HasProps]) -> list[Any]:
    """Return the properties of a class of whose defaults each model has its own from the start.

    A container is made when somebody looks at it; until then it is neither sent nor has models.
    """
    found = []
    for descriptor in kind.descriptors():
        if _is_unstable(descriptor, kind):
            default = descriptor.class_default(kind)
            if not isinstance(default, PropertyValueContainer) or default:
                found.append(descriptor)
    return found


def _values(
    self: Any,  # noqa: ANN401 as Bokeh
    query: Callable[[Any], bool],
    *,
    include_defaults: bool = True,
    include_undefined: bool = False,
) -> dict[str, Any]:
    """Return values of properties; without the defaults, no other property is read."""
    if include_defaults or include_undefined:
        return _BOKEH_VALUES(
            self, query, include_defaults=include_defaults, include_undefined=include_undefined
        )
    given, own, themed = (
        self._property_values,  # noqa: SLF001
        self._unstable_default_values,  # noqa: SLF001
        _themed_values(self) or (),
    )
    found = {}
    for descriptor in type(self).descriptors():
        name = descriptor.name
        if (name in given or name in own or name in themed) and query(descriptor):
            value = descriptor.get_value(self)
            is_empty = name in own and isinstance(value, PropertyValueContainer)
            if not is_empty or name in themed:
                found[name] = value
    return found


def _visit_models_of(value: Any, visitor: Visitor) -> None:  # noqa: ANN401 as Bokeh
    """Visit the models that a model refers to, or those in another value."""
    if not isinstance(value, HasProps):
        _visit_models_in(value, visitor)
        return
    given = value._property_values  # noqa: SLF001
    filled = value._unstable_default_values  # noqa: SLF001
    for name, is_bare in _names_with_models(type(value)):
        child = given.get(name, _UNKNOWN) if is_bare is not None else _UNKNOWN
        if child is _UNKNOWN:
            child = filled.get(name) if is_bare else getattr(value, name)
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
def _names_with_models(kind: type[HasProps]) -> list[tuple[str, bool | None]]:
    """Return the properties of a class that may have models, and which have none unless given.

    This is None for a property of another kind, whose value is not what it was given.
    """
    bare = {one.name for one in kind.descriptors()} - {one.name for one in _own_defaults(kind)}
    found: list[tuple[str, bool | None]] = []
    for name in kind.properties_with_refs():
        descriptor = kind.lookup(name)
        is_usual = type(descriptor).__get__ is PropertyDescriptor.__get__
        is_bare = name in bare and (
            _is_unstable(descriptor, kind) or _plain_default(descriptor, kind) is not _UNKNOWN
        )
        found.append((name, is_bare if is_usual else None))
    return found


def _is_unstable(descriptor: Any, kind: Any) -> bool:  # noqa: ANN401 of any property
    """Return whether models of a class may not share the default of a property."""
    return descriptor.has_unstable_default(kind)


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
    if _is_unstable(descriptor, kind):
        return _UNKNOWN
    default = descriptor.class_default(kind)
    return default if type(default) in _PLAIN else _UNKNOWN


def _themed_values(owner: Any) -> dict[str, Any] | None:  # noqa: ANN401 as Bokeh
    return owner.__dict__.get("__themed_values__")
