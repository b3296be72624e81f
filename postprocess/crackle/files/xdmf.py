"""Exports a sample for ParaView: how its bonds break, step by step, as XDMF (with its data in HDF5 beside it).

Every bond is a line of its own, from its first node to the nearest image in x of its second. A step is the
network when `time` bonds have broken. Cells carry: state (0 intact, 1 broken up to the peak load, 2 broken after
it), break_number (from 1; 0: never broke) and break_load. With -record snapshot the steps are those of the run's
snapshots, with the bonds' force and the points' displacement; warp by it to see the network deformed.
In ParaView: open with the Xdmf3 reader, colour by state, or threshold state at 0 to remove what is broken.
"""
import os
from xml.etree import ElementTree

import h5py
import numpy as np

STEPS = 50


def bond_histories(network, breaks):
    """break_number int32[M] and break_load float64[M] of every bond."""
    number = np.zeros(len(network.bonds), dtype=np.int32)
    load = np.zeros(len(network.bonds))
    number[breaks.bond] = np.arange(1, len(breaks.bond) + 1)
    load[breaks.bond] = breaks.load
    return number, load


def state_at(number, broken, peak):
    """int8[M] once `broken` bonds have broken: 0 intact, 1 broken up to and with break `peak`, 2 after it."""
    is_broken = (number > 0) & (number <= broken)
    return np.where(is_broken, np.where(number <= peak, 1, 2), 0).astype(np.int8)


def displacements_of_ends(network, displacement):
    """float64[2M, 3] at both ends of every bond. A fuse network's voltage stands in the third component."""
    values = displacement.reshape(len(network.positions), network.components)
    ends = np.zeros((2 * len(network.bonds), 3))
    columns = slice(0, 2) if network.components == 2 else slice(2, 3)
    ends[:, columns] = values[network.bonds.ravel()]
    return ends


def write_data(path, run, s, steps):
    """Everything into the HDF5 file; returns a list of (broken bonds, {attribute: (dataset, centre)}) by step."""
    network, breaks, peak = run.network(), run.breaks(s), int(run.n_p[s])
    ends = network.segments().reshape(-1, 2)
    number, load = bond_histories(network, breaks)
    snapshots = run.snapshots(s)
    times = [snapshot.number - 1 for snapshot in snapshots] or \
        np.unique(np.append(np.linspace(0, len(breaks.bond), steps).round(), peak)).astype(int).tolist()
    with h5py.File(path, "w") as file:
        file["points"] = np.hstack([ends, np.zeros((len(ends), 1))])
        file["lines"] = np.arange(len(ends), dtype=np.int32).reshape(-1, 2)
        file["break_number"], file["break_load"] = number, load
        found = []
        for k, broken in enumerate(times):
            file[f"state/{k}"] = state_at(number, broken, peak)
            attributes = {"state": (file[f"state/{k}"], "Cell"), "break_number": (file["break_number"], "Cell"),
                          "break_load": (file["break_load"], "Cell")}
            if snapshots:
                file[f"force/{k}"] = snapshots[k].force
                file[f"displacement/{k}"] = displacements_of_ends(network, snapshots[k].displacement)
                attributes["force"] = (file[f"force/{k}"], "Cell")
                attributes["displacement"] = (file[f"displacement/{k}"], "Node")
            found.append((broken, {name: (_describe(data), centre) for name, (data, centre) in attributes.items()}))
        return found, {name: _describe(file[name]) for name in ("points", "lines")}


def _describe(dataset):
    """What XDMF must know of a dataset: its place, shape, kind and bytes."""
    kind = {"f": "Float", "i": "Char" if dataset.dtype.itemsize == 1 else "Int"}[dataset.dtype.kind]
    return dataset.name, dataset.shape, kind, dataset.dtype.itemsize


def _data_item(parent, file_name, description):
    name, shape, kind, size = description
    item = ElementTree.SubElement(parent, "DataItem", Format="HDF", NumberType=kind, Precision=str(size),
                                  Dimensions=" ".join(map(str, shape)))
    item.text = f"{file_name}:{name}"


def write_xdmf(path, data_name, steps, mesh):
    """The description of all steps, a temporal collection of grids."""
    root = ElementTree.Element("Xdmf", Version="3.0")
    series = ElementTree.SubElement(ElementTree.SubElement(root, "Domain"), "Grid", Name="crack",
                                    GridType="Collection", CollectionType="Temporal")
    for broken, attributes in steps:
        grid = ElementTree.SubElement(series, "Grid", Name=f"{broken} broken", GridType="Uniform")
        ElementTree.SubElement(grid, "Time", Value=str(broken))
        topology = ElementTree.SubElement(grid, "Topology", TopologyType="Polyline", NodesPerElement="2",
                                          NumberOfElements=str(mesh["lines"][1][0]))
        _data_item(topology, data_name, mesh["lines"])
        _data_item(ElementTree.SubElement(grid, "Geometry", GeometryType="XYZ"), data_name, mesh["points"])
        for name, (description, centre) in attributes.items():
            kind = "Vector" if centre == "Node" else "Scalar"
            attribute = ElementTree.SubElement(grid, "Attribute", Name=name, AttributeType=kind, Center=centre)
            _data_item(attribute, data_name, description)
    ElementTree.indent(root)
    ElementTree.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)


def export(run, s, path, steps=STEPS):
    """Writes PATH (.xdmf) and its data beside it (_data.h5)."""
    if run.network() is None:
        raise ValueError(f"{run.path}: no /network (run with -record network)")
    data = os.path.splitext(path)[0] + "_data.h5"
    write_xdmf(path, os.path.basename(data), *write_data(data, run, s, steps))
