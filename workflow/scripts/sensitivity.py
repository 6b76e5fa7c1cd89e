from pdrom.core.logs import job_log
from pdrom.experiments.sensitivity import measure_sensitivity

with job_log(snakemake.log[0]):
    measure_sensitivity(
        snakemake.params.scene,
        snakemake.input.mesh,
        snakemake.params.perturbations,
        snakemake.params.reference,
        snakemake.params.seeds,
        snakemake.output[0],
    )
