# One rule for each artifact of a single scene (src/pdrom/report/scenes), for any scene that has a file:
#   ./reproduce scene NAME   makes those that are made by default
for name, artifact in PLAN.scene_artifacts.items():

    rule:
        name:
            f"scene_{name}"
        input:
            PLAN.of_scene.inputs(artifact),
        output:
            **PLAN.of_scene.outputs(artifact),
        log:
            PLAN.of_scene.log(name),
        params:
            **PLAN.of_scene.params(name),
        message:
            f"{artifact.title}: {{wildcards.scene}}"
        script:
            "../scripts/scene.py"


# The viewer of the scenes that the configuration names (key viewer), on request:
#   ./reproduce viewer
rule viewer:
    input:
        PLAN.of_scene.viewer.inputs,
    output:
        page=PLAN.of_scene.viewer.page,
    log:
        PLAN.of_scene.viewer.log,
    params:
        orders=PLAN.of_scene.viewer.orders,
        content=PLAN.of_scene.viewer.content,
        code=PLAN.of_scene.viewer.code,
    message:
        "Viewer of runs"
    script:
        "../scripts/viewer.py"
