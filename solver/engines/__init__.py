"""The engines that solve a problem: gauss-newton, svi, nuts, and the what-if re-solution.

Imports `solver.linear` and below.
"""
