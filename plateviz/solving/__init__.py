"""Fits on request: where orbits come from, jobs, the warm solver process, solutions so far.

Imports `plateviz.runs` and below; no user interface.
"""
