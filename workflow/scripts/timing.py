from pdrom.core.logs import job_log
from pdrom.experiments.timing import time_scene

with job_log(snakemake.log[0]):
    time_scene(
        snakemake.params.scene,
        snakemake.params.methods,
        snakemake.params.ranks,
        snakemake.params.counts,
        snakemake.params.window,
        snakemake.params.protocol,
        snakemake.params.solver,
        snakemake.params.threads,
        {
            "mesh": snakemake.input.mesh,
            "fom": snakemake.input.fom,
            **{k: list(snakemake.input[k]) for k in ("bases", "samplings", "hyper")},
        },
        {k: snakemake.output[k] for k in ("frames", "breakeven", "effects", "left_out")},
    )
