"""Reports: one self-contained HTML file of an orbit, a source or a survey.

Imports `plateviz.solving` and below. `report` defines the content of a file, `orbit` and `survey`
compose it, `page` renders it as HTML, `pdf` prints it.
"""
