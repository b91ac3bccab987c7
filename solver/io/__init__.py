"""Files: the published FITS layout, and the same tables in ECSV, CSV, Parquet and VOTable.

Imports `solver.data` and `solver.runtime.versions`, and never JAX, because the web process
reads results without it. Readers validate a file before using it and raise one
`solver.errors.InputError` that lists the problems of the file.
"""
