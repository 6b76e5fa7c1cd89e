from pdrom.logs import job_log
from pdrom.stages.reruns import run_reduced

with job_log(snakemake.log[0]):
    run_reduced(
        {key: snakemake.wildcards[key] for key in ("scene", "group", "method")},
        snakemake.params.scene,
        snakemake.params.spec,
        {"train": snakemake.params.ranks, "heldout": snakemake.params.heldout_ranks},
        snakemake.params.blowup_extent,
        snakemake.params.guard,
        snakemake.params.solver,
        snakemake.input.mesh,
        {"train": snakemake.input.fom, "heldout": snakemake.input.heldout},
        snakemake.input.basis,
        snakemake.input.sampling,
        snakemake.output.runs,
        {"train": snakemake.output.table, "heldout": snakemake.output.heldout},
    )
