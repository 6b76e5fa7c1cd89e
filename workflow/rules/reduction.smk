# snapshots -> basis -> sampling and reconstruction error -> reduced reruns
rule pod:
    input:
        "results/snapshots/{scene}/{group}.h5",
    output:
        "results/pod/{scene}/{group}/{basis}.h5",
    log:
        "results/logs/pod/{scene}_{group}_{basis}.log",
    params:
        spec=lambda w: PLAN.basis_spec(w.basis),
        code=PLAN.code("pdrom.experiments.pod"),
    message:
        "POD of {wildcards.group} in {wildcards.scene} ({wildcards.basis})"
    script:
        "../scripts/pod.py"


# One job for both: starting another process takes longer than the sampling.
rule reruns:
    input:
        mesh=lambda w: PLAN.mesh_path(w.scene),
        fom="results/fom/{scene}/train.h5",
        heldout="results/fom/{scene}/heldout.h5",
        snapshots="results/snapshots/{scene}/{group}.h5",
        basis=lambda w: PLAN.basis_path(w.scene, w.group, w.method),
    output:
        sampling="results/sampling/{scene}/{group}/{method}.h5",
        errors="results/sampling/{scene}/{group}/{method}.csv",
        runs="results/reruns/{scene}/{group}/{method}.h5",
        table="results/reruns/{scene}/{group}/{method}.csv",
        heldout="results/reruns/{scene}/{group}/{method}_heldout.csv",
    log:
        "results/logs/reruns/{scene}_{group}_{method}.log",
    params:
        scene=lambda w: PLAN.scene_config(w.scene),
        spec=lambda w: PLAN.method_spec(w.method),
        sweep=PLAN.settings.sweep.model_dump(),
        ranks=list(PLAN.settings.ranks),
        heldout_ranks=list(PLAN.settings.heldout_ranks),
        blowup_extent=PLAN.settings.blowup_extent,
        guard=PLAN.guard_settings(),
        solver=PLAN.settings.solver,
        code=lambda w: PLAN.scene_code(
            "pdrom.experiments.reduction", w.scene, [PLAN.study.methods[w.method]]
        ),
    message:
        "Sampling and reruns of {wildcards.scene}, {wildcards.group} by {wildcards.method}"
    script:
        "../scripts/reruns.py"


rule hyper:
    input:
        mesh=lambda w: PLAN.mesh_path(w.scene),
        fom="results/fom/{scene}/train.h5",
        heldout="results/fom/{scene}/heldout.h5",
    output:
        runs="results/hyper/{scene}/models.h5",
        table="results/hyper/{scene}/models.csv",
        heldout="results/hyper/{scene}/models_heldout.csv",
    log:
        "results/logs/hyper/{scene}.log",
    params:
        scene=lambda w: PLAN.scene_config(w.scene),
        settings=PLAN.subspace_settings(),
        blowup_extent=PLAN.settings.blowup_extent,
        code=lambda w: PLAN.scene_code("pdrom.experiments.hyper", w.scene),
    message:
        "Position subspaces of {wildcards.scene}, with full and with sampled projections"
    script:
        "../scripts/hyper.py"
