"""Inputs and outputs of a fit: tables, parameters, settings and results. No computation.

Imports `solver.errors` and `solver.units` only, and never JAX.
"""
