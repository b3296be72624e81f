"""The random spring and fuse models on the triangular lattice in plain numpy: crackle is tested against it.

Written from the description of the model alone, as plainly as it goes: the dense stiffness matrix is
assembled afresh and solved after every break. Good up to size 16 or so.

Lengths are in lattice spacings along x, forces in bond stiffness x lattice spacing (fuses: any current).
"""
import numpy as np

VANISHED = 1e-8  # of the intact plate force: below it doubles can't tell what is left from 0


def triangular_lattice(size, row_spacing=1.0):
    """The (3L+1)(L+1) bonds of L+1 rows of L+1 nodes, L = size.

    Node (row, column) has number row (L+1) + column. Bonds node by node, row by row upwards: the horizontal
    bond, the one up to the right, the one up to the left.
    Returns nodes int[M, 2] and unit vectors from the first to the second node, float[M, 2].
    """
    period = size + 1
    nodes, steps = [], []
    for row in range(period):
        for column in range(period):
            here, above, shift = row * period + column, (row + 1) * period, row % 2
            nodes.append((here, row * period + (column + 1) % period))
            steps.append((1.0, 0.0))
            if row < size:
                nodes.append((here, above + (column + shift) % period))
                steps.append((0.5, row_spacing))
                nodes.append((here, above + (column + shift - 1) % period))
                steps.append((-0.5, row_spacing))
    steps = np.array(steps)
    return np.array(nodes), steps / np.linalg.norm(steps, axis=1)[:, None]


def number_unknowns(size, model, grips):
    """Unknown of each displacement, int[N, components]: 0 .. n-2 free, n-1 the plate, n held at zero.

    Returns the numbering and n. A fuse network has one component, the potential. Sliding grips leave x free
    in both gripped rows, but for the first node's.
    """
    period = size + 1
    free, plate, held = -1, -2, -3
    components = 2 if model == "spring" else 1
    unknown = np.full((period * period, components), free)
    unknown[:period, -1] = held
    unknown[-period:, -1] = plate
    if model == "spring":
        unknown[0, 0] = held
        if grips == "clamped":
            unknown[:period, 0] = unknown[-period:, 0] = held
    n = np.count_nonzero(unknown == free) + 1
    unknown[unknown == plate] = n - 1
    unknown[unknown == held] = n
    unknown[unknown == free] = np.arange(n - 1)
    return unknown, n


def elongations(size, model, grips, row_spacing):
    """The matrix B, float[M, n], that gives each bond's elongation (potential drop) from the n unknowns."""
    nodes, direction = triangular_lattice(size, row_spacing)
    unknown, n = number_unknowns(size, model, grips)
    if model == "fuse":
        direction = np.ones((len(nodes), 1))
    b = np.zeros((len(nodes), n + 1))  # the last column collects what is held at zero
    bond = np.arange(len(nodes))[:, None]
    np.add.at(b, (bond, unknown[nodes[:, 1]]), direction)
    np.add.at(b, (bond, unknown[nodes[:, 0]]), -direction)
    return b[:, :n]


def break_lattice(size, thresholds, model="spring", grips="sliding", break_on="magnitude", row_spacing=1.0):
    """Breaks the bond with the largest |f|/t (`tension`: f/t) until the plate force vanishes.

    thresholds: float[M], M = (3 size + 1)(size + 1), in bond order; stiffnesses are 1.
    Returns, one entry per break: bonds int[B]; loads float[B], the P_k at which they broke; stiffnesses
    float[B], the plate force at unit plate displacement just before. Of equal ratios the lowest bond breaks.
    """
    b = elongations(size, model, grips, row_spacing)
    intact = np.ones(len(b), dtype=bool)
    bonds, loads, stiffnesses = [], [], []
    while True:
        k = b[intact].T @ b[intact]
        u = np.append(np.linalg.solve(k[:-1, :-1], -k[:-1, -1]), 1.0)  # unit plate displacement
        force = np.where(intact, b @ u, 0.0)
        stiffness = b[:, -1] @ force
        if stiffness < VANISHED * (stiffnesses[0] if stiffnesses else 1.0):
            return np.array(bonds), np.array(loads), np.array(stiffnesses)
        pull = np.abs(force) if break_on == "magnitude" else np.maximum(force, 0.0)
        ratio = np.divide(pull, thresholds, out=np.where(pull > 0, np.inf, 0.0), where=thresholds > 0)
        bond = int(np.argmax(ratio))
        bonds.append(bond)
        loads.append(stiffness / ratio[bond])
        stiffnesses.append(stiffness)
        intact[bond] = False
