"""The steps of the workflow: each one function, paths in, paths out.

Snakemake calls them as ``python -m rftfit STAGE name=value ...``; see `rftfit.__main__`.
"""
