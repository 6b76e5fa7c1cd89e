from pdrom.core.logs import job_log
from pdrom.tables.make import make_table

with job_log(snakemake.log[0]):
    made = snakemake.params
    make_table(made.module, dict(snakemake.input.items()), made.settings, snakemake.output[0])
