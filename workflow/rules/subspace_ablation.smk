# Why block DEIM fails in a position subspace, and what mends it (config/subspace_ablation.yaml)
rule subspace_ablation_table:
    input:
        parts=PLAN.ablation_files(),
    output:
        report("results/tables/subspace_ablation.csv", category="Tables"),
    log:
        "results/logs/tables/subspace_ablation.log",
    params:
        name="subspace_ablation",
        code=PLAN.code("pdrom.tables.subspace_ablation"),
    message:
        "Table of the ablation in position subspaces"
    script:
        "../scripts/table.py"
