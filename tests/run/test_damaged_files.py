"""Files with damaged bytes: refused with the reason, or used with the same results to the last bit. Files with values
that can't be: refused.

study_damaged_files.py tries a thousand of each kind; here are some of them.
"""
from pathlib import Path

import pytest
from damage import GOOD, damaged_uses, kinds
from value_faults import CHECKPOINT_FAULTS, FAULTS, write_with_fault

NUMBERS = {"network": 60, "run": 50, "shard": 50, "checkpoint": 40, "comparison": 300}


@pytest.fixture(name="whole", scope="module")
def fixture_whole(tmp_path_factory):
    """Kinds of files by name."""
    folder = tmp_path_factory.mktemp("damaged")
    return {kind.name: kind.make(folder / kind.name) for kind in kinds()}


@pytest.mark.parametrize("name", NUMBERS)
def test_damaged_bytes(whole, tmp_path, name):
    refused = 0
    faults = []
    for number in range(NUMBERS[name]):
        for use, how, verdict, said in damaged_uses(whole[name], number, tmp_path):
            refused += verdict == "refused"
            if verdict not in GOOD:
                faults.append(f"{name} {number}, {use}: {how}: {verdict}: {said}")
    assert not faults, f"{len(faults)}: " + "\n".join(faults)
    assert refused > NUMBERS[name] / 4, "hardly anything was damaged"


def refuse_fault(kind, name, folder):
    damaged = folder / Path(kind.file).name
    write_with_fault(kind.whole / kind.file, damaged, name)
    for use in kind.uses:
        verdict, said = kind.use(use, damaged, folder / "used")
        assert verdict == "refused" and FAULTS[name][1] in said, f"{use.name}: {verdict}: {said}"


@pytest.mark.parametrize("name", FAULTS)
def test_values_that_can_not_be(whole, tmp_path, name):
    """Merging, -resume and Python refuse them in a run file."""
    refuse_fault(whole["run"], name, tmp_path)


@pytest.mark.parametrize("name", CHECKPOINT_FAULTS)
def test_values_of_a_checkpoint_that_can_not_be(whole, tmp_path, name):
    refuse_fault(whole["checkpoint"], name, tmp_path)
