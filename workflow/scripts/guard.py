from pdrom.core.logs import job_log
from pdrom.experiments.guard import try_guard

with job_log(snakemake.log[0]):
    try_guard(
        snakemake.params.cases,
        snakemake.params.guard,
        snakemake.params.repeats,
        snakemake.params.blowup_extent,
        snakemake.params.solver,
        snakemake.params.files,
        snakemake.output[0],
    )
