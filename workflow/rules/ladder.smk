# From the published choices to sound ones, one ingredient at a time (config/ladder.yaml)
rule ladder:
    input:
        mesh=lambda w: PLAN.mesh_path(w.scene),
        fom="results/fom/{scene}/train.h5",
        snapshots="results/snapshots/{scene}/{group}.h5",
        sensitivity="results/sensitivity/{scene}.csv",
    output:
        "results/ladder/{scene}/{group}.csv",
    log:
        "results/logs/ladder/{scene}_{group}.log",
    params:
        scene=lambda w: PLAN.scene_config(w.scene),
        ladder=PLAN.ladder_rungs(),
        floor={
            "perturbation": PLAN.settings.sensitivity.reference,
            "threshold": PLAN.settings.sensitivity.threshold,
        },
        blowup_extent=PLAN.settings.blowup_extent,
        code=lambda w: PLAN.scene_code(
            "pdrom.experiments.ladder",
            w.scene,
            [*PLAN.study.ladder.up, *PLAN.study.ladder.down],
        ),
    message:
        "Ladder of {wildcards.group} in {wildcards.scene}"
    script:
        "../scripts/ladder.py"


rule ladder_table:
    input:
        parts=PLAN.ladder_files(),
    output:
        report("results/tables/ladder.csv", category="Tables"),
    log:
        "results/logs/tables/ladder.log",
    params:
        name="ladder",
        code=PLAN.code("pdrom.tables.ladder"),
    message:
        "Table of the ladder"
    script:
        "../scripts/table.py"
