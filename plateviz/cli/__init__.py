"""The command line: one module per command, with the options and the output they share.

Imports everything below.
"""
