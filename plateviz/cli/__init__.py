"""The command line: one module per command, with what several commands or only one of them need.

Imports everything below.
"""
