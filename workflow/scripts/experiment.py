from pdrom.core.logs import job_log
from pdrom.experiments.declaration import load

with job_log(snakemake.log[0]):
    experiment = load(snakemake.params.module)
    experiment.perform(snakemake.params.settings, snakemake.input, snakemake.output)
