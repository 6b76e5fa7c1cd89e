"""Run models and write files of results; each module has the experiments on one subject."""
