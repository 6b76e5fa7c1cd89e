from pdrom.core.logs import job_log
from pdrom.experiments.reduction import reduce_group

with job_log(snakemake.log[0]):
    labels = {key: snakemake.wildcards[key] for key in ("scene", "group", "method")}
    reduce_group(labels, snakemake.params, snakemake.input, snakemake.output)
