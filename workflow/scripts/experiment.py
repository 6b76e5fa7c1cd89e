from pdrom.core.logs import job_log
from pdrom.core.provenance import made_by
from pdrom.experiments.kit.declaration import load

settings = snakemake.params.settings
told = {**settings, "labels": dict(snakemake.wildcards.items())}
with job_log(snakemake.log[0]), made_by(snakemake.rule, told, snakemake.params.code):
    experiment = load(snakemake.params.module)
    experiment.perform(settings, snakemake.input, snakemake.output)
