#!/usr/bin/python3
"""check_site.py OUTPUT: builds the site with scripts/docs and looks at what came out: a page for every page of docs/,
nothing that is loaded from the network, and no link within the site that leads nowhere. Exit code 77 if Sphinx, MyST
or the theme is not installed."""

import html.parser
import importlib.util
import pathlib
import re
import shutil
import subprocess
import sys
import urllib.parse

import markdown

# What makes a browser load something by itself. <a> and <link rel="canonical"> do not.
LOADING = {"script": "src", "img": "src", "iframe": "src", "source": "src", "object": "data", "link": "href"}
NOT_LOADED = {"canonical", "search", "next", "prev", "index"}


class Page(html.parser.HTMLParser):
    """The ids, links and loaded addresses of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids = set()
        self.links = []
        self.loaded = []
        self.feed(text)

    def handle_starttag(self, tag, attributes) -> None:
        values = dict(attributes)
        if "id" in values:
            self.ids.add(values["id"])
        if tag == "a" and values.get("href"):
            self.links.append(values["href"])
        address = values.get(LOADING.get(tag, ""))
        if address and not (tag == "link" and values.get("rel") in NOT_LOADED):
            self.loaded.append(address)


def main() -> None:
    output = pathlib.Path(sys.argv[1]).resolve()
    missing = [name for name in ("sphinx", "myst_parser", "furo") if importlib.util.find_spec(name) is None]
    if missing:
        print(f"Not installed: {', '.join(missing)}")
        sys.exit(77)
    shutil.rmtree(output, ignore_errors=True)
    shutil.rmtree(f"{output}.doctrees", ignore_errors=True)
    subprocess.run([markdown.ROOT / "scripts/docs", "--output", output], check=True)

    wrong = []
    site = {file: Page(file.read_text()) for file in output.rglob("*.html")}
    for source in (markdown.ROOT / "docs").glob("*.md"):
        if output / f"{source.stem}.html" not in site:
            wrong.append(f"there is no page of {source.name}")
    for file, page in site.items():
        for address in page.loaded:
            parts = urllib.parse.urlsplit(address)
            if parts.scheme == "data":
                continue
            if parts.scheme or parts.netloc:
                wrong.append(f"{file.name} loads {address}")
            elif not (file.parent / urllib.parse.unquote(parts.path)).exists():
                wrong.append(f"{file.name} loads {address}, which is not there")
        for address in page.links:
            parts = urllib.parse.urlsplit(address)
            if parts.scheme or parts.netloc:
                continue
            target = (file.parent / urllib.parse.unquote(parts.path)).resolve() if parts.path else file
            anchor = urllib.parse.unquote(parts.fragment)
            if not target.exists():
                wrong.append(f"{file.name} links to {address}, which is not there")
            elif anchor and target in site and anchor not in site[target].ids:
                wrong.append(f"{file.name} links to {address}, which has no such heading")
    for file in [*output.rglob("*.css"), *output.rglob("*.html")]:
        for address in re.findall(r"(?:@import\s+|url\()[\"']?((?:https?:)?//[^\"')\s]+)", file.read_text()):
            wrong.append(f"{file.name} loads {address}")
    print("\n".join(wrong), file=sys.stderr)
    print(f"{len(site)} pages, {len(wrong)} faults")
    if wrong or not site:
        sys.exit(1)


main()
