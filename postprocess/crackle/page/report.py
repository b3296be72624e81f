"""The report of a study: one page that needs nothing else, figures as PDF and PNG, tables as CSV."""
import os
from pathlib import Path

from crackle.figures.catalogue import FIGURES, make_figure
from crackle.page.markup import html_figure, html_missing, html_page, html_table, html_viewer
from crackle.page.viewer import viewer_samples
from crackle.study.ensembles import Missing
from crackle.study.tables import TABLES


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
