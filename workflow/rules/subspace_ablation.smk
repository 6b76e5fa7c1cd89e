# Why block DEIM fails in a position subspace, and what mends it (config/subspace_ablation.yaml)
rule subspace_ablation:
    input:
        mesh=lambda w: PLAN.mesh_path(w.scene),
        fom="results/fom/{scene}/train.h5",
        heldout="results/fom/{scene}/heldout.h5",
        sensitivity="results/sensitivity/{scene}.csv",
    output:
        "results/subspace_ablation/{scene}.csv",
    log:
        "results/logs/subspace_ablation/{scene}.log",
    params:
        scene=lambda w: PLAN.scene_config(w.scene),
        ablation=PLAN.ablation_settings(),
        floor={
            "perturbation": PLAN.settings.sensitivity.reference,
            "threshold": PLAN.settings.sensitivity.threshold,
        },
        blowup_extent=PLAN.settings.blowup_extent,
        code=lambda w: PLAN.scene_code("pdrom.experiments.subspace_ablation", w.scene),
    message:
        "Variants of block DEIM in a position subspace of {wildcards.scene}"
    script:
        "../scripts/subspace_ablation.py"


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
