"""Dialogs over the page: lists of solutions and selections, code, notes.

Imports `cards` and below.
"""
