"""Reports: one self-contained HTML file of an orbit, from the same tables and pictures.

`report` says what a file holds, `orbit` composes it, `page` makes it HTML, `pdf` prints it.
"""
