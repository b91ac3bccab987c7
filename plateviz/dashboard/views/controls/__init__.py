"""Widgets that a person sets something with: the fit, what is shown, what is selected.

Imports `dialogs` and below.
"""
