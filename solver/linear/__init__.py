"""The linearised problem: Jacobians, normal equations, elimination of the sources, whitening.

Imports `solver.problem` and below.
"""
