"""The dashboard: session state, navigation, views, and the web server that serves them.

Imports `plateviz.reports` and below.
"""
