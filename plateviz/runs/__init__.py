"""Fitted orbits and runs on disk, queries over them, and the workers that fit a survey.

Imports `plateviz.verdict`, `plateviz.tables` and `solver`; no user interface.
"""
