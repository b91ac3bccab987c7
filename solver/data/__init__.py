"""What goes into a fit and what comes out, with no maths: tables, parameters, settings, results.

Imports `solver.errors` and `solver.units` only, and never JAX.
"""
