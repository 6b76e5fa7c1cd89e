"""Compiled functions of the model: how they are kept, and padded vectors."""
