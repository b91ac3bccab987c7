"""Files: the published FITS layout and the same tables as ECSV, CSV, Parquet and VOTable.

Imports `solver.data` and `solver.runtime.versions`, and never JAX: the web process reads
results without starting it. A reader checks a file before using it and raises one
`solver.errors.InputError` that lists everything wrong with the file.
"""
