"""Networks to read with -lattice file, and the writer of their files."""
from dataclasses import dataclass, replace
from typing import Optional

import h5py
import numpy as np
from scipy.spatial import Delaunay

FREE, BOTTOM, TOP = 0, 1, 2


@dataclass
class NetworkOfFile:
    """N nodes, M bonds; what is None stays out of the file."""
    position: np.ndarray                     # float64[N, 2]
    grip: np.ndarray                         # int8[N]
    nodes: np.ndarray                        # int32[M, 2]
    stiffness: Optional[np.ndarray] = None   # float64[M]
    threshold: Optional[np.ndarray] = None   # float64[M]
    components: int = 2                      # 1 fuse, 2 spring
    period_x: float = 0.0                    # 0: not periodic
    step: Optional[np.ndarray] = None        # float64[M, 2]

    def but(self, **changes):
        """A copy with other fields; a dict stands for single entries of one: but(grip={3: TOP})."""
        for name, change in changes.items():
            if isinstance(change, dict):
                changes[name] = getattr(self, name).copy()
                for place, value in change.items():
                    changes[name][place] = value
        return replace(self, **changes)

    def without(self, bonds):
        """A copy without the bonds of these numbers."""
        def rest(values):
            return None if values is None else np.delete(values, bonds, axis=0)

        return replace(self, nodes=rest(self.nodes), stiffness=rest(self.stiffness),
                       threshold=rest(self.threshold))

    def with_parts(self, position, nodes, seed=0):
        """A copy with more nodes, all free, and more bonds, of stiffness 1 and random thresholds."""
        random = np.random.default_rng(seed)
        return replace(self, position=np.vstack([self.position, position]),
                       grip=np.append(self.grip, np.zeros(len(position), np.int8)),
                       nodes=np.vstack([self.nodes, nodes]).astype(np.int32),
                       stiffness=np.append(self.stiffness, np.ones(len(nodes))),
                       threshold=np.append(self.threshold, random.random(len(nodes))))

    def write(self, path):
        with h5py.File(path, "w") as file:
            group = file.create_group("network")
            group.attrs["components"] = np.int32(self.components)
            group.attrs["period_x"] = float(self.period_x)
            for name, values in (("nodes/position", self.position), ("nodes/grip", self.grip),
                                 ("bonds/nodes", self.nodes), ("bonds/stiffness", self.stiffness),
                                 ("bonds/threshold", self.threshold), ("bonds/step", self.step)):
                if values is not None:
                    group[name] = values
        return path


def small_network():
    """Two bottom nodes, two free, two top; eleven bonds, stiffness and thresholds given."""
    position = np.array([[0, 0], [1, 0], [0.1, 1], [1.1, 1.1], [0, 2], [1, 2]], float)
    grip = np.array([BOTTOM, BOTTOM, FREE, FREE, TOP, TOP], np.int8)
    nodes = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3], [2, 4], [2, 5], [3, 4], [3, 5], [4, 5]],
                     np.int32)
    random = np.random.default_rng(7)
    return NetworkOfFile(position, grip, nodes, 0.5 + random.random(11), 0.1 + random.random(11))


def irregular_network(seed, nodes=60, components=2):
    """Delaunay's triangulation of random points; stiffness over four decades, thresholds over one."""
    random = np.random.default_rng(seed)
    position = 10 * random.random((nodes, 2))
    triangles = Delaunay(position).simplices
    sides = np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    bonds = np.unique(np.sort(sides, axis=1), axis=0).astype(np.int32)
    height = position[:, 1]
    grip = np.where(height < 1.5, BOTTOM, np.where(height > 8.5, TOP, FREE)).astype(np.int8)
    return NetworkOfFile(position, grip, bonds, stiffness=10 ** random.uniform(-2, 2, len(bonds)),
                         threshold=10 ** random.uniform(-1, 0, len(bonds)), components=components)
