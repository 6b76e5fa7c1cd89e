from pdrom.core.logs import job_log
from pdrom.report.decide import decide_claims

with job_log(snakemake.log[0]):
    decide_claims(snakemake.input.rules, list(snakemake.input.tables), snakemake.output[0])
