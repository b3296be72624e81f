"""-equilibrium_tree_threads: one sample on several threads leaves the bits that one thread leaves."""
import networks
import pytest
from program import OUTPUT, assert_same, break_samples, options_of, refuse, run, succeed

NAME = "-equilibrium_tree_threads"
THREADS = (2, 3, 4, 7)


@pytest.mark.parametrize("scene", [
    "-lattice_size 16 -samples 2",
    "-lattice_size 32 -model fuse -record breaks,profile,snapshot -record_snapshot_at 1,30,200",
    "-lattice_size 24 -grips clamped -break_on tension -lattice_dilution 0.1",
    "-lattice_size 96 -stop breaks=150",  # threads share the rows of its largest fronts
])
def test_any_number_leaves_the_same_bits(tmp_path, scene):
    alone = break_samples(tmp_path, scene, "alone.h5")
    for threads in THREADS:
        assert_same(break_samples(tmp_path, f"{scene} {NAME} {threads}", f"{threads}.h5"), alone)


@pytest.mark.parametrize("components", [1, 2])
def test_a_network_file_breaks_to_the_same_bits(tmp_path, components):
    networks.irregular_network(5, nodes=300, components=components).write(tmp_path / "network.h5")
    scene = "-lattice file -lattice_file network.h5 -samples 2"
    alone = break_samples(tmp_path, scene, "alone.h5")
    for threads in THREADS:
        assert_same(break_samples(tmp_path, f"{scene} {NAME} {threads}", f"{threads}.h5"), alone)


def test_processes_have_threads_of_their_own(tmp_path):
    scene = "-lattice_size 12 -samples 6"
    alone = break_samples(tmp_path, scene, "alone.h5")
    assert_same(break_samples(tmp_path, f"{scene} {NAME} 2", "both.h5", ranks=2), alone)


def test_a_run_goes_on_with_another_number(tmp_path):
    scene = "-lattice_size 16 -monitor none"
    whole = break_samples(tmp_path, f"{scene} -samples 3", "whole.h5")
    break_samples(tmp_path, f"{scene} -samples 1 {NAME} 3")
    assert options_of(tmp_path / OUTPUT)[NAME] == "3"
    assert_same(break_samples(tmp_path, f"{scene} -samples 3 {NAME} 2 -resume"), whole)


def test_every_break_is_that_of_a_full_solve(tmp_path):
    result = succeed(tmp_path, f"-lattice_size 12 -monitor none {NAME} 4 -equilibrium_tree_verify -equilibrium_tree_view")
    assert "differences 0" in result.stdout


def test_more_threads_than_the_system_starts_are_refused_by_number(tmp_path):
    """The limit counts all that the user runs; root has none."""
    import resource  # pylint: disable=import-outside-toplevel

    def little_room():  # of address space: a thread takes eight MiB
        resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))
        resource.setrlimit(resource.RLIMIT_STACK, (1 << 28, 1 << 28))

    result = run(tmp_path, f"-lattice_size 4 {NAME} 200", prepare=little_room)
    assert result.returncode == 1 and result.stderr.count("\n") == 1, result.stderr
    assert f"{NAME} 200: allowed is 1 to " in result.stderr, result.stderr


def test_only_tree_has_them(tmp_path):
    refuse(tmp_path, f"-lattice_size 3 -equilibrium dense {NAME} 2", NAME)
