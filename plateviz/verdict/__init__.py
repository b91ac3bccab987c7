"""Whether to trust a solution, a run or a source: what is wrong, in words, and what to do.

Imports `plateviz.tables` and `solver`. The tests and the causes that they point to are found by
`solver.results.diagnosis`; here they get words, sizes and remedies.
"""
