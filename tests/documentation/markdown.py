"""What the tests of the documentation have to know of Markdown: fenced blocks, headings and links."""

import dataclasses
import pathlib
import re
import typing

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent


def pages() -> typing.List[pathlib.Path]:
    """The pages that users read, README.md first."""
    return [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md"))]


@dataclasses.dataclass
class Block:
    """A fenced block, or an HTML comment that stands alone on its lines (then info is "comment")."""

    line: int
    info: str
    text: str


def blocks(page: pathlib.Path) -> typing.List[Block]:
    """The fenced blocks and comments of a page, from top to bottom."""
    found: typing.List[Block] = []
    fence = None
    comment = None
    for number, line in enumerate(page.read_text().splitlines(), 1):
        if fence is not None:
            if line.strip() == fence:
                fence = None
            else:
                found[-1].text += line[indent:] + "\n"
        elif comment is not None:
            comment += " " + line.strip()
        elif opening := re.match(r"( *)(```+)(.*)$", line):
            indent, fence = len(opening[1]), opening[2]
            found.append(Block(number, opening[3].strip(), ""))
        elif line.lstrip().startswith("<!--"):
            comment, start = line.strip(), number
        if comment is not None and comment.endswith("-->"):
            found.append(Block(start, "comment", comment[4:-3].strip()))
            comment = None
    if fence is not None or comment is not None:
        raise SystemExit(f"{page}: a block or a comment does not end")
    return found


def prose(page: pathlib.Path) -> typing.Iterator[typing.Tuple[int, str]]:
    """The numbered lines outside of fenced blocks, without `code`."""
    fence = None
    for number, line in enumerate(page.read_text().splitlines(), 1):
        if fence is not None:
            if line.strip() == fence:
                fence = None
        elif opening := re.match(r" *(```+)", line):
            fence = opening[1]
        else:
            yield number, re.sub(r"`[^`]*`", "``", line)


def anchors(page: pathlib.Path) -> typing.Set[str]:
    """The anchors that GitHub and MyST make of a page's headings."""
    found: typing.Set[str] = set()
    fence = None
    for line in page.read_text().splitlines():
        if fence is not None:
            if line.strip() == fence:
                fence = None
        elif opening := re.match(r" *(```+)", line):
            fence = opening[1]
        elif heading := re.match(r"#+ +(.*?) *$", line):
            slug = re.sub(r"[^\w\- ]", "", heading[1].lower()).replace(" ", "-")
            unique, count = slug, 0
            while unique in found:
                count += 1
                unique = f"{slug}-{count}"
            found.add(unique)
    return found
