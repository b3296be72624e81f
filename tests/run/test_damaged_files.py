"""Files with damaged bytes: refused with the reason, or used with the same results to the last bit.

study_damaged_files.py tries a thousand of each kind; here are some of them.
"""
from pathlib import Path

import pytest
from damage import GOOD, damaged_uses, kinds

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
