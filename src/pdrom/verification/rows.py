"""What is known of a row beside its numbers: a run that failed, a scene that is chaotic."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from pdrom.tables.declaration import Table
from pdrom.verification.distance import EPSILON

# An error above it counts as failed, as everywhere in the study.
FAILED = 0.1
# An amplification above it leaves nothing of the digits of double precision but half of them.
RESOLVED = EPSILON**-0.5
RUNS = "reduced_reruns"
SPECTRA = "singular_values"
# Columns of the table of claims with a verdict, and the tests that decide it.
PARTS = {"verdict": "published", "verdict_beyond": "beyond"}
# Part of the names of methods whose number of elements is what a fit with non-negative weights
# leaves: rounding may leave a few more or less of them, at the same error.
FITTED = "ecsw"
# What names the samples of a reduction.
SAMPLES = ("scene", "group", "method", "r")


@dataclass(frozen=True)
class Context:
    """What rows of one table say about those of others.

    chaotic : scenes with frames beyond their horizon, where rounding errors decide
    modes : number of modes above round-off by scene and group
    anew : `SAMPLES` of reductions whose samples rounding has chosen anew
    on_times : claims and parts (published, beyond) with another verdict that says nothing, see
        `pdrom.verification.times`
    """

    chaotic: frozenset[str] = frozenset()
    modes: Mapping[tuple[str, str], int] = field(default_factory=dict)
    anew: frozenset[tuple] = frozenset()
    on_times: frozenset[tuple[str, str]] = frozenset()

    def of_chaotic_scene(self, frame: pd.DataFrame) -> np.ndarray:
        """Rows that belong to a chaotic scene."""
        if "scene" not in frame:
            return np.zeros(len(frame), dtype=bool)
        return frame.scene.isin(list(self.chaotic)).to_numpy(dtype=bool)

    def of_whole_basis(self, frame: pd.DataFrame) -> np.ndarray:
        """Rows of reductions with every mode above round-off, or all but one.

        The last modes are made of rounding errors in part. Without the mean there is one less.
        """
        found = np.zeros(len(frame), dtype=bool)
        if self.modes and {"scene", "group", "r"} <= set(frame.columns):
            most = [
                self.modes.get(key, np.inf) for key in zip(frame.scene, frame.group, strict=True)
            ]
            found[:] = (frame.r >= np.array(most, dtype=float) - 1).fillna(False)
        return found

    def of_other_samples(self, frame: pd.DataFrame) -> np.ndarray:
        """Rows of reductions whose samples were chosen anew."""
        found = np.zeros(len(frame), dtype=bool)
        if self.anew and set(SAMPLES) <= set(frame.columns):
            found[:] = [key in self.anew for key in samples(frame)]
        return found

    def of_verdict_on_times(self, frame: pd.DataFrame, part: str) -> np.ndarray:
        """Rows of claims whose verdict rests on times: of this part, or of the part they name.

        Rows of single tests are none: each of them says by itself whether it compares times.
        """
        if "claim" not in frame or "metric" in frame:
            return np.zeros(len(frame), dtype=bool)
        parts = frame.part if "part" in frame else [part] * len(frame)
        pairs = zip(frame.claim, parts, strict=True)
        return np.array([pair in self.on_times for pair in pairs], dtype=bool)


def samples(frame: pd.DataFrame) -> list[tuple]:
    """`SAMPLES` of each row."""
    return list(frame[list(SAMPLES)].astype(str).itertuples(index=False, name=None))


def chaotic_scenes(tables: Mapping[str, pd.DataFrame]) -> frozenset[str]:
    """Scenes some of whose frames lie beyond the horizon."""
    if RUNS not in tables:
        return frozenset()
    runs = (
        tables[RUNS].groupby("scene").agg(end=("frames", "max"), horizon=("horizon_frame", "max"))
    )
    return frozenset(runs.index[runs.horizon < runs.end])


def modes_above_roundoff(tables: Mapping[str, pd.DataFrame]) -> dict[tuple[str, str], int]:
    """Number of modes above round-off by scene and group."""
    if SPECTRA not in tables:
        return {}
    spectra = tables[SPECTRA]
    above = spectra[spectra.above_roundoff.fillna(False)]
    return above.groupby(["scene", "group"]).component.max().astype(int).to_dict()


def failed(table: Table, frame: pd.DataFrame) -> np.ndarray:
    """Rows of runs that failed, or that nobody may judge."""
    found = said_to_fail(table, frame)
    for column in table.columns:
        if column.kind == "number" and is_error(column.name, column.quantity):
            found |= (frame[column.name] > FAILED).to_numpy(dtype=bool)
    return found


def said_to_fail(table: Table, frame: pd.DataFrame) -> np.ndarray:
    """Rows that say so by a flag or an outcome."""
    found = np.zeros(len(frame), dtype=bool)
    for column in table.columns:
        values = frame[column.name]
        if column.failing:
            found |= values.isin(column.failing).to_numpy(dtype=bool)
        elif column.name == "finite":
            found |= (values == False).fillna(False).to_numpy(dtype=bool)  # noqa: E712 : or empty
    return found


def is_error(name: str, quantity: str) -> bool:
    """Whether a column holds errors, within the horizon or not."""
    return quantity == "error" or (quantity == "run" and "error" in name)


def of_fitted_samples(frame: pd.DataFrame) -> np.ndarray:
    """Rows of reductions whose number of samples is the outcome of a fit.

    A table that has its tolerance, ``tau``, and names no methods has no others.
    """
    if "method" not in frame:
        return np.full(len(frame), "tau" in frame)
    return frame.method.astype(str).str.contains(FITTED).to_numpy(dtype=bool)


def unresolved(table: Table, frame: pd.DataFrame) -> np.ndarray:
    """Rows whose amplification exceeds what double precision resolves."""
    gains = [frame[c.name] for c in table.columns if c.quantity == "gain"]
    found = np.zeros(len(frame), dtype=bool)
    for values in gains:
        found |= (values > RESOLVED).to_numpy(dtype=bool)
    return found
