from pdrom.logs import job_log
from pdrom.stages.figures import draw

with job_log(snakemake.log[0]):
    draw(
        snakemake.params.name,
        snakemake.params.spec,
        snakemake.params.holdings,
        snakemake.params.results,
        snakemake.params.published,
        snakemake.output.pdf,
        snakemake.output.png,
    )
