from pdrom.core.logs import job_log
from pdrom.experiments.hard_cases.experiment import run_hard_cases

with job_log(snakemake.log[0]):
    run_hard_cases(
        snakemake.params.methods,
        snakemake.params.cases,
        snakemake.params.matrices,
        snakemake.input.expectations,
        snakemake.output.cases,
        snakemake.output.kernels,
    )
