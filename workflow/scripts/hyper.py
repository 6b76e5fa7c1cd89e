from pdrom.core.logs import job_log
from pdrom.experiments.hyper import run_hyper

with job_log(snakemake.log[0]):
    run_hyper(
        snakemake.params.scene,
        snakemake.params.settings,
        snakemake.params.blowup_extent,
        snakemake.input.mesh,
        {"train": snakemake.input.fom, "heldout": snakemake.input.heldout},
        snakemake.output.runs,
        {"train": snakemake.output.table, "heldout": snakemake.output.heldout},
    )
