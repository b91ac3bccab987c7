"""The three pages, Orbit, Survey and Source, and the switch between them.

Imports `panes` and below.
"""
