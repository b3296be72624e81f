"""Options files and command lines as nobody would write them: bytes, quotes, includes, values beyond every bound."""
import shlex

INTEGERS = ("0", "1", "2", "3", "7", "-1", "2147483647", "2147483648", "-2147483648", "4294967296",
            "9223372036854775807", "9223372036854775806", "9223372036854775808", "-9223372036854775808",
            "99999999999999999999", "1e3", "1.5", "0x10", "010", "+5", "1,2", "1,,2", ",", "1 2", "--1", "nan", "five",
            "٣", "")
NUMBERS = ("0", "-0", "1", "0.5", "-1", "1e-170", "1e-320", "5e-324", "1e170", "1e308", "1e309", "1e-400", "nan", "inf",
           "-inf", "infinity", "1e5", "1e15", "1d5", "1,5", "0x1p3", "half", "1e", ".", "1e-12", "")
WORDS = ("spring", "fuse", "file", "triangular", "uniform", "none", "true", "no", "Spring", "spring,fuse", "=", "%s%s%n",
         "\x1b[31m", "ß", "a" * 300, "a" * 5000, "")
PATHS = ("run.h5", "missing/run.h5", ".", "/proc/run.h5", "a/../run.h5", "b" * 300 + ".h5", "scene.opts",
         "pipe", "", " ", "new\nline.h5")
LISTS = ("breaks", "none", "breaks,profile,snapshot,network", "breaks,,profile", "snapshot", "breaks,none", ",",
         ",".join(["breaks"] * 1500))
STOPS = ("failure", "breaks=0", "breaks=1", "breaks=-1", "breaks=99999999999", "breaks=", "stiffness=0", "stiffness=1",
         "stiffness=1e-300", "stiffness=nan", "displacement=0", "displacement=1e300", "displacement=inf", "=", "breaks=1x")
# Option to values that may be tried. Sizes and numbers of samples that would only take long aren't among them.
VALUES = {
    "-model": WORDS, "-lattice": WORDS, "-grips": ("sliding", "clamped", *WORDS), "-break_on": ("tension", *WORDS),
    "-lattice_size": [value for value in INTEGERS if value not in ("1e3", "2147483647")],
    "-lattice_row_spacing": NUMBERS, "-lattice_dilution": NUMBERS, "-lattice_file": PATHS,
    "-stiffness": ("random", "inclusion", "band", *WORDS), "-stiffness_contrast": NUMBERS,
    "-disorder": ("power", "constant", *WORDS), "-disorder_exponent": NUMBERS, "-disorder_zero_share": NUMBERS,
    "-seed": INTEGERS, "-first_sample": INTEGERS, "-samples": ("0", "1", "2", "-1", "1.5", "2,3", "", "x"),
    "-ensemble_ranks_per_sample": INTEGERS, "-checkpoint_every": NUMBERS, "-checkpoint_breaks": INTEGERS,
    "-stop": STOPS, "-equilibrium": ("tree", "ksp", "dense", *WORDS), "-equilibrium_refactor_every": INTEGERS,
    "-equilibrium_check": INTEGERS, "-equilibrium_check_bound": NUMBERS, "-equilibrium_tree_verify": WORDS,
    "-equilibrium_tree_view": WORDS, "-equilibrium_tree_precision": ("single", "double", *WORDS),
    "-equilibrium_tree_threads": INTEGERS, "-output": PATHS, "-record": LISTS,
    "-record_snapshot_at": (*INTEGERS, ",".join(map(str, range(1, 1200)))), "-monitor": WORDS,
    "-ksp_type": ("cg", "preonly", "chebyshev", "none", "gmres", ""), "-pc_type": ("jacobi", "none", "icc", "x"),
    "-ksp_rtol": NUMBERS, "-ksp_max_it": INTEGERS, "-mat_type": ("aij", "dense", "x"), "-vec_type": ("seq", "x"),
    "-lattice_sise": INTEGERS, "-no_such_option": WORDS, "-options_left": ("", "no"), "-malloc_dump": ("",),
    "-": WORDS, "--": WORDS, "-5": WORDS, "-help": ("",), "-version": ("",), "-options_view": ("",),
}
HARMLESS = ("-lattice_size 4", "-model fuse", "-seed 3", "-samples 2", "# a comment", "", "-record breaks,profile",
            "-grips clamped")


# What must be given for a value to be looked at.
BESIDE = {"-disorder_exponent": "-disorder power", "-stiffness_contrast": "-stiffness random",
          "-equilibrium_check_bound": "-equilibrium_check 1", "-record_snapshot_at": "-record snapshot",
          "-ksp_rtol": "-ksp_type cg -pc_type jacobi", "-ksp_max_it": "-ksp_type cg -pc_type icc",
          "-pc_type": "-ksp_type cg", "-equilibrium_refactor_every": "-ksp_type cg -pc_type icc",
          "-lattice_file": "-lattice file -disorder file", "-lattice_row_spacing": "-record breaks,profile",
          "-ensemble_ranks_per_sample": "-equilibrium ksp"}
NUMERIC = [name for name, values in VALUES.items() if values in (INTEGERS, NUMBERS, STOPS)]


def strange_option(chance):
    """Name and value; every other one is a number."""
    name = chance.choice(NUMERIC if chance.random() < 0.5 else list(VALUES))
    return name, chance.choice(VALUES[name])


COMPARED = {
    "-compare": ("tree.opts", "tree.opts,cg.opts", "missing.opts", "network.h5", ".", "pipe", ",", "tree.opts,", ""),
    "-compare_rtol": (*NUMBERS, "1e-2,1e-4", "1e-2,,1", "1e-2,x"), "-compare_every": INTEGERS, "-compare_skip": INTEGERS,
    "-compare_repetitions": ("1", "0", "-1", "x", "1.5", "99999999999"), "-compare_along": ("own", *WORDS),
    "-compare_reference": ("quad", "refined", *WORDS), "-model": ("fuse", *WORDS), "-stop": STOPS,
    "-lattice_row_spacing": NUMBERS, "-seed": INTEGERS, "-first_sample": INTEGERS, "-samples": ("2",),
}
MERGED = ("run.h5", "run.h5", "other.h5", "missing.h5", "network.h5", "pipe", ".", "", "-output", "-output", "merged.h5",
          "-overwrite", "-help", "-x", "--", "-", "a" * 300, "new\nline.h5")


def strange_words(chance):
    """The words of a command line of crackle."""
    words = ["-lattice_size", chance.choice("1234"), "-monitor", "none"]
    for _ in range(chance.choice((1, 1, 1, 1, 2))):
        name, value = strange_option(chance)
        words += [*BESIDE.get(name, "").split(), name, *([value] if value else [])]
    if "-lattice_file" in words or "file" in words:
        del words[:2]
    return ["crackle", *words]


def words_of_compare(chance):
    words = "-lattice_size 2 -compare tree.opts -compare_repetitions 1 -monitor none".split()
    for name in chance.sample(list(COMPARED), chance.choice((1, 1, 2))):
        value = chance.choice(COMPARED[name])
        words += [name, *([value] if value else [])]
    return ["crackle_compare", *words]


def words_of_merge(chance):
    words = chance.sample(MERGED, chance.randrange(6))
    return ["crackle_merge", *(words if chance.random() < 0.5 else ["run.h5", *words, "-output", "merged.h5"])]


def strange_command(chance):
    return chance.choice((strange_words, strange_words, words_of_compare, words_of_merge))(chance)


# Each takes (chance, lines), lines of bytes, and gives the bytes of a file.

def join(lines):
    return b"\n".join(lines) + b"\n"


def random_bytes(chance, lines):
    data = bytearray(join(lines))
    for _ in range(chance.choice((1, 3, 20))):
        data[chance.randrange(len(data))] = chance.randrange(256)
    return bytes(data)


def byte_order_mark(_, lines):
    return b"\xef\xbb\xbf" + join(lines)


def utf_16(chance, lines):
    return join(lines).decode(errors="replace").encode(chance.choice(("utf-16", "utf-16-le", "utf-16-be", "utf-32")))


def carriage_returns(chance, lines):
    return chance.choice((b"\r\n", b"\r")).join(lines)


def one_line(chance, lines):
    return chance.choice((b" ", b"\t", b";")).join(line for line in lines if not line.startswith(b"#"))


def quote(chance, lines):
    at = chance.randrange(len(lines))
    return join(lines[:at] + [lines[at] + chance.choice((b' "', b" '", b' "a b"', b"\\"))] + lines[at:])


def include(chance, lines):
    target = chance.choice((b"scene.opts", b"./scene.opts", b"missing.opts", b".", b"pipe", b"/dev/zero", b"/dev/null",
                            b"other.opts", b"network.h5", b""))
    return join([*lines, b"-options_file " + target])


def long_line(chance, lines):
    return join([*lines, chance.choice((b"# ", b"-record ", b"-", b"")) + b"x" * chance.choice((1000, 5000, 200000))])


def many_lines(chance, lines):
    return join(lines * chance.choice((100, 5000)))


def nul(chance, lines):
    data = join(lines)
    at = chance.randrange(len(data))
    return data[:at] + b"\0" * chance.choice((1, 100)) + data[at:]


def indented(chance, lines):
    return join([chance.choice((b"  ", b"\t", b"\xc2\xa0")) + line for line in lines])


def no_end(_, lines):
    return b"\n".join(lines)


def nonsense(chance, _):
    return chance.randbytes(chance.choice((0, 1, 10, 1000)))


def aliases(chance, lines):
    return join([*lines, chance.choice((b"alias -a -seed\n-a 5", b"alias -seed -seed", b"alias", b"=-seed 5", b"(seed 5)",
                                        b"!-seed 5", b"% -seed 5", b"-seed=5", b"seed: 5"))])


WAYS = (random_bytes, byte_order_mark, utf_16, carriage_returns, one_line, quote, include, include,
        long_line, many_lines, nul, indented, no_end, nonsense, aliases)


def strange_file(chance):
    """The bytes of an options file, and what was done."""
    lines = [line.encode() for line in chance.sample(HARMLESS, chance.randrange(1, 4))]
    if chance.random() < 0.5:
        lines.append(" ".join(strange_option(chance)).encode(errors="surrogatepass"))
    way = chance.choice(WAYS)
    return way(chance, lines), way.__name__


def as_line(words):
    return shlex.join(words)
