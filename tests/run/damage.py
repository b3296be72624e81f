"""Files with damaged bytes, and what may come of using one: the reason in a line and status 1, or the same to the last bit.

Damage number n of a kind is the same everywhere: it follows from the kind's name and n alone, and from the file's bytes.
"""
import os
import pickle
import random
import select
import shutil
import signal
import time
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np
from crackle.files import read_comparison, read_run
from program import contents, execute, kill, start

SECONDS = 10         # no use of such small files may take longer
SUPERBLOCK = 96      # bytes at the start of a file that describe the file


def content(path):
    """All that a file says: datasets and attributes, as bytes. When it was made, and by what version, aside."""
    found = {}

    def keep(name, item):
        for key, value in item.attrs.items():
            if (name, key) not in (("/", "created"), ("/", "code_version")):
                found[f"{name} {key}"] = np.asarray(value).tobytes()
        if isinstance(item, h5py.Dataset):
            found[name] = (str(item.dtype), item.shape, item[...].tobytes())

    with h5py.File(path, "r") as file:
        keep("/", file)
        file.visititems(keep)
    return found


def plain(value):
    """What a reader of postprocess returns, as something that can be compared."""
    if isinstance(value, np.ndarray):
        return str(value.dtype), value.shape, value.tobytes()
    if isinstance(value, dict):
        return {key: plain(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    if hasattr(value, "__dataclass_fields__"):
        return {name: plain(getattr(value, name)) for name in value.__dataclass_fields__ if name != "path"}
    return repr(value)


def in_child(function, *arguments):
    """function(*arguments) in a forked process, since HDF5 may crash or hang in it: ("ended", value), ("raised", text of
    a ValueError), ("died", how).
    """
    receive, send = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(receive)
        try:
            answer = ("ended", function(*arguments))
        except ValueError as error:
            answer = ("raised", str(error))
        except BaseException as error:  # whatever it is, the parent tells
            answer = ("died", f"{type(error).__name__}: {error}")
        with os.fdopen(send, "wb") as pipe:
            pickle.dump(answer, pipe)
        os._exit(0)
    os.close(send)
    with os.fdopen(receive, "rb") as pipe:
        ready = select.select([pipe], [], [], SECONDS)[0]
        if not ready:
            os.kill(child, signal.SIGKILL)
        said = pipe.read()
    status = os.waitpid(child, 0)[1]
    if not ready:
        return "died", "it hangs"
    return pickle.loads(said) if said and status == 0 else ("died", f"status {status}")


@dataclass
class Use:
    """One way of using a file: a line of a program, or a reader."""
    name: str
    line: str = ""        # a command line; its output is `output`
    output: str = ""
    reader: object = None  # or a function of a path
    but: tuple = ()       # datasets of the output that differ from run to run


@dataclass
class Kind:
    """A file that crackle writes, and how it is used. The folder `whole` has it, with all that its uses need."""
    name: str
    file: str
    uses: list
    lines: list             # command lines that make the folder
    whole: Path = None      # set by make()
    expected: dict = field(default_factory=dict)

    def make(self, folder):
        """Makes the folder, uses everything once, undamaged."""
        self.whole = Path(folder)
        self.whole.mkdir()
        for line in self.lines:
            if callable(line):
                line(self.whole)
                continue
            result = execute(self.whole, line)
            assert result.returncode == 0, f"{line}: {result.stderr}"
        for use in self.uses:
            verdict, what = self.use(use, self.whole / self.file, self.whole.parent / "used")
            assert verdict == "right", f"{self.name}, {use.name}: {verdict}: {what}"
        return self

    def use(self, use, damaged, scratch):
        """The verdict on `use` of this kind with the file `damaged` in its place, and what was said."""
        if use.reader:
            return self._read(use, damaged)
        shutil.rmtree(scratch, ignore_errors=True)
        shutil.copytree(self.whole, scratch)
        if damaged != self.whole / self.file:
            shutil.copyfile(damaged, scratch / self.file)
        before = contents(scratch)
        result = execute(scratch, use.line, seconds=SECONDS)
        if result.returncode not in (0, 1):
            verdict = "hangs" if result.returncode is None else "crash"
            return verdict, f"status {result.returncode}: {result.stderr[:500]}"
        if result.returncode == 1:
            return self._refusal(use, result.stderr, before, contents(scratch))
        read, found = in_child(content, scratch / use.output)
        if read != "ended":
            return "silent", f"an output that can't be read: {found}"
        for name in use.but:
            found.pop(name, None)
        expected = self.expected.setdefault(use.name, found)
        differing = [name for name in expected.keys() | found.keys() if expected.get(name) != found.get(name)]
        return ("right", "") if not differing else ("silent", f"other {', '.join(sorted(map(str, differing)))}")

    def _refusal(self, use, said, before, after):
        program = use.line.split()[0]
        if said.count("\n") != 1 or not said.startswith(f"{program}: "):
            return "not one line", said
        if Path(self.file).name not in said and "-resume of run.h5" not in said:
            return "names no file", said
        return ("refused", said) if before == after else ("touched", said)

    def _read(self, use, damaged):
        verdict, what = in_child(lambda: plain(use.reader(damaged)))
        if verdict == "died":
            return "crash", what
        if verdict == "raised":
            good = "\n" not in what and damaged.name in what
            return "refused" if good else "not one line", what
        expected = self.expected.setdefault(use.name, what)
        differing = [name for name in expected if expected[name] != what.get(name)]
        return ("right", "") if not differing else ("silent", f"other {', '.join(differing)}")


GOOD = ("right", "refused")  # verdicts


def data_ranges(path):
    """Begin and end of every piece of data in a file; the rest is metadata."""
    ranges = []

    def keep(_, item):
        if not isinstance(item, h5py.Dataset):
            return
        if item.id.get_offset() is not None:
            ranges.append((item.id.get_offset(), item.id.get_offset() + item.id.get_storage_size()))
        if item.chunks:
            for i in range(item.id.get_num_chunks()):
                chunk = item.id.get_chunk_info(i)
                ranges.append((chunk.byte_offset, chunk.byte_offset + chunk.size))

    with h5py.File(path, "r") as file:
        file.visititems(keep)
    return [(begin, end) for begin, end in ranges if end > begin]


def places(path):
    """Of each part of a file - superblock, metadata, data - the places of its bytes."""
    is_data = np.zeros(path.stat().st_size, bool)
    for begin, end in data_ranges(path):
        is_data[begin:end] = True
    metadata = np.flatnonzero(~is_data)
    written = np.frombuffer(path.read_bytes(), np.uint8)
    # most of what is neither data nor zero describes something; zeros are seldom used
    used = metadata[(written[metadata] != 0) & (metadata >= SUPERBLOCK)]
    return [np.arange(min(SUPERBLOCK, len(is_data))), used, metadata, np.flatnonzero(is_data)]


def flip(chance, data, place):
    data[place] ^= 1 << chance.randrange(8)


def overwrite(chance, data, place):
    length = chance.choice((1, 2, 4, 8, 8, 64, 512))
    data[place:place + length] = chance.randbytes(len(data[place:place + length]))


def fill(chance, data, place):
    length = chance.choice((1, 4, 8, 64, 512, 4096))
    data[place:place + length] = bytes([chance.choice((0, 0, 255))]) * len(data[place:place + length])


def swap(chance, data, place):
    length = chance.choice((1, 4, 8, 64))
    other = chance.randrange(len(data))
    one, two = data[place:place + length], data[other:other + length]
    if len(one) == len(two):
        data[place:place + length], data[other:other + length] = two, one


def truncate(chance, data, place):
    del data[place:]


def append(chance, data, place):
    data += chance.randbytes(chance.choice((1, 100, 5000)))


def remove(chance, data, place):
    del data[place:place + chance.choice((1, 4, 8, 512))]


def insert(chance, data, place):
    data[place:place] = chance.randbytes(chance.choice((1, 4, 8, 512)))


def invert_zeros(chance, data, place):
    """Sums modulo 65535, as Fletcher's, don't change."""
    at = data.find(bytes(2), place)
    if at >= 0:
        data[at:at + 2] = b"\xff\xff"


WAYS = (flip, flip, flip, overwrite, overwrite, fill, fill, invert_zeros, swap, truncate, append, remove, insert)


def damage(path, name, number):
    """The bytes of `path` with damage `number`, and in a few words what was done."""
    chance = random.Random(f"{name} {number}")
    parts = places(path)
    part = chance.choice([part for part in parts if len(part)])
    place = int(part[chance.randrange(len(part))])
    way = chance.choice(WAYS)
    data = bytearray(path.read_bytes())
    way(chance, data, place)
    return bytes(data), f"{way.__name__} at {place}"


RECORDED = "-lattice_size 4 -record breaks,profile,snapshot,network -record_snapshot_at 1,4 -monitor none"
RUN = f"crackle {RECORDED} -output run.h5"
BEGUN = ("crackle -lattice_size 32 -checkpoint_breaks 20 -record breaks,profile -monitor none -output run.h5")
FROM_FILE = "crackle -lattice file -lattice_file network.h5 -disorder file -monitor none -record breaks,network"
OPTIONS = Path(__file__).resolve().parents[2] / "options"
TIMED = ("samples/wall_time",)


def leave_a_shard(folder):
    """As of a run that was killed before its samples were put together."""
    (folder / "run.h5.shards").mkdir()
    (folder / "run.h5").rename(folder / "run.h5.shards/0.h5")


def leave_a_checkpoint(folder):
    """Of a run that was killed in the middle of its sample; verifying every break slows it."""
    process = start(folder, f"{BEGUN.removeprefix('crackle ')} -checkpoint_every 0 -equilibrium_tree_verify")
    while not (folder / "run.h5.shards/0.checkpoint").exists():
        assert process.poll() is None, f"the run ended too early: {process.communicate()[1]}"
        time.sleep(0.002)
    kill(process)


def kinds():
    """Of every file that crackle writes: how to make one, and every way of using it."""
    merge, read = "crackle_merge run.h5 -output merged.h5", Use("read", reader=read_run)
    resume = Use("resume", f"{RUN} -samples 3 -resume", "run.h5", but=TIMED)
    compare = (f"crackle_compare -lattice_size 4 -compare {OPTIONS}/solver/tree.opts,{OPTIONS}/solver/dense.opts "
               "-compare_repetitions 1 -monitor none -output compare.h5")
    return [
        Kind("network", "network.h5", [Use("break", f"{FROM_FILE} -output run.h5", "run.h5", but=TIMED)],
             ["crackle -lattice_size 4 -record network -monitor none -output network.h5"]),
        Kind("run", "run.h5", [Use("merge", merge, "merged.h5"), resume, read], [f"{RUN} -samples 2"]),
        Kind("shard", "run.h5.shards/0.h5", [Use("merge", merge, "merged.h5"), resume, read],
             [f"{RUN} -samples 2", leave_a_shard]),
        Kind("checkpoint", "run.h5.shards/0.checkpoint", [Use("resume", f"{BEGUN} -resume", "run.h5", but=TIMED)],
             [leave_a_checkpoint]),
        Kind("comparison", "compare.h5", [Use("read", reader=read_comparison)], [compare]),
    ]


def damaged_uses(kind, number, folder):
    """Damages kind's file, uses it in every way: (use, what was done, verdict, what was said)."""
    folder = Path(folder)
    data, how = damage(kind.whole / kind.file, kind.name, number)
    damaged = folder / Path(kind.file).name
    damaged.write_bytes(data)
    for use in kind.uses:
        verdict, said = kind.use(use, damaged, folder / "used")
        yield use.name, how, verdict, said
