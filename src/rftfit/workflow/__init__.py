"""The steps of the workflow and what Snakemake needs of them."""
