"""Jobs of artifacts: their files, settings and code, from the declarations and a study."""

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
    """A job: an artifact for one set of labels such as scene and group.

    inputs, outputs : paths by name
    settings : plain data
    content : checksum of the hand-edited files among the inputs, whose dates may be set back
    code : fingerprint of the code that the job runs
    """

    artifact: Artifact
    labels: dict[str, str]
    inputs: dict[str, Paths]
    outputs: dict[str, str]
    settings: dict[str, Any]
    content: str
    code: str

    def make(self, outputs: Mapping[str, str]) -> None:
        """Run the job in this process; ``outputs`` are the paths of the files to write, by name."""
        own = self.artifact
        job = {"settings": self.settings, "inputs": self.inputs, "outputs": outputs}
        make(own.address, own.rule, self.code, self.labels, **job)

    @property
    def files(self) -> list[str]:
        """All input paths of the job."""
        return [path for paths in self.inputs.values() for path in listed(paths)]


class Resolver:
    """Answers to the reads of artifacts for one study, their `Sources`.

    results : path of the results folder
    """

    def __init__(self, study: Study, results: str) -> None:
        self.study, self.results = study, results
        self._jobs: dict[tuple[str, ...], Job] = {}

    def job(self, artifact: Artifact, labels: Labels = MappingProxyType({})) -> Job:
        """Return the job with these labels; ConfigurationError if an input or a key is unknown."""
        key = (artifact.rule, *(labels[name] for name in artifact.labels))
        if key not in self._jobs:
            own = {name: labels[name] for name in artifact.labels}
            self._jobs[key] = self._resolved(artifact, own)
        return self._jobs[key]

    def _resolved(self, artifact: Artifact, labels: dict[str, str]) -> Job:
        known = {**labels, "figure": artifact.name}  # options of a figure are looked up by its name
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

    # Methods that reads of artifacts call -------------------------------------------------------

    def file(self, place: Place, labels: Labels) -> str:
        """Path of the file of the kind ``place`` that belongs to a job with these ``labels``.

        A missing label "mesh" follows from the scene, a missing label "basis" from the method.
        """
        found = dict(labels)
        if "mesh" in place.labels and "mesh" not in found:
            found["mesh"] = self.study.mesh_of(found["scene"])
        if "basis" in place.labels and "basis" not in found:
            found["basis"] = self.study.methods[found["method"]].basis_id
        return place.at(self.results, **{name: found[name] for name in place.labels})

    def files(self, place: Place, labels: Labels) -> list[str]:
        """Paths of all files of the kind ``place`` whose labels agree with ``labels`` of a job."""
        study = self.study.only(labels["scene"]) if "scene" in labels else self.study
        return [
            place.at(self.results, **held)
            for held in labels_of(study, place)
            if all(held[name] == labels[name] for name in held.keys() & labels.keys())
        ]

    def table(self, name: str) -> str:
        """Path of the table ``name``; ConfigurationError if there is no such table."""
        if name not in declared():
            raise ConfigurationError(f"'{name}': unknown{choices(name, declared())}")
        return TABLE.at(self.results, name=name)

    def value(self, key: str, labels: Labels) -> Any:
        """Configuration value of ``key``, or a value derived from ``labels`` (see `DERIVED`)."""
        head, _, parts = key.partition(".")
        if head not in DERIVED:
            return self.study.value(key)
        value = DERIVED[head](self.study, labels)
        return part_of(value, parts, key) if parts else value


def listed(paths: Paths) -> list[str]:
    """Return ``paths``, one path or a list of paths, as a list."""
    return [paths] if isinstance(paths, str) else list(paths)
