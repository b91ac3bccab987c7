"""One orbit under one set of settings as arrays: measurements, parameter vector and priors.

Imports `solver.model` and below.
"""
