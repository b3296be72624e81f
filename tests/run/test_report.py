"""The report of small runs: complete, or with what can't be made told; its page in a real browser."""
import csv
import os
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import h5py
import numpy as np
import pytest
from browser import complaints, open_page
from program import succeed

SCRIPTS = Path(__file__).resolve().parents[2] / "postprocess"
SIZES = (6, 8, 16, 20)


def script(folder, name, *arguments):
    """A script of postprocess, run as a user does."""
    environment = {**os.environ, "MPLCONFIGDIR": str(folder / "matplotlib"), "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run([sys.executable, SCRIPTS / name, *map(str, arguments)], cwd=folder, env=environment,
                          capture_output=True, text=True, timeout=200, check=False)


@pytest.fixture(scope="module", name="runs")
def small_runs(tmp_path_factory):
    """Springs and fuses at four sizes."""
    folder = tmp_path_factory.mktemp("runs")
    for number, (model, size) in enumerate((m, s) for m in ("spring", "fuse") for s in SIZES):
        succeed(folder, f"-model {model} -lattice_size {size} -samples 200 -seed {number} -monitor none "
                        f"-output {model}_{size}.h5")
    return folder


@pytest.fixture(scope="module", name="report")
def whole_report(runs):
    result = script(runs, "report.py", "spring_*.h5", "fuse_*.h5", "-o", "report", "--resamples", 50)
    assert result.returncode == 0, result.stderr
    assert "Warning" not in result.stderr
    return runs / "report"


class Links(HTMLParser):
    """What a page refers to."""

    def __init__(self, text):
        super().__init__()
        self.found = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.found += [(tag, value) for name, value in attrs if name in ("src", "href")]


def figure_names(folder):
    return [line.split()[0] for line in script(folder, "figures.py", "--list").stdout.splitlines()]


def test_report_has_every_figure_and_table(runs, report):
    names = figure_names(runs)
    page = (report / "index.html").read_text()
    assert len(names) >= 20 and "can't be made" not in page
    for name in names:
        assert (report / "figures" / f"{name}.pdf").read_bytes().startswith(b"%PDF")
        assert (report / "figures" / f"{name}.png").stat().st_size > 5000
        assert f'<figure id="{name}">' in page
    for name in ("exponents", "damage", "peak_load", "strength", "likelihood", "normality", "avalanches"):
        rows = list(csv.DictReader(open(report / "tables" / f"{name}.csv", encoding="utf-8")))
        assert rows and f'id="table-{name}"' in page


def test_tables_are_the_runs(runs, report):
    """The mean peak load of the table is that of the file; the paper's stands beside it where there is one."""
    rows = list(csv.DictReader(open(report / "tables" / "peak_load.csv", encoding="utf-8")))
    row = next(r for r in rows if (r["model"], r["L"]) == ("spring", "8"))
    with h5py.File(runs / "spring_8.h5") as file:
        load = file["samples/peak_load"][...]
    mean, error = row["mean"].rstrip(")").split("(")
    assert float(mean) == pytest.approx(load.mean(), abs=0.5 * 10 ** -len(mean.partition(".")[2]))
    assert int(error) * 10 ** -len(mean.partition(".")[2]) == pytest.approx(load.std(ddof=1) / 200 ** 0.5, rel=0.06)
    assert row["paper"] == "1.8125" and abs(float(row["deviation (s.e.)"])) < 4
    assert next(r for r in rows if r["model"] == "fuse")["paper"] == ""


def test_page_needs_nothing_but_itself(report):
    links = Links((report / "index.html").read_text()).found
    assert all(value.startswith("data:") for tag, value in links if tag != "a")
    for value in (value for tag, value in links if tag == "a" and not value.startswith("#")):
        assert (report / value).is_file(), value


COLOURED = """
const canvas = document.getElementById('crack-lattice'), copy = document.createElement('canvas');
[copy.width, copy.height] = [canvas.width, canvas.height];
const pen = copy.getContext('2d', {willReadFrequently: true});
pen.drawImage(canvas, 0, 0);
const pixels = pen.getImageData(0, 0, copy.width, copy.height).data;
let blue = 0, red = 0;
for (let i = 0; i < pixels.length; i += 4) {
  if (pixels[i + 2] - pixels[i] > 60) ++blue;
  if (pixels[i] - pixels[i + 2] > 60) ++red;
}
return [blue, red];
"""


def test_viewer_in_a_browser(report, tmp_path):
    """Slider, keys, play and choice of the sample move the crack; the console stays silent."""
    with open_page(report / "index.html", tmp_path / "profile") as driver:
        slider = driver.find_element("id", "crack-slider")

        def state():
            return int(slider.get_property("value")), driver.execute_script(COLOURED)

        def press(*keys):
            driver.find_element("id", "crack-lattice").send_keys(*keys)
            return state()

        def slide(value):
            driver.execute_script("arguments[0].value = arguments[1];"
                                  "arguments[0].dispatchEvent(new Event('input', {bubbles: true}))", slider, value)
            return state()

        last = int(slider.get_property("max"))
        peak, (blue, red) = press("p")
        assert 0 < peak < last and blue > 100 and red == 0
        assert slide(last)[0] == last
        assert state()[1][1] > 100 and "after the peak" in driver.find_element("id", "crack-status").text
        assert slide(peak) == (peak, [blue, red])  # back, the picture is the same
        assert slide(0) == (0, [0, 0]) and "intact" in driver.find_element("id", "crack-status").text
        right, left, home, end, page_up = "\ue014", "\ue012", "\ue011", "\ue010", "\ue00e"
        assert [press(key)[0] for key in (right, right, left, page_up, end, home)] == \
            [1, 2, 1, 1 + max(1, round(last / 20)), last, 0]
        press(" ")
        driver.implicitly_wait(5)
        driver.find_element("xpath", "//button[text()='Pause']")
        driver.execute_async_script("const done = arguments[0], s = document.getElementById('crack-slider');"
                                    "(function wait() { s.value > 2 ? done() : requestAnimationFrame(wait); })()")
        stopped = press(" ")[0]
        assert stopped > 2 and driver.find_element("id", "crack-play").text == "Play"
        choice = driver.find_element("id", "crack-choice")
        options = choice.find_elements("tag name", "option")
        assert [option.text.split(",")[0] for option in options] == ["spring", "spring", "fuse", "fuse"]
        options[-1].click()
        assert int(slider.get_property("max")) != last and state()[1][0] > 50
        assert complaints(driver) == []


def test_viewer_rings_a_bond_on_a_window_of_a_phone(report, tmp_path):
    """No part of the page is wider than a small window."""
    with open_page(report / "index.html", tmp_path / "profile") as driver:
        driver.set_window_size(520, 900)
        width, inside = driver.execute_script("return [document.documentElement.scrollWidth, window.innerWidth]")
        assert width <= inside
        assert driver.execute_script(COLOURED)[0] > 50 and complaints(driver) == []


# Missing or partial input

def test_one_sample_of_one_size(runs, tmp_path):
    succeed(tmp_path, "-lattice_size 6 -seed 9 -monitor none -output one.h5")
    result = script(tmp_path, "report.py", "one.h5", "-o", "report", "--resamples", 50)
    assert result.returncode == 0, result.stderr
    page = (tmp_path / "report" / "index.html").read_text()
    made = {path.stem for path in (tmp_path / "report" / "figures").glob("*.pdf")}
    assert {"response", "snapshots_spring", "segments_before"} <= made
    for name in set(figure_names(runs)) - made:
        assert f'id="{name}"><strong>{name}</strong> can\'t be made: ' in page
    assert "no fuse run" in page and 'id="crack-slider"' in page
    assert "damage_scaling: can't be made: springs: no spring run with 2 samples; fuses: no fuse run" in result.stdout


def test_run_still_going_on(runs, tmp_path):
    """Shards are read; the page says that the run is not over, and which samples it has."""
    shutil.copy(runs / "spring_6.h5", tmp_path / "run.h5")
    os.mkdir(tmp_path / "run.h5.shards")
    succeed(tmp_path, "-lattice_size 6 -seed 0 -first_sample 200 -samples 3 -monitor none -output run.h5.shards/7.h5")
    result = script(tmp_path, "figures.py", "damage_peak_cdf", "avalanches", "-i", "run.h5", "-o", "figures")
    assert result.returncode == 0, result.stderr
    assert "note: run.h5: the run is still going on or was interrupted; 203 finished samples so far" in result.stdout
    assert (tmp_path / "figures" / "damage_peak_cdf.pdf").is_file()


def test_run_without_failure_and_run_without_breaks(tmp_path):
    succeed(tmp_path, "-lattice_size 6 -samples 30 -seed 5 -stop breaks=12 -monitor none -output short.h5")
    result = script(tmp_path, "figures.py", "damage_failure_collapse", "damage_peak_cdf", "-i", "short.h5")
    assert result.returncode == 0 and (tmp_path / "damage_peak_cdf.pdf").is_file()
    assert "damage_failure_collapse: not made: springs: no spring run with 20 samples, -stop failure" in result.stdout
    succeed(tmp_path, "-lattice_size 6 -samples 30 -seed 6 -record none -monitor none -output bare.h5")
    result = script(tmp_path, "figures.py", "avalanches", "strength_cdf", "response", "-i", "bare.h5")
    assert result.returncode == 0 and (tmp_path / "strength_cdf.pdf").is_file()
    assert "avalanches: not made:" in result.stdout and "response: not made:" in result.stdout
    assert "-record breaks" in result.stdout


@pytest.mark.parametrize("arguments, words", [
    (["none.h5"], ["none.h5", "no such file"]),
    (["spring_6.h5", "clamped.h5"], ["clamped.h5", "-grips clamped", "sliding"]),
    (["spring_6.h5", "again.h5"], ["again.h5", "spring_6.h5", "same -seed"]),
    (["spring_6.h5", "--resamples", "3"], ["--resamples 3", "50"])])
def test_bad_input_is_told_in_one_line(runs, tmp_path, arguments, words):
    shutil.copy(runs / "spring_6.h5", tmp_path)
    shutil.copy(runs / "spring_6.h5", tmp_path / "again.h5")
    succeed(tmp_path, "-lattice_size 4 -grips clamped -seed 77 -monitor none -output clamped.h5")
    result = script(tmp_path, "report.py", *arguments)
    assert result.returncode == 1 and result.stderr.count("\n") == 1
    assert all(word in result.stderr for word in words), result.stderr
    assert not (tmp_path / "report").exists()


def test_unknown_figure_is_told_with_those_there_are(runs):
    result = script(runs, "figures.py", "crack", "-i", "spring_6.h5")
    assert result.returncode == 1 and "figure crack" in result.stderr and "size_effect" in result.stderr


def test_figures_are_the_same_again(runs, tmp_path):
    """Same runs, same bytes: also those with a bootstrap and random noise on integers."""
    for folder in ("one", "two"):
        result = script(runs, "figures.py", "damage_scaling", "damage_peak_collapse", "-i", "spring_*.h5", "-o",
                        tmp_path / folder)
        assert result.returncode == 0, result.stderr
    for name in ("damage_scaling", "damage_peak_collapse"):
        for ending in ("pdf", "png"):
            one, two = (np.fromfile(tmp_path / folder / f"{name}.{ending}", np.uint8) for folder in ("one", "two"))
            np.testing.assert_array_equal(one, two)
