#!/usr/bin/python3
"""Every link in README.md, CONTRIBUTING.md, CHANGELOG.md and docs/*.md leads to a file, and to a heading of it, that is
there; files of docs/ that a page names in its text exist, too."""

import re
import sys
import urllib.parse

import markdown


def main() -> None:
    wrong = []
    num_links = 0
    for page in markdown.pages():
        # A link may begin on one line and end on the next.
        lines = list(markdown.prose(page))
        text = "\n".join(line for _, line in lines)
        for link in re.finditer(r"\]\(\s*([^)\s]+)[^)]*\)", text):
            line = lines[text.count("\n", 0, link.start())][0]
            target = link[1].strip("<>")
            if re.match(r"[a-z]+:", target):
                continue
            num_links += 1
            path, _, anchor = urllib.parse.unquote(target).partition("#")
            file = (page.parent / path).resolve() if path else page
            place = f"{page.relative_to(markdown.ROOT)}:{line}"
            if not file.exists():
                wrong.append(f"{place}: there is no {target}")
            elif markdown.ROOT not in file.parents:
                wrong.append(f"{place}: {target} leads out of the sources")
            elif anchor and anchor not in markdown.anchors(file):
                wrong.append(f"{place}: {path or page.name} has no heading #{anchor}")
        for number, line in enumerate(page.read_text().splitlines(), 1):
            for name in re.findall(r"(?<![\w/.-])docs/[\w/]+\.(?:md|png|svg|csv)", line):
                if not (markdown.ROOT / name).exists():
                    wrong.append(f"{page.relative_to(markdown.ROOT)}:{number}: there is no {name}")
    print("\n".join(wrong), file=sys.stderr)
    print(f"{num_links} links within the sources, {len(wrong)} of them wrong")
    if wrong or num_links < 20:
        sys.exit(1)


main()
