"""The table as CSV and the page that shows everything."""

import base64
import csv
import html
from io import BytesIO
from pathlib import Path

from matplotlib import pyplot as plt
from matplotlib.figure import Figure

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 1180px; margin: 2em auto; padding: 0 1em;
       color: #1a1a1a; }
h1 { font-size: 1.5em; } h2 { font-size: 1.15em; margin-top: 2em; }
table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; }
th, td { padding: 4px 9px; text-align: right; border-bottom: 1px solid #ddd; }
th { border-bottom: 2px solid #888; vertical-align: bottom; font-weight: 600; }
td:first-child, th:first-child { text-align: left; white-space: nowrap; }
tr:hover td { background: #f4f7fb; }
img { max-width: 100%; } figure { margin: 1em 0; } figcaption { color: #555; font-size: 13px; }
pre { background: #f5f5f5; padding: .7em; overflow-x: auto; font-size: 12px; }
.scroll { overflow-x: auto; }
"""


def write_csv(path: Path, columns: list[str], rows: list[dict]) -> None:
    partial = path.with_suffix(".partial")
    with open(partial, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns, restval="")
        writer.writeheader()
        writer.writerows(rows)
    partial.replace(path)


def text_of(value: object) -> str:
    if value is None or value == "":
        return "-"
    if isinstance(value, float):
        return f"{value:.4f}" if abs(value) < 1 else f"{value:,.1f}"
    if isinstance(value, int):
        return f"{value:,}"
    return str(value)


class Page:
    """Collects sections; figures are also kept as PNG files."""

    def __init__(self, title: str, figures: Path):
        self.title = title
        self.figures = figures
        self.parts: list[str] = []
        figures.mkdir(parents=True, exist_ok=True)

    def heading(self, text: str) -> None:
        self.parts.append(f"<h2>{html.escape(text)}</h2>")

    def paragraph(self, text: str) -> None:
        self.parts.append(f"<p>{html.escape(text)}</p>")

    def code(self, text: str) -> None:
        self.parts.append(f"<pre>{html.escape(text)}</pre>")

    def table(self, columns: list[str], rows: list[dict]) -> None:
        head = "".join(f"<th>{html.escape(c)}</th>" for c in columns)
        body = "".join(
            "<tr>" + "".join(f"<td>{html.escape(text_of(row.get(c)))}</td>" for c in columns)
            + "</tr>" for row in rows)
        self.parts.append(f'<div class="scroll"><table><thead><tr>{head}</tr></thead>'
                          f"<tbody>{body}</tbody></table></div>")

    def figure(self, name: str, figure: Figure, caption: str) -> None:
        data = BytesIO()
        figure.savefig(data, format="png")
        plt.close(figure)
        (self.figures / f"{name}.png").write_bytes(data.getvalue())
        encoded = base64.b64encode(data.getvalue()).decode()
        self.parts.append(f'<figure><img alt="{html.escape(caption)}" '
                          f'src="data:image/png;base64,{encoded}">'
                          f"<figcaption>{html.escape(caption)}</figcaption></figure>")

    def write(self, path: Path) -> None:
        partial = path.with_suffix(".partial")
        partial.write_text(
            f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
            f"<title>{html.escape(self.title)}</title><style>{STYLE}</style></head><body>"
            f"<h1>{html.escape(self.title)}</h1>\n" + "\n".join(self.parts) + "</body></html>\n",
            encoding="utf-8")
        partial.replace(path)
