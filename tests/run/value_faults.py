"""Values that no run can have left, written with right checksums: what a faulty program or a careless script leaves.

Each fault changes an open run file of two samples with breaks, profiles and snapshots (at breaks 1 and 4).
"""
import h5py
import numpy as np

LARGEST = 2**63 - 1


def replace(file, name, values):
    """A dataset with other values, shape or type, kept as the one before was: with checksums, if it had them."""
    old = file[name]
    values = np.asarray(values)
    filters = {"fletcher32": True, "chunks": True} if old.fletcher32 and values.size and values.ndim else {}
    del file[name]
    file.create_dataset(name, data=values, **filters)


def entry(name, place, value):
    """One entry of a dataset; value: a number, or a function of what was there."""
    def change(file):
        values = file[name][...]
        values[place] = value(values[place]) if callable(value) else value
        replace(file, name, values)
    return change


def array(name, function):
    """A dataset becomes function(values)."""
    return lambda file: replace(file, name, function(file[name][...]))


def without(name):
    def change(file):
        del file[name]
    return change


def attribute(name, value):
    def change(file):
        file.attrs[name] = value(file.attrs[name]) if callable(value) else value
    return change


def both(*changes):
    def change(file):
        for one in changes:
            one(file)
    return change


def move_one(values):
    """A bond counted in another section: the sum stays."""
    values[0, 0] -= 100
    values[0, 1] += 100
    return values


def swap_breaks_and_offsets(file):
    """The second sample's breaks end before they begin."""
    offset = file["samples/break_offset"][...]
    offset[1] = offset[2] + 1
    replace(file, "samples/break_offset", offset)


# name: what is done, a word that the message must have
FAULTS = {
    "stiffness_nan": (entry("breaks/stiffness", 3, np.nan), "stiffness"),
    "stiffness_negative": (entry("breaks/stiffness", 3, -1), "stiffness"),
    "stiffness_infinite": (entry("breaks/stiffness", 3, np.inf), "stiffness"),
    "stiffness_zero": (entry("breaks/stiffness", 3, 0), "stiffness"),
    "load_nan": (entry("breaks/load", 2, np.nan), "load"),
    "load_negative": (entry("breaks/load", 2, -0.5), "load"),
    "load_infinite": (entry("breaks/load", 2, np.inf), "load"),
    "load_above_the_peak": (entry("breaks/load", 2, 1e3), "load"),
    "bond_negative": (entry("breaks/bond", 1, -1), "bond"),
    "bond_far_out_of_range": (entry("breaks/bond", 1, 2**31 - 1), "bond"),
    "bond_out_of_range": (entry("breaks/bond", 1, 65), "bond"),
    "bond_twice": (array("breaks/bond", lambda bond: np.concatenate([[bond[1]], bond[1:]])), "bond"),
    "n_f_too_large": (entry("samples/n_f", 0, lambda n: n + 1), "n_f"),
    "n_f_too_small": (entry("samples/n_f", 0, lambda n: n - 1), "n_f"),
    "n_f_negative": (entry("samples/n_f", -1, -1), "n_f"),
    "n_p_above_n_f": (entry("samples/n_p", 0, 1000), "n_p"),
    "n_p_not_at_the_peak": (entry("samples/n_p", 0, lambda n: n - 1 if n > 1 else n + 1), "n_p"),
    "n_p_negative": (entry("samples/n_p", 0, -2), "n_p"),
    "offsets_do_not_ascend": (swap_breaks_and_offsets, "break_offset"),
    "offsets_do_not_begin_at_0": (entry("samples/break_offset", 0, 1), "break_offset"),
    "offset_negative": (entry("samples/break_offset", 1, -1), "break_offset"),
    "offsets_end_too_early": (entry("samples/break_offset", -1, lambda end: end - 1), "break_offset"),
    "offsets_end_too_late": (entry("samples/break_offset", -1, LARGEST), "break_offset"),
    "offsets_too_few": (array("samples/break_offset", lambda offset: offset[:-1]), "break_offset"),
    "peak_load_not_the_largest": (entry("samples/peak_load", 0, lambda load: load * (1 + 1e-15 * 4)), "peak_load"),
    "peak_load_nan": (entry("samples/peak_load", -1, np.nan), "peak_load"),
    "peak_load_infinite": (entry("samples/peak_load", -1, np.inf), "peak_load"),
    "peak_load_negative": (entry("samples/peak_load", -1, -1), "peak_load"),
    "peak_displacement_nan": (entry("samples/peak_displacement", -1, np.nan), "peak_displacement"),
    "peak_displacement_other": (entry("samples/peak_displacement", -1, 1e3), "peak_displacement"),
    "initial_stiffness_nan": (entry("samples/initial_stiffness", 0, np.nan), "initial_stiffness"),
    "initial_stiffness_negative": (entry("samples/initial_stiffness", 0, -1), "initial_stiffness"),
    "initial_stiffness_other": (entry("samples/initial_stiffness", 0, 1e3), "initial_stiffness"),
    "wall_time_nan": (entry("samples/wall_time", 0, np.nan), "wall_time"),
    "wall_time_negative": (entry("samples/wall_time", 0, -1), "wall_time"),
    "index_twice": (entry("samples/index", 1, 0), "index"),
    "index_negative": (entry("samples/index", 0, -5), "index"),
    "index_largest": (entry("samples/index", -1, LARGEST), "index"),
    "index_descends": (array("samples/index", lambda index: index[::-1]), "index"),
    "schema_of_the_future": (attribute("schema_version", np.int32(99)), "99"),
    "schema_0": (attribute("schema_version", np.int32(0)), "schema"),
    "schema_negative": (attribute("schema_version", np.int32(-1)), "schema"),
    "schema_a_text": (attribute("schema_version", np.bytes_("two")), "schema"),
    "schema_a_fraction": (attribute("schema_version", 1.5), "schema"),
    "schema_missing": (lambda file: file.attrs.__delitem__("schema_version"), ""),
    "options_missing": (lambda file: file.attrs.__delitem__("options"), ""),
    "options_a_number": (attribute("options", np.int32(7)), "options"),
    "samples_missing": (without("samples"), "samples"),
    "index_missing": (without("samples/index"), "index"),
    "breaks_missing": (without("breaks"), "breaks"),
    "bond_missing": (without("breaks/bond"), "bond"),
    "break_offset_missing": (without("samples/break_offset"), "break_offset"),
    "loads_too_few": (array("breaks/load", lambda load: load[:-1]), "load"),
    "loads_too_many": (array("breaks/load", lambda load: np.append(load, load[-1])), "load"),
    "bonds_too_many": (array("breaks/bond", lambda bond: np.append(bond, 0)), "breaks"),
    "bonds_are_fractions": (array("breaks/bond", lambda bond: bond + 0.5), "bond"),
    "bonds_are_texts": (array("breaks/bond", lambda bond: np.full(len(bond), b"bond")), "bond"),
    "bonds_of_64_bits": (array("breaks/bond", lambda bond: bond + 2**32), "bond"),
    "peak_loads_too_few": (array("samples/peak_load", lambda load: load[:1]), "peak_load"),
    "peak_loads_in_a_table": (array("samples/peak_load", lambda load: load[:, None]), "peak_load"),
    "peak_load_a_number": (array("samples/peak_load", lambda load: load[0]), "peak_load"),
    "peak_load_a_group": (both(without("samples/peak_load"), lambda file: file.create_group("samples/peak_load")),
                          "peak_load"),
    "samples_a_dataset": (both(without("samples"), lambda file: file.create_dataset("samples", data=1.0)), "samples"),
    "profile_missing": (without("profile"), "profile"),
    "profile_failure_missing": (without("profile/failure"), "failure"),
    "profile_sums_unlike_n_p": (entry("profile/peak", (0, 0), lambda n: n + 1), "peak"),
    "profile_sums_unlike_n_f": (entry("profile/failure", (-1, 2), lambda n: n + 1), "failure"),
    "profile_negative": (array("profile/failure", move_one), "failure"),
    "profile_of_fewer_samples": (array("profile/peak", lambda peak: peak[:1]), "profile"),
    "profile_flat": (array("profile/peak", np.ravel), "profile"),
    "snapshots_missing": (without("snapshots"), "snapshots"),
    "snapshots_of_fewer_samples": (both(*(array(f"snapshots/{name}", lambda rows: rows[:2])
                                          for name in ("sample", "number", "displacement", "force"))), "snapshot"),
    "snapshot_of_another_sample": (entry("snapshots/sample", 3, 77), "snapshots"),
    "snapshot_number_0": (entry("snapshots/number", 0, 0), "number"),
    "snapshot_number_negative": (entry("snapshots/number", 0, -1), "number"),
    "snapshot_beyond_the_last_break": (entry("snapshots/number", 1, 10000), "number"),
    "snapshot_twice": (entry("snapshots/number", 1, 1), "number"),
    "snapshots_without_numbers": (without("snapshots/number"), "number"),
    "snapshot_numbers_too_few": (array("snapshots/number", lambda number: number[:3]), "snapshots"),
    "force_nan": (entry("snapshots/force", (0, 5), np.nan), "force"),
    "displacement_infinite": (entry("snapshots/displacement", (0, 5), np.inf), "displacement"),
    "forces_of_fewer_bonds": (array("snapshots/force", lambda force: force[:, :64]), "force"),
    "forces_flat": (array("snapshots/force", np.ravel), "force"),
    "displacements_of_fewer_nodes": (array("snapshots/displacement", lambda u: u[:, :49]), "displacement"),
}
# Those that a checkpoint can have: it is one sample, of another network, without snapshots.
OF_TWO_SAMPLES = ("index_twice", "index_descends", "offsets_do_not_ascend", "peak_loads_too_few", "bond_out_of_range")
CHECKPOINT_FAULTS = [name for name in FAULTS if name not in OF_TWO_SAMPLES
                     and not name.startswith(("snapshot", "force", "displacement", "profile_of"))]


def write_with_fault(source, target, name):
    """A copy of the run file `source` with one of FAULTS."""
    target.write_bytes(source.read_bytes())
    with h5py.File(target, "r+") as file:
        FAULTS[name][0](file)
