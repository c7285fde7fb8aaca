"""Numbers of a finished run for the captions of Snakemake's own report."""
