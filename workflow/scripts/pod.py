from pdrom.core.logs import job_log
from pdrom.experiments.pod import make_basis

with job_log(snakemake.log[0]):
    make_basis(snakemake.params.spec, snakemake.input[0], snakemake.output[0])
