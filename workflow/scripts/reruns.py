from pdrom.logs import job_log
from pdrom.stages.reruns import run_reduced

with job_log(snakemake.log[0]):
    run_reduced(
        {key: snakemake.wildcards[key] for key in ("scene", "group", "method")},
        snakemake.params.scene,
        snakemake.params.spec,
        snakemake.params.ranks,
        snakemake.params.blowup_extent,
        snakemake.params.solver,
        snakemake.input.mesh,
        snakemake.input.fom,
        snakemake.input.basis,
        snakemake.input.sampling,
        snakemake.output.runs,
        snakemake.output.table,
    )
