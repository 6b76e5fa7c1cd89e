from pdrom.core.logs import job_log
from pdrom.experiments.iterations import sweep_iterations

with job_log(snakemake.log[0]):
    sweep_iterations(
        snakemake.params.scene,
        snakemake.params.settings,
        snakemake.params.floor,
        snakemake.params.solver,
        snakemake.input.mesh,
        snakemake.input.fom,
        snakemake.input.sensitivity,
        snakemake.output[0],
    )
