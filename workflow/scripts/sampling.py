from pdrom.logs import job_log
from pdrom.stages.sampling import sample

with job_log(snakemake.log[0]):
    sample(
        {key: snakemake.wildcards[key] for key in ("scene", "group", "method")},
        snakemake.params.spec,
        snakemake.params.sweep,
        snakemake.params.ranks,
        snakemake.input.snapshots,
        snakemake.input.basis,
        snakemake.output.sampling,
        snakemake.output.errors,
    )
