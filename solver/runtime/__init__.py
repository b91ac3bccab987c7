"""The machine that a fit runs on: device, memory, threads and package versions.

Imports `solver.errors` only.
"""
