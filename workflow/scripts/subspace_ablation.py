from pdrom.core.logs import job_log
from pdrom.experiments.subspace_ablation import ablate

with job_log(snakemake.log[0]):
    ablate(
        snakemake.params.scene,
        snakemake.params.ablation,
        snakemake.params.floor,
        snakemake.params.blowup_extent,
        snakemake.input.mesh,
        {"train": snakemake.input.fom, "heldout": snakemake.input.heldout},
        snakemake.input.sensitivity,
        snakemake.output[0],
    )
