#!/bin/sh
# Run by `snakemake --sdm conda` in an environment that it has made: puts the project there, as the Snakefile found it.
# A link, so that the jobs run the code that planned them; after the project has moved, delete .snakemake/conda.
set -eu
site=$(python -P -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
ln -sfn "$RFTFIT_PACKAGE" "$site/rftfit"
python -P -c 'import rftfit.workflow.job'
