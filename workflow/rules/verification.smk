# Tolerances of verify, on request (config/verification.yaml, docs/verification.md):
#   ./reproduce --configfile config/tiny.yaml -- tolerances
from pdrom.verification.jobs import VariantJobs

VARIANTS = VariantJobs(PLAN, workflow.overwrite_configfiles)

for variant in VARIANTS:

    rule:
        name:
            f"variant_{variant}"
        input:
            PLAN.tables.paths,
        output:
            **VARIANTS.outputs(variant),
        log:
            VARIANTS.log(variant),
        params:
            **VARIANTS.params(variant),
        message:
            f"The study with {VARIANTS.title(variant)}"
        script:
            "../scripts/variant.py"


rule tolerances:
    input:
        **{variant: list(VARIANTS.outputs(variant).values()) for variant in VARIANTS},
        plain=PLAN.tables.paths,
    output:
        VARIANTS.tolerances,
    log:
        VARIANTS.log("tolerances"),
    params:
        **VARIANTS.derivation,
    message:
        "Tolerances, from the variants of the study"
    script:
        "../scripts/tolerances.py"
