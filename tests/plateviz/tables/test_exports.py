"""The public names of `plateviz.tables`."""

import importlib
import inspect
import pkgutil

import pandas as pd

from plateviz import tables

# Helpers that make a table of given ones.
SHARED = {"in_words", "ordered_by_class", "series_of", "sky_track_of"}


def test_every_function_that_returns_a_table_is_exported():
    modules = [
        importlib.import_module(f"plateviz.tables.{module.name}")
        for module in pkgutil.iter_modules(tables.__path__)
    ]
    found = {
        name: function
        for module in modules
        for name, function in inspect.getmembers(module, inspect.isfunction)
        if function.__module__ == module.__name__
        and not name.startswith("_")
        and function.__annotations__["return"] is pd.DataFrame
    }
    assert found
    assert {name for name in found if getattr(tables, name, None) is not found[name]} == SHARED
    assert set(found) - SHARED <= set(tables.__all__)


def test_every_exported_name_exists():
    assert all(hasattr(tables, name) for name in tables.__all__)
