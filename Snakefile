# Entry point of `snakemake` and of `./reproduce`: the workflow with the manuscript as its target.
from pdrom.pipeline.configfiles import check_or_exit

check_or_exit("config/default.yaml", *workflow.overwrite_configfiles)


configfile: "config/default.yaml"


include: "workflow/Snakefile"


# `include` resets the default target, so it is declared here.
rule all:
    default_target: True
    input:
        rules.study.input,
