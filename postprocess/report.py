#!/usr/bin/env python3
"""A report of run files: one page that opens offline in any browser, figures as PDF and PNG, tables as CSV.

    report.py spring_*.h5 fuse_*.h5 -o report

leaves report/index.html (self-contained), report/figures/ and report/tables/. Any number of run files, of any
sizes and both models, finished or still going on; what can't be made from them is named in the page with the reason.
"""
import argparse
import os
from pathlib import Path

from bootstrap import RESAMPLES
from figures import FIGURES, make_figure
from report_page import html_figure, html_missing, html_page, html_table, html_viewer
from report_viewer import viewer_samples
from study import Missing, read_study
from tables import TABLES


def make_tables(study, folder):
    """Writes every table as CSV; returns them as HTML: the exponents, the paper's two, the rest folded away."""
    os.makedirs(folder, exist_ok=True)
    pages = []
    for make in TABLES:
        table = make(study)
        table.write(os.path.join(folder, f"{table.name}.csv"))
        pages.append(html_table(table) if table.rows
                     else html_missing(table.title, "too few samples, or no /breaks"))
    return "".join(pages[:3]) + "<details><summary>Goodness of fit, likelihood ratios, normality, avalanches by size" \
        "</summary>" + "".join(pages[3:]) + "</details>"


def make_figures(study, folder, tell):
    """Makes every figure that can be made; returns a list of (section, HTML)."""
    sections = {}
    for name, kind in FIGURES.items():
        try:
            notes = make_figure(study, name, folder)
            page = html_figure(name, kind, os.path.join(folder, f"{name}.png"), notes)
            tell(f"{name}" + "".join(f"\n  without {note}" for note in notes))
        except Missing as reason:
            page = html_missing(name, str(reason))
            tell(f"{name}: can't be made: {reason}")
        sections[kind.section] = sections.get(kind.section, "") + page
    return list(sections.items())


def make_report(study, folder, tell=print):
    """Leaves the whole report in `folder`; returns the path of its page."""
    folder = Path(folder)
    for remark in study.remarks:
        tell(f"note: {remark}")
    figures = make_figures(study, folder / "figures", tell)
    tables = make_tables(study, folder / "tables")
    sections = [("Tables", tables), ("A crack, break by break", html_viewer(viewer_samples(study))), *figures]
    page = folder / "index.html"
    page.write_text(html_page(study, sections), encoding="utf-8")
    return page


def main():
    parser = argparse.ArgumentParser(description="A report of run files: a page, figures, tables.")
    parser.add_argument("runs", metavar="RUN.h5", nargs="+", help="run files or patterns")
    parser.add_argument("-o", "--output", default="report", metavar="FOLDER", help="default: report")
    parser.add_argument("--resamples", type=int, default=RESAMPLES, metavar="N",
                        help=f"of the bootstrap, 50 or more; default: {RESAMPLES}")
    arguments = parser.parse_args()
    try:
        if arguments.resamples < 50:
            raise ValueError(f"--resamples {arguments.resamples}: 50 or more")
        page = make_report(read_study(arguments.runs, arguments.resamples), arguments.output)
    except (ValueError, OSError) as error:
        raise SystemExit(f"report.py: {error}") from error
    print(page)


if __name__ == "__main__":
    main()
