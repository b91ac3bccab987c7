"""The engines that solve a problem: gauss-newton, svi and nuts, and the what-if.

Imports `solver.linear` and below.
"""
