"""What all views are made of: styled markup, tables, stacks, notices.

Imports the other folders of `plateviz.dashboard`.
"""
