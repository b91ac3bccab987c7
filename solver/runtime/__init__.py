"""The machine that runs a fit: device, memory, threads and package versions.

Imports `solver.errors` only.
"""
