# One rule for each artifact that src/study declares: experiments (<name>), tables (<name>_table), figures (figure_<name>)
# and the manuscript. To make only one figure and what it needs:
#   ./reproduce results/figures/<name>.pdf
for made in rules_of(PLAN, CORES):

    rule:
        name:
            made.name
        input:
            **made.input,
        output:
            **{
                name: report(path, **made.shown[name]) if name in made.shown else path
                for name, path in made.output.items()
            },
        log:
            made.log,
        group:
            made.group if GROUPED else None
        threads: made.threads
        resources:
            **made.resources,
        params:
            **made.params,
        message:
            made.message
        script:
            "../scripts/artifact.py"
