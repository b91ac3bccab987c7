"""Views connect the session to widgets and figures, and compute nothing; only Panel is theirs.

Imports `plateviz.dashboard` and below.
"""
