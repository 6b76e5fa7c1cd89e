"""Compiled functions of the model: how they are kept, and vectors of four numbers."""
