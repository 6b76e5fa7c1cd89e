"""The meshers behind unstructured shapes: Triangle in the plane, TetGen in space.

J. R. Shewchuk, "Triangle: engineering a 2D quality mesh generator and Delaunay triangulator",
1996; H. Si, "TetGen, a Delaunay-based quality tetrahedral mesh generator", ACM TOMS 41(2), 2015.
Both come with the package meshpy, which is imported when a scene has such a shape and not before.
Equal input gives equal bytes.
"""

from collections.abc import Callable

import numpy as np

# degrees; Triangle is proven to end up to 20.7 and ends up to 33 in practice
SMALLEST_ANGLE = 30.0
# edges of a triangle are at most so much longer than requested, where their images count
LONGEST = 1.25
# largest area of a triangle over that of the equilateral one, where they do not
LARGEST = 1.2
# Volume of a regular tetrahedron over its edge cubed. TetGen stays below the largest volume that it
# is given, by about a third on average.
REGULAR, MARGIN = np.sqrt(2.0) / 12.0, 1.3


def triangulate(
    points: np.ndarray,
    segments: np.ndarray,
    hole: np.ndarray | None,
    edge: float,
    image: Callable[[np.ndarray], np.ndarray] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 2) and triangles (T, 3), anticlockwise, of a region of the plane.

    Parameters
    ----------
    points, segments : (n, 2), (n, 2) its boundary, which stays as it is and comes first
    hole : (2,) a point in a hole of the region, None if it has none
    edge : length about which edges have
    image : maps points (m, 2) to where their edges are measured, (m, 3); None: in the plane
    """
    from meshpy import triangle

    def too_large(corners: list[tuple[float, float]], _area: float) -> bool:
        assert image is not None
        there = image(np.array([(corner[0], corner[1]) for corner in corners]))
        longest = np.linalg.norm(there - np.roll(there, 1, axis=0), axis=1).max()
        return bool(longest > LONGEST * edge)

    region = triangle.MeshInfo()
    region.set_points(points.tolist())
    region.set_facets(segments.tolist())
    region.set_holes([] if hole is None else [hole.tolist()])
    made = triangle.build(
        region,
        refinement_func=too_large if image else None,
        max_volume=None if image else LARGEST * np.sqrt(3.0) / 4.0 * edge**2,
        min_angle=SMALLEST_ANGLE,
        allow_boundary_steiner=False,
    )
    return np.array(made.points), np.array(made.elements, dtype=np.int32)


def fill(points: np.ndarray, triangles: np.ndarray, edge: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3), those of the surface first, and tetrahedra (E, 4) inside a closed surface.

    The surface stays as it is. ``edge`` is the length about which edges inside have.

    Parameters
    ----------
    points : (N, 3) m, of the surface
    triangles : (T, 3), closed
    """
    from meshpy import tet

    body = tet.MeshInfo()
    body.set_points(points.tolist())
    body.set_facets(triangles.tolist())
    volume = MARGIN * REGULAR * edge**3
    made = tet.build(body, tet.Options("pq1.3/10Y"), max_volume=volume)
    return np.array(made.points), np.array(made.elements, dtype=np.int32)
