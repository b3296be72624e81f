"""Breaks any network of a file in plain numpy, floppy parts and all: crackle is tested against it.

No stiffness matrix: with the plate held at displacement 1, the elongations B u + b, weighted by the roots of
the stiffnesses, have the least sum of squares. Where u is not unique (floppy parts) the elongations are.
"""
import numpy as np

from networks import BOTTOM, FREE, TOP

VANISHED = 1e-8   # of the intact plate force: below it doubles can't tell what is left from 0
FORCELESS = 1e-9  # an elongation below this fraction of the plate's displacement is rounding


def elongations(network, grips):
    """B, float[M, n], for the free components, and b, float[M], for the plate."""
    step = network.position[network.nodes[:, 1]] - network.position[network.nodes[:, 0]]
    if network.step is not None:
        step = network.step
    elif network.period_x > 0:
        step[:, 0] -= network.period_x * np.round(step[:, 0] / network.period_x)
    direction = step / np.linalg.norm(step, axis=1)[:, None]
    c = network.components
    along = direction if c == 2 else np.ones((len(step), 1))
    every = np.zeros((len(step), len(network.grip), c))
    bond = np.arange(len(step))
    every[bond, network.nodes[:, 1]] += along
    every[bond, network.nodes[:, 0]] -= along
    free = np.repeat((network.grip == FREE)[:, None], c, axis=1)
    if c == 2 and grips == "sliding":
        free[:, 0] = True
        free[np.flatnonzero(network.grip == BOTTOM)[0], 0] = False
    return every[:, free], every[:, network.grip == TOP, c - 1].sum(axis=1)


def break_network(network, grips="sliding"):
    """Breaks the bond with the largest |f|/t until the plate force vanishes: bonds, loads, stiffnesses."""
    free, plate = elongations(network, grips)
    stiffness = np.ones(len(network.nodes)) if network.stiffness is None else network.stiffness
    k = stiffness.copy()
    broken = {"/breaks/bond": [], "/breaks/load": [], "/breaks/stiffness": []}
    while True:
        root = np.sqrt(k)
        u = np.linalg.lstsq(root[:, None] * free, -root * plate, rcond=1e-11)[0]
        stretch = free @ u + plate
        whole = k @ stretch ** 2  # the plate force: twice the energy at unit displacement
        if whole < VANISHED * (broken["/breaks/stiffness"] or [1.0])[0]:
            return {name: np.array(values) for name, values in broken.items()}
        pull = np.where(np.abs(stretch) > FORCELESS, k * np.abs(stretch), 0)
        ratio = pull / network.threshold
        bond = int(np.argmax(ratio))
        broken["/breaks/bond"].append(bond)
        broken["/breaks/load"].append(whole / ratio[bond])
        broken["/breaks/stiffness"].append(whole)
        k[bond] = 0
