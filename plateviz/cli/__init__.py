"""The commands, one module each, and the modules that only commands need.

Imports everything below.
"""
