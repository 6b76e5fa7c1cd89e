"""Readers of mesh files, and checks of a file that meshio reads.

They run in the process of `pdrom.model.mesh.reader` and import NumPy at most, so that it starts in
a fraction of a second.
"""
