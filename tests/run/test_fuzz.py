"""Some hundred strange inputs, always the same ones; fuzz.py tries others for as long as it is asked to."""
import pytest
from fuzz import FAMILIES, examine

SEED = 1
CASES = {"damage": 30, "runs": 40, "networks": 120, "options": 60, "words": 70}


@pytest.mark.parametrize("family", FAMILIES)
def test_strange_input(tmp_path, family):
    """No crash, no hang, nothing used in silence, nothing touched, one line of complaint."""
    faults = [fault for number in range(CASES[family])
              for fault in examine(family, SEED, number, tmp_path / str(number))]
    assert not faults, f"{len(faults)}:\n" + "\n".join(map(str, faults))
