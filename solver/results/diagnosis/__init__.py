"""Tests of a solution that tell the causes of an error apart, and the causes that they point to.

Imports the modules of `solver.data`, `solver.problem.walks` and `solver.runtime.threads`. Nothing
here loads JAX: a stored result can be tested.
"""
