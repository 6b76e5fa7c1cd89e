from pdrom.core.logs import job_log
from pdrom.experiments.scaling import scale_scene

with job_log(snakemake.log[0]):
    scale_scene(
        snakemake.params.scene,
        snakemake.params.factor,
        snakemake.params.methods,
        snakemake.params.settings,
        snakemake.params.solver,
        snakemake.params.root,
        {k: snakemake.output[k] for k in ("iterations", "breakeven")},
    )
