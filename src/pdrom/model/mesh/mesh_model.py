"""Base of the configurations of all kinds of meshes."""

import hashlib
import json

from pdrom.core.yamlfile import ConfigModel


class MeshModel(ConfigModel):
    """A generator with its parameters, or a file."""

    @property
    def label(self) -> str:
        """Name of the mesh in messages and file names."""
        raise NotImplementedError(f"{type(self).__name__} has no label")

    @property
    def identifier(self) -> str:
        """File name of the mesh: readable, and different for different parameters."""
        canonical = json.dumps(self.model_dump(mode="json"), sort_keys=True)
        return f"{self.label}_{hashlib.sha256(canonical.encode()).hexdigest()[:8]}"

    @property
    def sources(self) -> list[str]:
        """Files of the project that the mesh is read from; none for one that is generated."""
        return []
