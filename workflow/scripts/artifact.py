from study.artifact.artifact import make
from study.artifact.logs import job_log

with job_log(snakemake.log[0]):
    make(
        snakemake.params.artifact,
        settings=snakemake.params.settings,
        labels=dict(snakemake.wildcards.items()),
        code=snakemake.params.code,
        content=snakemake.params.content,
        inputs=dict(snakemake.input.items()),
        outputs=dict(snakemake.output.items()),
    )
