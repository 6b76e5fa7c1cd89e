from pathlib import Path

from pdrom.core.logs import job_log
from pdrom.experiments.mesh import make_mesh

with job_log(snakemake.log[0]):
    make_mesh(snakemake.params.config, Path(snakemake.params.root), snakemake.output[0])
