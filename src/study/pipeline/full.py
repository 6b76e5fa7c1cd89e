"""Whether a configuration is that of the full study."""

from pdrom.core.yamlfile import read_yaml, validate
from study.pipeline.folders import DEFAULT
from study.pipeline.study import Study, StudySettings

FULL_STUDY = DEFAULT


def is_full(study: Study) -> bool:
    """Whether the study has the settings of config/default.yaml."""
    path = study.root / FULL_STUDY
    return study.settings == validate(StudySettings, read_yaml(path), str(path))


def apart(study: Study) -> str:
    """Words that tell results of a study from those of the full one; empty for the full one."""
    if is_full(study):
        return ""
    coarsen = study.settings.coarsen
    factors = {"coarse meshes": coarsen.resolution, "short runs": coarsen.frames}
    kinds = [words for words, factor in factors.items() if factor < 1.0]
    return f"of {' and '.join(kinds) or 'this configuration'}, not those of the study"
