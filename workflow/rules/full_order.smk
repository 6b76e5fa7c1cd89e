# scene -> mesh -> full-order run -> snapshots, and the sensitivity of the full-order run
rule mesh:
    input:
        lambda w: PLAN.mesh_file(w.mesh),
    output:
        "results/meshes/{mesh}.h5",
    log:
        "results/logs/mesh/{mesh}.log",
    params:
        config=lambda w: PLAN.mesh_config(w.mesh),
        root=lambda w: str(PLAN.root),
        content=lambda w: PLAN.digest(*PLAN.mesh_file(w.mesh)),
        code=PLAN.code("pdrom.experiments.mesh"),
    message:
        "Mesh {wildcards.mesh}"
    script:
        "../scripts/mesh.py"


rule fom:
    input:
        mesh=lambda w: PLAN.mesh_path(w.scene),
    output:
        "results/fom/{scene}/{run}.h5",
    log:
        "results/logs/fom/{scene}_{run}.log",
    threads: PLAN.settings.threads
    params:
        scene=lambda w: PLAN.scene_config(w.scene),
        solver=PLAN.settings.solver,
        code=lambda w: PLAN.scene_code("pdrom.experiments.fom", w.scene),
    message:
        "Full-order run of {wildcards.scene} ({wildcards.run})"
    script:
        "../scripts/fom.py"


rule iterations:
    input:
        mesh=lambda w: PLAN.mesh_path(w.scene),
        fom="results/fom/{scene}/train.h5",
        sensitivity="results/sensitivity/{scene}.csv",
    output:
        "results/iterations/{scene}.csv",
    log:
        "results/logs/iterations/{scene}.log",
    params:
        scene=lambda w: PLAN.scene_config(w.scene),
        settings=PLAN.settings.iterations.model_dump(mode="json"),
        floor={
            "perturbation": PLAN.settings.sensitivity.reference,
            "threshold": PLAN.settings.sensitivity.threshold,
        },
        solver=PLAN.settings.solver,
        code=lambda w: PLAN.scene_code("pdrom.experiments.iterations", w.scene),
    message:
        "Accuracy of {wildcards.scene} against the number of iterations"
    script:
        "../scripts/iterations.py"


rule snapshots:
    input:
        mesh=lambda w: PLAN.mesh_path(w.scene),
        train="results/fom/{scene}/train.h5",
        heldout="results/fom/{scene}/heldout.h5",
    output:
        "results/snapshots/{scene}/{group}.h5",
    log:
        "results/logs/snapshots/{scene}_{group}.log",
    params:
        scene=lambda w: PLAN.scene_config(w.scene),
        code=lambda w: PLAN.scene_code("pdrom.experiments.snapshots", w.scene),
    message:
        "Snapshots of {wildcards.group} in {wildcards.scene}"
    script:
        "../scripts/snapshots.py"
