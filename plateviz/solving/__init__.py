"""Fits on request: origins of orbits, jobs, the warm solver process, the solution store.

Imports `plateviz.runs` and below; no user interface.
"""
