# Entry point of `snakemake` and of `./reproduce`: the workflow with the manuscript as its target.
include: "workflow/Snakefile"


# `include` resets the default target, so it is declared here.
rule all:
    default_target: True
    input:
        rules.study.input,
