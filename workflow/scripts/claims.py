from pdrom.logs import job_log
from pdrom.stages.claims import decide_claims

with job_log(snakemake.log[0]):
    decide_claims(snakemake.input.rules, list(snakemake.input.tables), snakemake.output[0])
