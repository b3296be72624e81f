"""-equilibrium quad where doubles end: bonds and loads are those of 80 digits.

exact_breaks.json holds command lines and what an elimination in 80 decimal digits (mpmath) breaks of those networks,
until F is below 1e-24 of the intact one.
"""
import json
import shlex
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from crackle.files import read_comparison
from networks import BOTTOM, FREE, TOP, NetworkOfFile
from program import OUTPUT, PROGRAMS, assert_same, break_samples, environment, kill, refuse, run, start

PROJECT = Path(__file__).resolve().parents[2]
COMPARE = PROGRAMS["crackle_compare"]
SCENES = json.loads(Path(__file__).with_name("exact_breaks.json").read_text(encoding="utf-8"))
OF_FILE = "-lattice file -lattice_file network.h5 -disorder file -model fuse -equilibrium quad"


@pytest.mark.parametrize("line", SCENES)
def test_breaks_are_those_of_eighty_digits(tmp_path, line):
    exact = SCENES[line]
    found = break_samples(tmp_path, f"{line.replace('options/', f'{PROJECT}/options/')} -equilibrium quad")
    assert found["/breaks/bond"].tolist() == exact["bond"]
    np.testing.assert_allclose(found["/breaks/load"], exact["load"], rtol=1e-12)
    np.testing.assert_allclose(found["/breaks/stiffness"], exact["stiffness"], rtol=1e-12)


def chain(stiffness, threshold):
    """Fuses one above the other."""
    n = len(stiffness)
    position = np.array([[0, i] for i in range(n + 1)], float)
    grip = np.array([BOTTOM, *[FREE] * (n - 1), TOP], np.int8)
    nodes = np.array([[i, i + 1] for i in range(n)], np.int32)
    return NetworkOfFile(position, grip, nodes, np.array(stiffness), np.array(threshold), components=1)


@pytest.mark.parametrize("contrast", [1e12, 1e15, 1e20])
def test_stiff_link_of_a_chain_breaks_where_it_is_the_weakest(tmp_path, contrast):
    chain([contrast, 1], [0.1, 1]).write(tmp_path / "network.h5")
    found = break_samples(tmp_path, f"{OF_FILE} -record breaks,snapshot -record_snapshot_at 1")
    assert found["/breaks/bond"].tolist() == [0]
    assert found["/breaks/load"][0] == pytest.approx(0.1, rel=1e-13)
    # which displacements in double can't tell
    np.testing.assert_allclose(found["/snapshots/force"], [[0.1, 0.1]], rtol=1e-13)


def test_stiff_links_at_the_plate(tmp_path):
    """Three columns of fuses and cross links; the topmost are 1e16 times stiffer."""
    width, height = 3, 3
    position = np.array([[x, y] for y in range(height + 1) for x in range(width)], float)
    grip = np.repeat([BOTTOM, FREE, FREE, TOP], width).astype(np.int8)
    nodes, stiffness = [], []
    for y in range(height + 1):
        for x in range(width):
            if 0 < y < height:
                nodes.append([y * width + x, y * width + (x + 1) % width])
                stiffness.append(1)
            if y < height:
                nodes.append([y * width + x, (y + 1) * width + x])
                stiffness.append(1e16 if y == height - 1 else 1)
    threshold = np.random.default_rng(0).random(len(nodes)) + 0.01
    NetworkOfFile(position, grip, np.array(nodes, np.int32), np.array(stiffness, float), threshold, components=1,
                  period_x=3.0).write(tmp_path / "network.h5")
    found = break_samples(tmp_path, OF_FILE)
    assert found["/breaks/bond"].tolist() == [2, 1, 3, 0]
    np.testing.assert_allclose(found["/breaks/load"], [0.15292057180858407, 0.55957342752774064, 0.10611054211411638,
                                                       0.64696168732145432], rtol=1e-13)


def test_comparing_finds_forces_right_where_stiffnesses_span_twelve_decades(tmp_path):
    line = (f"-options_file {PROJECT}/options/extreme/inclusion_1e12.opts -compare {PROJECT}/options/solver/quad.opts "
            "-compare_repetitions 1 -monitor none -output compare.h5")
    done = subprocess.run([COMPARE, *shlex.split(line)], cwd=tmp_path, env=environment(), text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=False)
    assert done.returncode == 0, done.stderr
    comparison = read_comparison(tmp_path / "compare.h5")
    strategy, = comparison.strategies
    assert strategy.first_difference == 0 and strategy.attributes["complaint"] == ""
    assert np.max(strategy.series["force_error"]) < 1e-14


def test_what_even_113_bits_can_not_tell_is_said(tmp_path):
    result = run(tmp_path, "-lattice_size 6 -stiffness inclusion -stiffness_contrast 1e60 -equilibrium quad "
                           "-monitor none")
    assert result.returncode == 1 and result.stderr.count("\n") == 1
    assert "113 bits" in result.stderr and "stiffnesses" in result.stderr


def test_sample_killed_in_the_middle_goes_on_bit_for_bit(tmp_path):
    line = "-lattice_size 20 -equilibrium quad -checkpoint_breaks 30 -checkpoint_every 0 -monitor none"
    whole = break_samples(tmp_path, line, "whole.h5")
    process = start(tmp_path, line)
    kept = tmp_path / f"{OUTPUT}.shards" / "0.checkpoint"
    while not kept.exists():
        assert process.poll() is None, process.communicate()[1]
        time.sleep(0.005)
    kill(process)
    assert kept.exists()
    assert_same(break_samples(tmp_path, f"{line} -resume"), whole)


def test_too_large_a_network_is_refused(tmp_path):
    refuse(tmp_path, "-lattice_size 128 -equilibrium quad", "-equilibrium quad", "33282", "8000000")
