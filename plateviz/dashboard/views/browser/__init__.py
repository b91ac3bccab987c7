"""What the browser does beside showing a page: its address, theme, sizes, accessible names.

Imports `elements`.
"""
