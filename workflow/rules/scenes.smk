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
