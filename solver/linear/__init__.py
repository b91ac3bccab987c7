"""Linear algebra of a problem: Jacobians, normal equations, source elimination and whitening.

Imports `solver.problem` and below.
"""
