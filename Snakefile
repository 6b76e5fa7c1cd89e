# Entry point of `snakemake` and of `./reproduce`: the workflow, whose default target is the whole study.
include: "workflow/Snakefile"


# `include` resets the default target, so it is declared again here.
rule all:
    default_target: True
    input:
        rules.study.input,
