"""Networks read from a file: those that crackle wrote, irregular ones, and ones with floppy parts."""
import numpy as np
import pytest
from crackle.files import read_run
from crackle.statistics.damage_profiles import bond_sections
from networks import BOTTOM, FREE, TOP, NetworkOfFile, irregular_network, small_network
from program import OUTPUT, assert_same_while_told, break_samples, datasets, options_of, refuse, run, succeed
from reference_model import triangular_lattice
from reference_network import break_network

FROM_FILE = "-lattice file -lattice_file network.h5 -disorder file"
MUMPS = "-ksp_type preonly -pc_type cholesky -pc_factor_mat_solver_type mumps"
GRIPS = ["sliding", "clamped"]


def break_file(folder, network, more=""):
    network.write(folder / "network.h5")
    return break_samples(folder, f"{FROM_FILE} {more} -overwrite")


def bits(found):
    """What must agree bit for bit when the same network comes from a file."""
    names = [name for name in found if name.startswith("/breaks/")] + ["/samples/peak_load", "/samples/n_p"]
    return {name: found[name].tobytes() for name in names}


@pytest.mark.parametrize("grips", GRIPS)
@pytest.mark.parametrize("model", ["spring", "fuse"])
def test_written_and_read_back_it_breaks_the_same(tmp_path, model, grips):
    scene = f"-grips {grips} -record breaks,network"
    made = break_samples(tmp_path, f"-model {model} -lattice_size 9 {scene}", "network.h5")
    read = break_samples(tmp_path, f"{FROM_FILE} {scene}")
    assert bits(read) == bits(made)
    again = {name: values.tobytes() for name, values in read.items() if name.startswith("/network")}
    assert again == {name: made[name].tobytes() for name in again}


def test_thresholds_drawn_for_a_file_are_those_of_the_generated_lattice(tmp_path):
    made = break_samples(tmp_path, "-lattice_size 5 -seed 3 -samples 2 -record breaks,network", "network.h5")
    read = break_samples(tmp_path, "-lattice file -lattice_file network.h5 -seed 3 -samples 2")
    assert bits(read) == bits(made)


def test_stiffness_is_1_without_a_dataset(tmp_path):
    network = small_network()
    ones = break_file(tmp_path, network.but(stiffness=np.ones(11)))
    assert bits(break_file(tmp_path, network.but(stiffness=None))) == bits(ones)


@pytest.mark.parametrize("grips", GRIPS)
@pytest.mark.parametrize("components", [1, 2])
def test_small_network_breaks_as_the_reference(tmp_path, components, grips):
    network = small_network().but(components=components)
    assert_same_while_told(break_file(tmp_path, network, f"-grips {grips}"), break_network(network, grips))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("components", [1, 2])
@pytest.mark.parametrize("grips", GRIPS)
def test_irregular_network_with_stiffness_over_four_decades(tmp_path, grips, components, seed):
    network = irregular_network(seed, components=components)
    expected = break_network(network, grips)
    for solver in ("", "-equilibrium ksp", "-equilibrium dense", MUMPS):
        assert_same_while_told(break_file(tmp_path, network, f"-grips {grips} {solver}"), expected)


def test_order_of_the_two_nodes_of_a_bond_does_not_matter(tmp_path):
    network = irregular_network(4)
    turned = network.but(nodes=np.where((np.arange(len(network.nodes)) % 2 == 0)[:, None],
                                        network.nodes, network.nodes[:, ::-1]))
    assert_same_while_told(break_file(tmp_path, turned, "-break_on tension"),
                       break_file(tmp_path, network, "-break_on tension"))


def test_units_do_not_matter(tmp_path):
    """A unit of length and one of stiffness change loads, not the order."""
    network = irregular_network(5)
    other = network.but(position=1e-3 * network.position, stiffness=1e9 * network.stiffness)
    expected, found = break_file(tmp_path, network), break_file(tmp_path, other)
    expected["/breaks/stiffness"] = 1e9 * expected["/breaks/stiffness"]
    assert_same_while_told(found, expected)


@pytest.mark.parametrize("components", [1, 2])
def test_two_bonds_between_the_same_nodes(tmp_path, components):
    network = small_network().but(components=components)
    doubled = network.but(nodes=np.vstack([network.nodes, network.nodes[[6]]]),
                          stiffness=np.append(network.stiffness, 0.3),
                          threshold=np.append(network.threshold, 0.2))
    assert_same_while_told(break_file(tmp_path, doubled), break_network(doubled))


def lattice_network(size, seed, components=2):
    """The triangular lattice with random thresholds."""
    nodes, _ = triangular_lattice(size)
    row, column = np.divmod(np.arange((size + 1) ** 2), size + 1)
    grip = np.where(row == 0, BOTTOM, np.where(row == size, TOP, FREE)).astype(np.int8)
    position = np.stack([column + row % 2 / 2, row], axis=1).astype(float)
    threshold = np.random.default_rng(seed).random(len(nodes))
    return NetworkOfFile(position, grip, nodes.astype(np.int32), np.ones(len(nodes)), threshold, components,
                         period_x=size + 1.0)


def diluted_network(size, share, seed, components=2):
    """The triangular lattice without a share of its bonds, at random."""
    network = lattice_network(size, seed, components)
    bonds = np.random.default_rng(seed + 1000).permutation(len(network.nodes))
    return network.without(bonds[:int(share * len(bonds))])


def with_floppy_parts(network):
    """A free node, a dangling bond, a dangling chain, and a triangle that hangs by one node."""
    n = len(network.position)
    held = int(np.flatnonzero(network.grip == FREE)[3])
    gripped = int(np.flatnonzero(network.grip == TOP)[0])
    position = network.position[0] + np.array([[0.3, 0.4], [0.7, 1.3], [0.2, 2.1], [0.9, 2.2], [0.6, 3.3],
                                               [1.2, 3.1], [0.4, 0.1]])
    nodes = [[n + 1, held], [n + 2, n + 3], [n + 2, held], [n + 4, n + 5], [n + 4, held], [n + 5, held],
             [n + 6, gripped]]
    return network.with_parts(position, np.array(nodes))


FLOPPY = {
    "hanging_on_a_lattice": lambda c, seed: with_floppy_parts(lattice_network(6, seed, c)),
    "hanging_on_an_irregular_network": lambda c, seed: with_floppy_parts(irregular_network(seed, 40, c)),
    "dilute": lambda c, seed: diluted_network(8, 0.15, seed, c),
    "very_dilute": lambda c, seed: diluted_network(8, 0.27, seed, c),
}


@pytest.mark.parametrize("grips", GRIPS)
@pytest.mark.parametrize("components", [1, 2])
@pytest.mark.parametrize("kind", FLOPPY)
def test_floppy_parts(tmp_path, kind, components, grips):
    """Null pivots from the start: the default solver and the dense one break as the reference does."""
    for seed in range(2):
        network = FLOPPY[kind](components, seed)
        expected = break_network(network, grips)
        for solver in ("", "-equilibrium ksp", "-equilibrium dense"):
            assert_same_while_told(break_file(tmp_path, network, f"-grips {grips} {solver}"), expected)


@pytest.mark.parametrize("seed, nodes", [(234, 52), (498, 76)])
def test_floppy_parts_on_stiffness_over_four_decades(tmp_path, seed, nodes):
    """Null pivots whose rounding is not small beside the softest bonds."""
    network = with_floppy_parts(irregular_network(seed, nodes))
    for solver in ("", "-equilibrium ksp", "-equilibrium dense", "-ksp_type cg -pc_type updown"):
        assert_same_while_told(break_file(tmp_path, network, solver), break_network(network))


def thinned_network(seed):
    """An irregular network without three tenths of its bonds: null pivots beside soft parts."""
    network = irregular_network(seed)
    bonds = np.random.default_rng(seed).permutation(len(network.nodes))
    return network.without(bonds[:int(0.3 * len(bonds))])


@pytest.mark.parametrize("solver", ["", "-equilibrium ksp", "-equilibrium dense"])
@pytest.mark.parametrize("seed", [200, 342])  # intact stiffness 0.042, 1.08 (60 digits)
def test_soft_parts_are_not_taken_for_null_pivots(tmp_path, seed, solver):
    network = thinned_network(seed)
    found, expected = break_file(tmp_path, network, solver), break_network(network)
    assert found["/breaks/bond"].tolist() == expected["/breaks/bond"].tolist()


@pytest.mark.parametrize("solver", ["", "-equilibrium ksp", "-equilibrium dense"])
@pytest.mark.parametrize("seed", [151, 180])  # intact stiffness 0 (60 digits)
def test_rounding_is_not_taken_for_stiffness(tmp_path, seed, solver):
    """The paths between the grips are mechanisms: nothing carries load, and no strength is reported."""
    thinned_network(seed).write(tmp_path / "network.h5")
    result = run(tmp_path, f"{FROM_FILE} {solver} -monitor none")
    assert result.returncode == 1 and "load" in result.stderr
    assert result.stderr.count("\n") == 1 and result.stderr.startswith("crackle: ")


def test_bonds_without_stiffness_do_not_count(tmp_path):
    network = lattice_network(5, seed=3)
    gone = np.arange(7, 96, 11)
    network = network.but(stiffness={i: 0.0 for i in gone})
    expected, found = break_network(network), break_file(tmp_path, network)
    assert not np.isin(found["/breaks/bond"], gone).any()
    assert_same_while_told(found, expected)


def test_thresholds_of_zero_break_first_at_no_load(tmp_path):
    """Uniform on [0, 1) has the 0; equal ratios break the lowest number first."""
    network = lattice_network(4, seed=1)
    inclined = np.flatnonzero(np.ptp(network.nodes // 5, axis=1))[[12, 5]]
    found = break_file(tmp_path, network.but(threshold={i: 0.0 for i in inclined}))
    np.testing.assert_array_equal(found["/breaks/bond"][:2], np.sort(inclined))
    np.testing.assert_array_equal(found["/breaks/load"][:2], [0, 0])
    assert np.isfinite(found["/breaks/stiffness"]).all()


def test_the_file_read_is_left_as_it_was(tmp_path):
    path = small_network().write(tmp_path / "network.h5")
    path.chmod(0o444)
    before = path.read_bytes()
    succeed(tmp_path, f"{FROM_FILE} -record breaks,network -monitor none")
    assert path.read_bytes() == before
    written = datasets(tmp_path / "crackle.h5")
    for name, values in datasets(path).items():
        np.testing.assert_array_equal(written[name], values)


def two_wide(flip=False, **more):
    """Two nodes a row, period 2: half of the bonds are half a period long in x. flip: six of them are named from
    their other node; the network stays the same."""
    bonds, step = [], []
    for row in range(4):
        for column in range(2):
            node, other = 2 * row + column, 2 * row + 1 - column
            bonds.append([node, other])
            step.append([1, 0])
            if row < 3:
                left = [node, other + 2]
                bonds += [[node, node + 2], [node, other + 2], left[::-1] if flip else left]
                step += [[0, 1], [1, 1], [1, -1] if flip else [-1, 1]]
    position = np.array([[column, row] for row in range(4) for column in range(2)], float)
    grip = np.array([BOTTOM, BOTTOM, FREE, FREE, FREE, FREE, TOP, TOP], np.int8)
    threshold = np.random.default_rng(3).random(len(bonds)) + 0.05
    network = NetworkOfFile(position, grip, np.array(bonds, np.int32), None, threshold, period_x=2.0)
    return network.but(step=np.array(step, float)).but(**more)


@pytest.mark.parametrize("scale, shift", [(1.0, 0.0), (0.1, 0.3), (3e5, -7.7)])
def test_half_a_period_needs_a_step(tmp_path, scale, shift):
    """Without steps refused, whatever rounding makes of it; with them one network, whoever is a bond's first node."""
    for flip in (False, True):
        network = two_wide(flip)
        moved = network.but(position=scale * (network.position + [shift, 0]), period_x=2 * scale, step=None)
        moved.write(tmp_path / "network.h5")
        refuse(tmp_path, FROM_FILE, "bond 0 (nodes 0, 1)", "half a period", "/network/bonds/step")
        # a fuse has no direction
        break_file(tmp_path, moved.but(components=1))
    found = [break_file(tmp_path, network.but(position=scale * (network.position + [shift, 0]), period_x=2 * scale,
                                              step=scale * network.step))
             for network in (two_wide(), two_wide(flip=True))]
    assert_same_while_told(found[1], found[0])


def test_steps_are_the_networks(tmp_path):
    """They lead where the same network without a period has its nodes; they are kept, and a wrong one is refused."""
    network = two_wide()
    expected = break_network(network)
    assert_same_while_told(break_file(tmp_path, network, "-record breaks,network"), expected)
    kept = datasets(tmp_path / "crackle.h5")
    np.testing.assert_array_equal(kept["/network/bonds/step"], network.step)
    again = break_samples(tmp_path, "-lattice file -lattice_file crackle.h5 -disorder file", "again.h5")
    assert bits(again) == bits(kept)
    read = read_run(str(tmp_path / "crackle.h5")).network()
    np.testing.assert_array_equal(read.segments()[:, 1] - read.segments()[:, 0], network.step)
    for row, change in [(1, [0, 1.001]), (2, [2, 1]), (3, [1.5, 1]), (0, [np.nan, 0]), (0, [0, 0])]:
        network.but(step={row: change}).write(tmp_path / "network.h5")
        refuse(tmp_path, FROM_FILE, f"bond {row}")


def test_the_smallest_lattice_is_read_back(tmp_path):
    made = break_samples(tmp_path, "-lattice_size 1 -break_on tension -record breaks,network", "network.h5")
    assert bits(break_samples(tmp_path, f"{FROM_FILE} -break_on tension")) == bits(made)


def test_a_row_of_thresholds_for_each_sample(tmp_path):
    rows = np.random.default_rng(0).weibull(2.0, (5, 11))
    network = small_network().but(threshold=rows)
    found = break_file(tmp_path, network, "-samples 3 -first_sample 2 -record breaks,network")
    np.testing.assert_array_equal(found["/network/bonds/threshold"], rows)
    np.testing.assert_array_equal(found["/samples/index"], [2, 3, 4])
    offset = found["/samples/break_offset"]
    for place, row in enumerate(rows[2:]):
        alone = break_file(tmp_path, network.but(threshold=row))
        np.testing.assert_array_equal(found["/breaks/load"][offset[place]:offset[place + 1]], alone["/breaks/load"])
    network.write(tmp_path / "network.h5")
    for more in ("-samples 6", "-samples 3 -first_sample 3", "-first_sample 5"):
        refuse(tmp_path, f"{FROM_FILE} {more}", more.rsplit("-", 1)[1], "samples 0 to 4")


def test_thresholds_that_no_ratio_can_be_made_of(tmp_path):
    """Beyond the range that leaves ratios, loads and displacements finite; -0 is 0, infinity never breaks."""
    network = small_network()
    for value in (1e-309, 5e-324, 1e-300, 1e300, -1e-320, np.nan, -np.inf):
        network.but(threshold={3: value}).write(tmp_path / "network.h5")
        refuse(tmp_path, FROM_FILE, "threshold of bond 3", "from 1e-290 to 1e+150")
    for value in (1e-309, 1e-101, 1e101, np.inf, np.nan):
        network.but(stiffness={4: value}).write(tmp_path / "network.h5")
        refuse(tmp_path, FROM_FILE, "stiffness of bond 4", "from 1e-100 to 1e+100")
    minus = break_file(tmp_path, network.but(threshold={3: -0.0}))
    assert bits(minus) == bits(break_file(tmp_path, network.but(threshold={3: 0.0})))
    assert minus["/breaks/bond"][0] == 3
    assert 3 not in break_file(tmp_path, network.but(threshold={3: np.inf}))["/breaks/bond"]


@pytest.mark.parametrize("scale", [2.0 ** -960, 2.0 ** 490])
@pytest.mark.parametrize("solver", ["", "-equilibrium dense", "-equilibrium ksp"])
def test_scaled_thresholds_break_the_same_bonds(tmp_path, scale, solver):
    for network in (small_network(), irregular_network(3)):
        one = break_file(tmp_path, network, solver)
        scaled = break_file(tmp_path, network.but(threshold=scale * network.threshold), solver)
        np.testing.assert_array_equal(scaled["/breaks/bond"], one["/breaks/bond"])
        np.testing.assert_array_equal(scaled["/breaks/load"], scale * one["/breaks/load"])


@pytest.mark.parametrize("unit", [1.0, 1e10, 1e-3])
def test_a_profile_has_the_networks_own_sections(tmp_path, unit):
    network = small_network()
    network = network.but(position=unit * network.position)
    found = break_file(tmp_path, network, "-record breaks,profile")
    assert found["/profile/failure"].shape == (1, 3)
    assert found["/profile/failure"].sum() == len(found["/breaks/bond"])
    assert float(options_of(tmp_path / "crackle.h5")["-record_profile_height"]) == pytest.approx(unit)
    with_network = break_file(tmp_path, network, "-record breaks,profile,network")
    section = bond_sections(read_run(tmp_path / "crackle.h5").network(), unit)
    np.testing.assert_array_equal(np.bincount(section[with_network["/breaks/bond"]], minlength=3),
                                  with_network["/profile/failure"][0])
    halves = break_file(tmp_path, network, f"-record breaks,profile -record_profile_height {unit / 2}")
    assert halves["/profile/failure"].shape == (1, 5)
    refuse(tmp_path, f"{FROM_FILE} -record profile -record_profile_height {unit * 1e-6}", "-record_profile_height",
           "65536 sections")


@pytest.mark.parametrize("strategy, kink", [("tree", 1e-6), ("ksp", 1e-6), ("quad", 5e-14)])
def test_node_that_hardly_resists_is_named_with_its_bonds(tmp_path, strategy, kink):
    """Between two of the network's nodes, almost in line with them: its bonds carry nothing."""
    network = small_network()
    middle = (network.position[1] + network.position[2]) / 2 + [kink, kink]
    network.with_parts([middle], [[1, 6], [6, 2]]).write(tmp_path / "network.h5")
    result = run(tmp_path, f"{FROM_FILE} -monitor none -equilibrium {strategy}")
    told = result.stderr if strategy == "quad" else result.stdout
    assert result.returncode == (1 if strategy == "quad" else 0)
    assert "node 6 (bonds 11, 12) " in told
    if strategy != "quad":
        assert_same_while_told(datasets(tmp_path / OUTPUT), break_file(tmp_path, network))


def test_what_is_too_far_apart_for_springs(tmp_path):
    network = small_network()
    far = network.but(position=network.position * [1, 1e200])
    far.write(tmp_path / "network.h5")
    refuse(tmp_path, FROM_FILE, "direction of bond 1", "1e-50")
    network.but(position=network.position * [1e-320, 0]).write(tmp_path / "network.h5")
    refuse(tmp_path, FROM_FILE, "length of bond")
