"""Whether a configuration is that of the full study."""

from pdrom.core.yamlfile import read_yaml, validate
from pdrom.pipeline.study import Study, StudySettings

FULL_STUDY = "config/default.yaml"


def is_full(study: Study) -> bool:
    """Whether the study has the settings of config/default.yaml."""
    path = study.root / FULL_STUDY
    return study.settings == validate(StudySettings, read_yaml(path), str(path))
