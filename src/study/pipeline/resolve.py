"""Jobs of artifacts: what each reads, writes and depends on, from the declarations and a study."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from pdrom.core.errors import ConfigurationError, choices
from study.artifact.artifact import Artifact, make, modules_in
from study.artifact.paths import TABLE, Place
from study.artifact.reads import EditedFiles, Labels, Paths
from study.pipeline.contents import labels_of
from study.pipeline.fingerprint import digest, fingerprint
from study.pipeline.study import Study, part_of
from study.pipeline.values import DERIVED
from study.tables import declared


@dataclass(frozen=True)
class Job:
    """An artifact for one set of labels.

    inputs, outputs : paths by name
    settings : plain data
    content : checksum of the files it reads that people edit; their dates may be set back
    code : fingerprint of the code that it runs
    """

    artifact: Artifact
    labels: dict[str, str]
    inputs: dict[str, Paths]
    outputs: dict[str, str]
    settings: dict[str, Any]
    content: str
    code: str

    def make(self, outputs: Mapping[str, str]) -> None:
        """Run the job here; ``outputs`` are the files to write, by name."""
        make(
            self.artifact.address,
            self.artifact.rule,
            settings=self.settings,
            labels=self.labels,
            code=self.code,
            inputs=self.inputs,
            outputs=outputs,
        )

    @property
    def files(self) -> list[str]:
        """Every path that it reads."""
        return [path for paths in self.inputs.values() for path in listed(paths)]


class Resolver:
    """Files and settings of a study, see `study.artifact.reads.Sources`.

    results : folder of the results
    """

    def __init__(self, study: Study, results: str) -> None:
        self.study, self.results = study, results
        self._jobs: dict[tuple[str, ...], Job] = {}

    def job(self, artifact: Artifact, labels: Labels = MappingProxyType({})) -> Job:
        """The job with these labels; ConfigurationError if it reads what does not exist."""
        key = (artifact.rule, *(labels[name] for name in artifact.labels))
        if key not in self._jobs:
            own = {name: labels[name] for name in artifact.labels}
            self._jobs[key] = self._resolved(artifact, own)
        return self._jobs[key]

    def _resolved(self, artifact: Artifact, labels: dict[str, str]) -> Job:
        known = {**labels, "figure": artifact.name}  # a figure's options are found by its name
        settings = artifact.settings(self, known)
        inputs = artifact.inputs(self, known)
        edited = [k for k, read in artifact.files.items() if isinstance(read, EditedFiles)]
        content = [path for name in edited for path in listed(inputs[name])]
        places = artifact.writes.items()
        return Job(
            artifact,
            labels,
            inputs,
            {name: place.at(self.results, **labels) for name, place in places},
            artifact.plain(settings),
            digest(self.study.root, *content) if content else "",
            fingerprint(artifact.module, *sorted(set(modules_in(settings)))),
        )

    # What declarations ask for (`Sources`) --------------------------------------------------

    def file(self, place: Place, labels: Labels) -> str:
        """Path of the file ``place`` of a job with ``labels``.

        Mesh and basis follow from its scene and method.
        """
        found = dict(labels)
        if "mesh" in place.labels and "mesh" not in found:
            found["mesh"] = self.study.mesh_of(found["scene"])
        if "basis" in place.labels and "basis" not in found:
            found["basis"] = self.study.methods[found["method"]].basis_id
        return place.at(self.results, **{name: found[name] for name in place.labels})

    def files(self, place: Place, labels: Labels) -> list[str]:
        """Paths of a kind, ``place``, whose labels agree with the ``labels`` of a job."""
        study = self.study.only(labels["scene"]) if "scene" in labels else self.study
        return [
            place.at(self.results, **held)
            for held in labels_of(study, place)
            if all(held[name] == labels[name] for name in held.keys() & labels.keys())
        ]

    def table(self, name: str) -> str:
        """File of the table ``name``; ConfigurationError if there is no such table."""
        if name not in declared():
            raise ConfigurationError(f"'{name}': unknown{choices(name, declared())}")
        return TABLE.at(self.results, name=name)

    def value(self, key: str, labels: Labels) -> Any:
        """Value of the configuration by its ``key``, or one derived (`DERIVED`) for ``labels``."""
        head, _, parts = key.partition(".")
        if head not in DERIVED:
            return self.study.value(key)
        value = DERIVED[head](self.study, labels)
        return part_of(value, parts, key) if parts else value


def listed(paths: Paths) -> list[str]:
    """List of one path, or of several, ``paths``."""
    return [paths] if isinstance(paths, str) else list(paths)
