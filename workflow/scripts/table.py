from pdrom.core.logs import job_log
from pdrom.tables.make import make_table

with job_log(snakemake.log[0]):
    make_table(snakemake.params.name, snakemake.input, snakemake.params, snakemake.output[0])
