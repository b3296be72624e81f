"""Network files as nobody would write them, or only somebody whose script has a fault: values here, the rest in
fuzz_structures.py.
"""
import h5py
import numpy as np
from fuzz_structures import STRUCTURES, change_structure
from networks import irregular_network, small_network

NUMBERS = (0.0, -0.0, 1.0, -1.0, np.nan, np.inf, -np.inf, 1e-320, 5e-324, 1e-170, 1e-16, 1e16, 1e170, 1e300, -1e300,
           1.7976931348623157e308)
INTEGERS = (0, 1, -1, 2, 3, 5, 6, 127, -128, 2**31 - 1, -2**31, 2**31, 2**32, 2**63 - 1, -2**63)


def base(chance):
    """A network that is as it should be."""
    if chance.random() < 0.5:
        return small_network().but(components=chance.choice((1, 2)))
    return irregular_network(chance.randrange(100), nodes=20, components=chance.choice((1, 2)))


def fields(network):
    return {"nodes/position": network.position, "nodes/grip": network.grip, "bonds/nodes": network.nodes,
            "bonds/stiffness": network.stiffness, "bonds/threshold": network.threshold}


# Values: each takes (chance, parts), parts a dict of arrays by name, and tells what it did.

def change_entry(chance, parts):
    name = chance.choice([name for name in parts if parts[name].size])
    flat = parts[name].copy().ravel()
    at = chance.randrange(flat.size)
    value = chance.choice(NUMBERS) if flat.dtype.kind == "f" else \
        chance.choice([number for number in INTEGERS if np.iinfo(flat.dtype).min <= number <= np.iinfo(flat.dtype).max])
    flat[at] = value
    parts[name] = flat.reshape(parts[name].shape)
    return f"{name}[{at}] = {value}"


def scale(chance, parts):
    name = chance.choice(("nodes/position", "bonds/stiffness", "bonds/threshold"))
    factor = chance.choice((0.0, 1e-320, 1e-200, 1e-20, 1e-5, 1e5, 1e20, 1e100, 1e200, 1e300, -1.0))
    with np.errstate(over="ignore"):
        parts[name] = parts[name] * factor
    return f"{name} * {factor}"


def shift(chance, parts):
    by = chance.choice((1e3, -1e8, 1e15, 1e17, 1e300))
    parts["nodes/position"] = parts["nodes/position"] + by
    return f"nodes/position + {by}"


def stretch(chance, parts):
    by = chance.choice((0.0, 1e-170, 1e-12, 1e-6, 1e6, 1e12, 1e170))
    parts["nodes/position"] = parts["nodes/position"] * np.array(chance.choice(([1, by], [by, 1])))
    return f"stretched by {by}"


def spread(chance, parts):
    """Over so many decades."""
    name = chance.choice(("bonds/stiffness", "bonds/threshold"))
    decades = chance.choice((4, 12, 30, 300))
    parts[name] = np.array([10.0 ** chance.uniform(-decades, decades) for _ in parts[name]])
    return f"{name} over {2 * decades} decades"


def make_equal(chance, parts):
    name = chance.choice(list(parts))
    parts[name] = np.full_like(parts[name], chance.choice((0, 1, 2, 3)))
    return f"{name} all {parts[name].flat[0]}"


def shuffle_bonds(chance, parts):
    parts["bonds/nodes"] = np.array([chance.randrange(len(parts["nodes/grip"])) for _ in parts["bonds/nodes"].flat],
                                    np.int32).reshape(-1, 2)
    return "random bonds"


def shuffle_grips(chance, parts):
    parts["nodes/grip"] = np.array([chance.choice((0, 0, 1, 2)) for _ in parts["nodes/grip"]], np.int8)
    return "random grips"


def cut_rows(chance, parts):
    name = chance.choice(list(parts))
    parts[name] = parts[name][:chance.randrange(len(parts[name]) + 1)]
    return f"{name} cut to {len(parts[name])} rows"


def repeat_rows(chance, parts):
    name = chance.choice(list(parts))
    parts[name] = np.concatenate([parts[name]] * chance.choice((2, 3)))
    return f"{name} has {len(parts[name])} rows"


VALUES = (change_entry, change_entry, change_entry, scale, scale, shift, stretch, spread, make_equal, shuffle_bonds,
          shuffle_grips, cut_rows, repeat_rows)


def attribute(chance, group, _, __):
    name = chance.choice(("components", "period_x"))
    value = chance.choice((*NUMBERS, *INTEGERS[:-1], "text", b"text", [1, 2], [], 1.5, np.float32(2),
                           h5py.Empty("f8"), np.bool_(True), 2j, np.uint64(2**64 - 1), np.zeros(1, [("x", "f8")])))
    del group.attrs[name]
    if chance.random() < 0.9:
        group.attrs[name] = value
    return f"attribute {name} = {value!r}"


def write_strange_network(chance, path):
    """What was done, as a list; "!" begins what must be refused."""
    network = base(chance)
    parts = fields(network)
    done = [chance.choice(VALUES)(chance, parts) for _ in range(chance.choice((0, 1, 1, 2)))]
    with h5py.File(path, "w", libver=chance.choice(("earliest", "latest"))) as file:
        group = file.create_group("network")
        group.attrs["components"] = np.int32(network.components)
        group.attrs["period_x"] = chance.choice((0.0, 0.0, 2.0, 10.0, 11.5))
        for name, values in parts.items():
            group[name] = values
        if chance.random() < 0.6 or not done:
            change = chance.choice((attribute, attribute, *STRUCTURES))
            done.append(change_structure(chance, change, group, path.parent))
    return done
