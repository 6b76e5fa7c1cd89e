"""Families of scenes: what a scene and its twin show is one observation."""

import pandas as pd

TWIN = "_twin"


def families(scenes: pd.Series) -> pd.Series:
    """Family of each scene: its name, or that of the scene that it is the twin of."""
    return scenes.str.removesuffix(TWIN)
