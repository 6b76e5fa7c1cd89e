from pathlib import Path

from pdrom.core.logs import job_log
from pdrom.verification.variants import run_variant

with job_log(snakemake.log[0]):
    made = snakemake.params
    tables = dict(snakemake.output.items())
    run_variant(made.settings, Path(), Path(made.folder), made.configuration, tables)
