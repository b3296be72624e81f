"""Takes arrays, numbers and texts out of HDF5 files. What is wrong is said in one line, with HDF5's or the system's reason.

    with open_file("crackle.h5") as file:
        load = array(file, "breaks/load", np.float64, 1)
"""
import contextlib

import h5py
import numpy as np

# What h5py and numpy raise for damaged files, ValueError aside.
_DAMAGED = (OSError, KeyError, RuntimeError, TypeError, AttributeError, IndexError, OverflowError, MemoryError,
            SystemError)


@contextlib.contextmanager
def open_file(path):
    """The file, to be read. Whatever is wrong with it, within the block too, becomes a ValueError of one line that
    begins with the path; FileNotFoundError stays what it is.
    """
    try:
        with h5py.File(path, "r") as file:
            yield file
    except FileNotFoundError:
        raise
    except ValueError as error:
        raise ValueError(f"{path}: {_one_line(error)}") from error
    except _DAMAGED as error:
        raise ValueError(f"{path}: HDF5 can't read it: {_one_line(error)}") from error


def _one_line(error):
    return " ".join(str(error.args[-1] if error.args else type(error).__name__).split())


def has(file, name):
    """Whether there is an object of that name, readable or not. Raises ValueError for a link to another file, which
    may be a pipe that never answers.
    """
    for part in name.split("/"):
        link = file.get(part, getlink=True) if isinstance(file, h5py.Group) and part in file.keys() else None
        if isinstance(link, h5py.ExternalLink):
            raise ValueError(f"/{name}: a link to {link.filename}; it must stand in the file itself")
        if link is None:
            return False
        file = file.get(part)
    return True


def array(file, name, kind, rank):
    """A dataset of numbers, all of which were written, as an array of `kind` with `rank` dimensions.

    Numbers of another size are taken if all of them fit. Raises ValueError.
    """
    item = _dataset(file, name)
    is_integer = np.issubdtype(kind, np.integer)
    if item.dtype.kind not in ("iu" if is_integer else "iuf"):
        raise ValueError(f"dataset {item.name}: {item.dtype}; allowed are {'integers' if is_integer else 'numbers'}")
    if item.ndim != rank:
        raise ValueError(f"dataset {item.name}: {item.ndim} dimensions; it must have {rank}")
    _check_written(item)
    try:
        values = item[...]
    except OSError as error:  # a checksum that doesn't fit, a filter that isn't there
        raise ValueError(f"dataset {item.name}: {_one_line(error)}") from error
    if is_integer and values.size:
        limits = np.iinfo(kind)
        if int(values.min()) < limits.min or int(values.max()) > limits.max:
            raise ValueError(f"dataset {item.name}: a number beyond {np.dtype(kind)}")
    return values.astype(kind, copy=False)


def _dataset(file, name):
    item = file.get(name) if has(file, name) else None
    if item is None:
        raise ValueError(f"dataset /{name}: missing")
    if not isinstance(item, h5py.Dataset):
        raise ValueError(f"dataset /{name}: it is a group")
    return item


def _check_written(item):
    """HDF5 gives zeros for what was never written, or stands in another file that is gone."""
    if item.size in (0, None):
        return
    if item.is_virtual or item.external:
        raise ValueError(f"dataset {item.name}: its data must stand in the file itself")
    if item.chunks:
        expected = np.prod([-(-extent // chunk) for extent, chunk in zip(item.shape, item.chunks)], dtype=object)
        whole = item.id.get_num_chunks() >= expected
    else:
        whole = item.id.get_storage_size() >= item.size * item.dtype.itemsize
    if not whole:
        raise ValueError(f"dataset {item.name}: its data was never written")


def same_length(arrays, length):
    """Raises ValueError unless each of the arrays, by name, has `length` rows."""
    for name, values in arrays.items():
        if len(values) != length:
            raise ValueError(f"dataset /{name}: {len(values)} rows; it must have {length}")


def number(where, name):
    """An attribute that is one number."""
    value = np.ravel(where.attrs[name]) if name in where.attrs else np.empty(0)
    if value.size != 1 or value.dtype.kind not in "iuf":
        raise ValueError(f"attribute {name} of {where.name}: it must be one number")
    return value[0].item()


def text(where, name):
    """An attribute that is a text, of fixed or variable length."""
    value = np.ravel(where.attrs[name])[0] if name in where.attrs else None
    if isinstance(value, bytes):
        try:
            return value.decode()
        except UnicodeDecodeError as error:
            raise ValueError(f"attribute {name} of {where.name}: no text in UTF-8") from error
    if not isinstance(value, str):
        raise ValueError(f"attribute {name} of {where.name}: it must be a text")
    return str(value)


def check_version(file, allowed):
    """Raises ValueError unless attribute schema_version is one of `allowed`."""
    version = number(file, "schema_version")
    if version not in allowed:
        raise ValueError(f"attribute schema_version: {version}; allowed are {', '.join(map(str, allowed))}")
    return int(version)


def read_options(file):
    """The attribute `options`, "-name value" a line; an option without a value gets an empty one."""
    options = {}
    for line in filter(None, map(str.strip, text(file, "options").splitlines())):
        name, _, value = line.partition(" ")
        options[name] = value.strip()
    return options
