"""The triangles of a mesh, whatever its format; by coal, behind Pinocchio."""

from pathlib import Path

import numpy as np
import pinocchio as pin

from solfer.errors import ModelError
from solfer.model.urdf.mesh_files import unit_of


def triangles_of(path: Path) -> np.ndarray:
    """Read the corners of all triangles of a mesh, shape (n, 3, 3) [m].

    Raises:
        ModelError: It is no mesh, or its unit is no number.
    """
    unit = unit_of(path)
    try:
        mesh = pin.hppfcl.MeshLoader().load(str(path), np.ones(3))
    except (ValueError, RuntimeError) as error:
        raise ModelError(f"no mesh: {error}", where=str(path), expected="triangles as STL, OBJ or COLLADA") from error
    corners = [[mesh.tri_indices(index)[corner] for corner in range(3)] for index in range(mesh.num_tris)]
    return unit * mesh.vertices()[np.array(corners, dtype=np.intp).reshape(-1, 3)]
