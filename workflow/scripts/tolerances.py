from pdrom.core.logs import job_log
from pdrom.verification.derive import derive

with job_log(snakemake.log[0]):
    inputs = dict(snakemake.input.items())
    plain = inputs.pop("plain")
    derive(plain, inputs, snakemake.output[0])
