"""-equilibrium_tree_kernels: every instruction set breaks the same bonds; last bits are not mixed in silence."""
import re
from pathlib import Path

import pytest
from program import (OUTPUT, assert_same, assert_same_breaks, break_samples, datasets, options_of, refuse,
                     run, succeed)
from test_merge import merge

NAME = "-equilibrium_tree_kernels"
SCENE = "-lattice_size 12 -samples 3 -monitor none"


def kernels_here():
    """What this processor has, by the refusal of another: the fastest first."""
    said = run(Path("/tmp"), f"-lattice_size 1 {NAME} none").stderr
    return re.search(r"allowed is auto, (.*) \(what this processor has\)", said).group(1).split(", ")


def test_the_fastest_is_the_default_and_stands_in_the_file_by_its_name(tmp_path):
    result = succeed(tmp_path, f"{SCENE} -equilibrium_tree_view")
    fastest = kernels_here()[0]
    assert options_of(tmp_path / OUTPUT)[NAME] == fastest
    assert f"{NAME} {fastest}\n" in result.stdout and f"{fastest} kernels" in result.stdout
    named = break_samples(tmp_path, f"{SCENE} {NAME} {fastest}", "named.h5")
    assert_same(named, datasets(tmp_path / OUTPUT))


@pytest.mark.parametrize("more", ["", "-model fuse", "-break_on tension", "-grips clamped"])
def test_every_kernel_breaks_the_same_bonds(tmp_path, more):
    """As LAPACK does: loads to rounding."""
    expected = break_samples(tmp_path, f"{SCENE} {more} -equilibrium dense", "dense.h5")
    assert kernels_here()[-1] == "plain"
    for kernels in kernels_here():
        result = succeed(tmp_path, f"{SCENE} {more} {NAME} {kernels} -equilibrium_tree_view -overwrite")
        assert f"{kernels} kernels" in result.stdout
        assert options_of(tmp_path / OUTPUT)[NAME] == kernels
        found = datasets(tmp_path / OUTPUT)
        for sample in range(3):
            assert_same_breaks(breaks_of(found, sample), breaks_of(expected, sample))


def breaks_of(found, sample):
    begin, end = found["/samples/break_offset"][sample:sample + 2]
    return {name: found[name][begin:end] for name in ("/breaks/bond", "/breaks/load", "/breaks/stiffness")}


def test_kernels_that_the_processor_does_not_have_are_refused_by_name(tmp_path):
    for kernels in {"avx512", "avx2"} - set(kernels_here()):
        refuse(tmp_path, f"-lattice_size 3 {NAME} {kernels}", NAME, kernels, *kernels_here())


def test_a_run_goes_on_with_its_own_kernels_alone(tmp_path):
    """So that the file is what one run would have left, bit for bit. An older file doesn't say."""
    fastest, plain = kernels_here()[0], "plain"
    whole = break_samples(tmp_path, f"{SCENE} {NAME} {plain}", "whole.h5")
    break_samples(tmp_path, f"-lattice_size 12 -samples 1 {NAME} {plain}")
    if fastest != plain:
        refuse(tmp_path, f"{SCENE} -resume", "-resume", f"{NAME} {fastest}", f"the file has {plain}", output=None)
    assert_same(break_samples(tmp_path, f"{SCENE} {NAME} {plain} -resume"), whole)


def test_parts_of_different_kernels_are_not_merged_in_silence(tmp_path):
    fastest = kernels_here()[0]
    if fastest == "plain":
        pytest.skip("a processor of one kind of kernels")
    break_samples(tmp_path, "-lattice_size 4", "0.h5")
    break_samples(tmp_path, f"-lattice_size 4 -first_sample 1 {NAME} plain", "1.h5")
    result = merge(tmp_path, "0.h5", "1.h5", "-output", "all.h5")
    assert result.returncode == 1 and result.stderr.count("\n") == 1
    assert all(word in result.stderr for word in (NAME, fastest, "plain", "1.h5")), result.stderr
    assert not (tmp_path / "all.h5").exists()


def test_flags_are_echoed_and_stored(tmp_path):
    result = succeed(tmp_path, "-lattice_size 3 -equilibrium_tree_verify -monitor none")
    options = options_of(tmp_path / OUTPUT)
    for name, value in (("verify", "true"), ("view", "false")):
        assert options[f"-equilibrium_tree_{name}"] == value
        assert f"-equilibrium_tree_{name} {value}\n" in result.stdout
    assert options["-resume"] == options["-overwrite"] == "false"
