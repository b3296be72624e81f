"""The page of a report: one HTML file that needs nothing else, pictures, viewer and data inside."""
import base64
import json
from html import escape
from pathlib import Path

ASSETS = Path(__file__).resolve().parent / "assets"

VIEWER = """<section id="crack" aria-label="crack viewer">
<div class="controls">
<label>Sample <select id="crack-choice"></select></label>
<button id="crack-play" type="button">Play</button>
<button id="crack-peak" type="button">To the peak</button>
<label>Speed <select id="crack-speed"><option value="0.25">1/4</option><option value="1" selected>1</option>
<option value="4">4</option></select></label>
<input id="crack-slider" type="range" min="0" value="0" step="1" aria-label="number of broken bonds">
</div>
<p id="crack-status" role="status"></p>
<div class="views">
<canvas id="crack-lattice" tabindex="0" role="img" aria-label="broken bonds on the lattice"></canvas>
<canvas id="crack-curve" role="img" aria-label="load against displacement"></canvas>
</div>
<p>Broken before the peak, early to late:
<span class="key" style="background:linear-gradient(90deg,rgb(140,205,245),rgb(8,48,130))"></span>
after it: <span class="key" style="background:linear-gradient(90deg,rgb(255,190,60),rgb(170,20,10))"></span>.
Ring and dot: the last break. Line: the envelope, what a machine measures that only increases the displacement.<br>
Keys: space plays, arrows step (with Shift by ten), Page Up and Down, Home, End; P goes to the peak.</p>
</section>
<script type="application/json" id="crack-data">%s</script>
<script>%s</script>
"""


def html_table(table):
    """A Table as HTML; the column `agree` is coloured."""
    def cell(column, value):
        kind = f' class="{value}"' if column == "agree" and value in ("yes", "no") else ""
        return f"<td{kind}>{escape(str(value))}</td>"

    head = "".join(f"<th>{escape(column)}</th>" for column in table.columns)
    body = "\n".join("<tr>" + "".join(map(cell, table.columns, row)) + "</tr>" for row in table.rows)
    return (f'<h3 id="table-{table.name}">{escape(table.title)}</h3>\n<div class="scroll"><table>\n'
            f'<thead><tr>{head}</tr></thead>\n'
            f"<tbody>\n{body}\n</tbody></table></div>\n<p>{escape(table.note)} "
            f'<a href="tables/{table.name}.csv">CSV</a></p>\n')


def html_figure(name, kind, picture, notes):
    """A figure with its caption and links to the files beside the page."""
    data = base64.b64encode(Path(picture).read_bytes()).decode()
    origin = f"the paper's {kind.paper}" if kind.paper else "beyond the paper"
    missing = "".join(f'<p class="missing">{escape(note)}</p>' for note in notes)
    caption = escape(kind.draw.__doc__.strip())
    return (f'<figure id="{name}"><img alt="{caption}" src="data:image/png;base64,{data}">\n<figcaption>'
            f'<strong>{name}</strong> ({escape(origin)}). {caption} <a href="figures/{name}.pdf">PDF</a> '
            f'<a href="figures/{name}.png">PNG</a></figcaption>{missing}</figure>\n')


def html_missing(name, reason):
    return f'<p class="missing" id="{name}"><strong>{escape(name)}</strong> can\'t be made: {escape(reason)}</p>\n'


def html_viewer(samples):
    """The crack viewer with its data; a line that says so when there is no sample to show."""
    if not samples:
        return html_missing("crack viewer", "no run with -record breaks")
    data = json.dumps(samples).replace("</", "<\\/")
    return VIEWER % (data, (ASSETS / "viewer.js").read_text(encoding="utf-8"))


def html_page(study, sections):
    """The whole page. sections: list of (title, HTML)."""
    runs = ", ".join(f"{e.model} L = {e.size} ({len(e)})" for e in study.all())
    remarks = "".join(f"<li>{escape(remark)}</li>" for remark in study.remarks)
    anchors = [(title, f"section-{number}") for number, (title, _) in enumerate(sections)]
    nav = "".join(f'<a href="#{anchor}">{escape(title)}</a>' for title, anchor in anchors)
    body = "".join(f'<div id="{anchor}"><h2>{escape(title)}</h2>{html}</div>\n'
                   for (title, anchor), (_, html) in zip(anchors, sections))
    css = (ASSETS / "page.css").read_text(encoding="utf-8")
    return (f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
            f'<meta name="viewport" content="width=device-width, initial-scale=1">\n<link rel="icon" href="data:,">\n'
            f"<title>crackle: fracture of disordered lattices</title>\n<style>\n{css}</style>\n</head>\n<body>\n"
            f"<h1>Fracture of disordered lattices</h1>\n<p>Random spring and random fuse networks broken bond by bond by "
            f"crackle, beside Nukala, Zapperi, Simunovic, Phys. Rev. E 71 (2005) 066106. Samples: {escape(runs)}.</p>\n"
            + (f'<ul class="notes">{remarks}</ul>\n' if remarks else "")
            + f"<nav>{nav}</nav>\n{body}</body>\n</html>\n")
