"""Network files as nobody would write them, or only somebody whose script has a fault: values, shapes, types, links."""
import os

import h5py
import numpy as np
from networks import irregular_network, small_network

NUMBERS = (0.0, -0.0, 1.0, -1.0, np.nan, np.inf, -np.inf, 1e-320, 5e-324, 1e-170, 1e-16, 1e16, 1e170, 1e300, -1e300,
           1.7976931348623157e308)
INTEGERS = (0, 1, -1, 2, 3, 5, 6, 127, -128, 2**31 - 1, -2**31, 2**31, 2**32, 2**63 - 1, -2**63)
DATASETS = ("nodes/position", "nodes/grip", "bonds/nodes", "bonds/stiffness", "bonds/threshold")
TYPES = ("f2", "f4", ">f8", "g", "i1", "i2", ">i4", "i8", "u1", "u2", "u4", "u8", "?", "c16", "S8", "V8")


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


# Structure: each takes (chance, group, name, folder), group the open /network with a dataset `name`, and tells what it
# did; what begins with "!" must be refused, whatever else is done.

def another_type(chance, group, name, _):
    kind = chance.choice(TYPES)
    values = group[name][...]
    del group[name]
    with np.errstate(all="ignore"):
        group[name] = np.zeros(len(values), kind) if kind == "V8" else values.astype(kind)
    return f"{name} of type {kind}"


def a_text(chance, group, name, _):
    del group[name]
    group.create_dataset(name, data=["a", "text"], dtype=h5py.string_dtype(length=chance.choice((None, 4))))
    return f"!{name} of texts"


def compound(chance, group, name, _):
    rows = len(group[name])
    del group[name]
    group[name] = np.zeros(rows, [("x", "f8"), ("y", "f8")][:chance.choice((1, 2))])
    return f"!{name} compound"


def special_type(chance, group, name, _):
    rows = len(group[name])
    del group[name]
    kind = chance.choice((h5py.ref_dtype, h5py.vlen_dtype(np.float64), h5py.enum_dtype({"a": 0, "b": 1}),
                          np.dtype((np.float64, (2,)))))
    group.create_dataset(name, (rows,), kind)
    return f"!{name} of type {kind}"


def another_shape(chance, group, name, _):
    values = group[name][...]
    del group[name]
    way = chance.choice(("ravel", "row", "column", "transpose", "none", "scalar", "null", "deep"))
    group[name] = {"ravel": values.ravel(), "row": values[None], "column": values[..., None], "transpose": values.T,
                   "none": values[:0], "scalar": values.flat[0], "null": h5py.Empty(values.dtype),
                   "deep": values.reshape((1,) * 20 + values.shape)}[way]
    return f"{name} {way}"


def another_storage(chance, group, name, _):
    """The same values: nothing is wrong with them."""
    values = group[name][...]
    del group[name]
    how = chance.choice(({"compression": "gzip"}, {"compression": "lzf"}, {"fletcher32": True}, {"shuffle": True},
                         {"maxshape": (None,) * values.ndim}, {"chunks": (1,) * values.ndim}))
    group.create_dataset(name, data=values, **how)
    return f"{name} {how}"


def never_written(chance, group, name, _):
    shape, kind = group[name].shape, group[name].dtype
    del group[name]
    group.create_dataset(name, shape, kind, chunks=chance.choice((None, True)))
    return f"!{name} never written"


def partly_written(_, group, name, __):
    values = group[name][...]
    del group[name]
    chunks = (max(1, len(values) // 3), *values.shape[1:])
    data = group.create_dataset(name, values.shape, values.dtype, chunks=chunks)
    data[:chunks[0]] = values[:chunks[0]]
    return f"!{name} partly written"


def claimed_size(chance, group, name, _):
    """Of which nothing is there."""
    tail = group[name].shape[1:]
    kind = group[name].dtype
    rows = chance.choice((10**7, 10**9, 2**31, 2**40))
    del group[name]
    group.create_dataset(name, (rows, *tail), kind, chunks=chance.choice((None, (1024, *tail))))
    return f"!{name} of {rows} rows"


def link_to_itself(_, group, name, __):
    del group[name]
    group[name] = h5py.SoftLink(f"/network/{name}")
    return f"!{name} a link to itself"


def link_to_nothing(chance, group, name, _):
    del group[name]
    group[name] = h5py.SoftLink(chance.choice(("/nothing", "/network/nodes", "/", "..")))
    return f"!{name} a link to no dataset"


def link_outside(chance, group, name, folder):
    """To a pipe, a folder, a device, nothing: or to a whole file, which is good."""
    target = chance.choice(("pipe", "folder", "/dev/zero", "/dev/null", "missing.h5", "text"))
    os.mkfifo(folder / "pipe")
    (folder / "folder").mkdir()
    (folder / "text").write_text("text\n")
    del group[name]
    group[name] = h5py.ExternalLink(target, f"/network/{name}")
    return f"!{name} links to {target}"


def link_to_another(chance, group, name, _):
    other = chance.choice([one for one in DATASETS if one != name])
    del group[name]
    group[name] = chance.choice((h5py.SoftLink(f"/network/{other}"), group[other]))
    return f"{name} is {other}"


def virtual(chance, group, name, folder):
    """The source is missing, too short, or a pipe."""
    shape, kind = group[name].shape, group[name].dtype
    source = chance.choice(("missing.h5", "short.h5", "virtual_pipe", "."))
    if source == "short.h5":
        with h5py.File(folder / source, "w") as file:
            file["data"] = np.ones((1, *shape[1:]), kind)
    if source == "virtual_pipe":
        os.mkfifo(folder / source)
    layout = h5py.VirtualLayout(shape, kind)
    layout[...] = h5py.VirtualSource(source, "data", shape)
    del group[name]
    group.create_virtual_dataset(name, layout)
    return f"!{name} virtual, of {source}"


def raw_outside(chance, group, name, folder):
    shape, kind = group[name].shape, group[name].dtype
    source = chance.choice(("missing.raw", "short.raw", "raw_pipe", "/dev/zero"))
    if source == "short.raw":
        (folder / source).write_bytes(b"\1" * 8)
    if source == "raw_pipe":
        os.mkfifo(folder / source)
    del group[name]
    group.create_dataset(name, shape, kind, external=[(source, 0, h5py.h5f.UNLIMITED)])
    return f"!{name} external, in {source}"


def missing(_, group, name, __):
    """Stiffness and threshold may be."""
    del group[name]
    return f"{name} missing"


def a_group(_, group, name, __):
    del group[name]
    group.create_group(name)
    return f"!{name} a group"


def attribute(chance, group, _, __):
    name = chance.choice(("components", "period_x"))
    value = chance.choice((*NUMBERS, *INTEGERS[:-1], "text", b"text", [1, 2], [], 1.5, np.float32(2),
                           h5py.Empty("f8"), np.bool_(True), 2j, np.uint64(2**64 - 1), np.zeros(1, [("x", "f8")])))
    del group.attrs[name]
    if chance.random() < 0.9:
        group.attrs[name] = value
    return f"attribute {name} = {value!r}"


STRUCTURES = (another_type, another_type, a_text, compound, special_type, another_shape, another_shape, another_storage,
              never_written, partly_written, claimed_size, link_to_itself, link_to_nothing, link_outside,
              link_to_another, virtual, raw_outside, missing, a_group, attribute, attribute)


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
            structure, name = chance.choice(STRUCTURES), chance.choice(DATASETS)
            done.append(structure(chance, group, name, path.parent))
    return done
