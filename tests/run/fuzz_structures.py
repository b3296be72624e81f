"""HDF5 files built as crackle doesn't build them: other types, shapes, storage and links, data that isn't there.

Each change takes (chance, group, name, folder), with a dataset `name` below the open group, and tells what it did. What
begins with "!" must be refused, whatever else is done.
"""
import os

import h5py
import numpy as np

TYPES = ("f2", "f4", ">f8", "g", "i1", "i2", ">i4", "i8", "u1", "u2", "u4", "u8", "?", "c16", "S8", "V8")


def datasets_of(group):
    """Names of all datasets below a group."""
    names = []
    group.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
    return names


def change_structure(chance, change, group, folder):
    """The change, of one of the datasets; what was done."""
    return change(chance, group, chance.choice(datasets_of(group)), folder)


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
    group[name] = h5py.SoftLink(f"{group.name.rstrip('/')}/{name}")
    return f"!{name} a link to itself"


def link_to_nothing(chance, group, name, _):
    del group[name]
    group[name] = h5py.SoftLink(chance.choice(("/nothing", "/", "..")))
    return f"!{name} a link to no dataset"


def link_outside(chance, group, name, folder):
    """To a pipe, a folder, a device, nothing, a text."""
    target = chance.choice(("pipe", "folder", "/dev/zero", "/dev/null", "missing.h5", "text"))
    os.mkfifo(folder / "pipe")
    (folder / "folder").mkdir()
    (folder / "text").write_text("text\n")
    del group[name]
    group[name] = h5py.ExternalLink(folder / target, f"{group.name}/{name}")
    return f"!{name} links to {target}"


def link_to_another(chance, group, name, _):
    other = chance.choice([one for one in datasets_of(group) if one != name])
    del group[name]
    group[name] = chance.choice((h5py.SoftLink(group[other].name), group[other]))
    return f"{name} is {other}"


def virtual(chance, group, name, folder):
    """The source is missing, too short, or a pipe."""
    shape, kind = group[name].shape, group[name].dtype
    source = folder / chance.choice(("missing.h5", "short.h5", "virtual_pipe", "."))
    if source.name == "short.h5":
        with h5py.File(source, "w") as file:
            file["data"] = np.ones((1, *shape[1:]), kind)
    if source.name == "virtual_pipe":
        os.mkfifo(source)
    layout = h5py.VirtualLayout(shape, kind)
    layout[...] = h5py.VirtualSource(str(source), "data", shape)
    del group[name]
    group.create_virtual_dataset(name, layout)
    return f"!{name} virtual, of {source.name}"


def raw_outside(chance, group, name, folder):
    shape, kind = group[name].shape, group[name].dtype
    source = folder / chance.choice(("missing.raw", "short.raw", "raw_pipe", "/dev/zero"))
    if source.name == "short.raw":
        source.write_bytes(b"\1" * 8)
    if source.name == "raw_pipe":
        os.mkfifo(source)
    del group[name]
    group.create_dataset(name, shape, kind, external=[(str(source), 0, h5py.h5f.UNLIMITED)])
    return f"!{name} external, in {source.name}"


def missing(_, group, name, __):
    """Stiffness and threshold may be."""
    del group[name]
    return f"{name} missing"


def a_group(_, group, name, __):
    del group[name]
    group.create_group(name)
    return f"!{name} a group"


STRUCTURES = (another_type, another_type, a_text, compound, special_type, another_shape, another_shape, another_storage,
              never_written, partly_written, claimed_size, link_to_itself, link_to_nothing, link_outside,
              link_to_another, virtual, raw_outside, missing, a_group)
