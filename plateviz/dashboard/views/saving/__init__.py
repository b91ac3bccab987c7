"""Buttons and menus for what leaves the page as a file.

Imports `browser` and below.
"""
