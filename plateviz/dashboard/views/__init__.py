"""Views connect the session to widgets and figures, and compute nothing; only Panel is theirs.

Imports the other folders of `plateviz.dashboard` and below. Each folder here imports those before
it: `elements`, `browser`, `saving`, `cards`, `dialogs`, `controls`, `panes`, `pages`.
"""
