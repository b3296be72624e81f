#!/usr/bin/env python3
"""A report of run files: one page that opens offline in any browser, figures as PDF and PNG, tables as CSV.

    report.py spring_*.h5 fuse_*.h5 -o report

leaves report/index.html (self-contained), report/figures/ and report/tables/. Any number of run files, of any
sizes and both models, finished or still going on; what can't be made from them is named in the page with the reason.
"""
import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))  # this folder's package, installed or not
from crackle.needs import need

need("h5py", "matplotlib", "numpy", "scipy")
from crackle.page.report import make_report
from crackle.statistics.bootstrap import RESAMPLES
from crackle.study import read_study


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
