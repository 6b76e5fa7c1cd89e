from pdrom.core.logs import job_log
from pdrom.experiments.offline import measure_offline

with job_log(snakemake.log[0]):
    measure_offline(snakemake.params.settings, snakemake.output[0])
