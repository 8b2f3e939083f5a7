"""The finished matching graph that everything is held against."""

import contextlib
import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .database import MAX_NUM_IMAGES, MIN_NUM_INLIERS, NO_EDGE_CONFIGS, open_readonly
from .errors import EvaluationError


@dataclass
class Truth:
    """Edges between the images `names`, as rows of two indices, with their inliers."""

    names: list[str]
    edges: np.ndarray  # E x 2, the smaller index first
    inliers: np.ndarray  # E

    def adjacency(self) -> list[set[int]]:
        neighbors: list[set[int]] = [set() for _ in self.names]
        for a, b in self.edges:
            neighbors[a].add(int(b))
            neighbors[b].add(int(a))
        return neighbors

    def named_edges(self) -> set[tuple[str, str]]:
        return {tuple(sorted((self.names[a], self.names[b]))) for a, b in self.edges}


def is_database(path: Path) -> bool:
    with open(path, "rb") as file:
        return file.read(16) == b"SQLite format 3\0"


def rows_of_database(path: Path):
    """(name1, name2, inliers, config, matches) of every tested pair."""
    with contextlib.closing(open_readonly(path)) as connection:
        names = dict(connection.execute("SELECT image_id, name FROM images"))
        matches = dict(connection.execute("SELECT pair_id, rows FROM matches"))
        for key, inliers, config in connection.execute(
            "SELECT pair_id, rows, config FROM two_view_geometries ORDER BY pair_id"
        ):
            id1, id2 = divmod(key, MAX_NUM_IMAGES)
            if id1 in names and id2 in names:
                yield names[id1], names[id2], inliers, config, matches.get(key, inliers)


def rows_of_text(path: Path):
    """The same of a text file: names, inliers, and perhaps config and matches, between tabs."""
    may_be_header = True
    with open(path, newline="", encoding="utf-8", errors="surrogateescape") as file:
        for number, line in enumerate(file, 1):
            fields = line.rstrip("\r\n").split("\t")
            if not line.strip() or line.startswith("#"):
                continue
            try:
                inliers = int(fields[2])
                config = int(fields[3]) if len(fields) > 3 else 2
                matches = int(fields[4]) if len(fields) > 4 else inliers
            except (IndexError, ValueError):
                if may_be_header:
                    may_be_header = False
                    continue
                raise EvaluationError(
                    f'Line {number} of {path} is not "image1<tab>image2<tab>inliers".'
                ) from None
            may_be_header = False
            yield fields[0], fields[1], inliers, config, matches


def read_truth(path: Path, names: list[str]) -> Truth:
    if not path.is_file():
        raise EvaluationError(f"There is no truth {path}.")
    index = {name: i for i, name in enumerate(names)}
    inliers_of: dict[tuple[int, int], int] = {}
    rows = rows_of_database(path) if is_database(path) else rows_of_text(path)
    for name1, name2, inliers, config, _ in rows:
        if name1 in index and name2 in index and name1 != name2:
            a, b = sorted((index[name1], index[name2]))
            inliers_of[a, b] = 0 if config in NO_EDGE_CONFIGS else inliers  # The last one counts.
    inliers_of = {pair: n for pair, n in inliers_of.items() if n >= MIN_NUM_INLIERS}
    if not inliers_of:
        raise EvaluationError(
            f"{path} has no edge between images of the database. Are the names the same?"
        )
    pairs = sorted(inliers_of)
    return Truth(names, np.array(pairs), np.array([inliers_of[pair] for pair in pairs]))


def export(database: Path, target: Path) -> None:
    """Every pair with enough matches to be verified, edge or not: replays need both."""
    with contextlib.closing(open_readonly(database)) as connection:
        for (name,) in connection.execute("SELECT name FROM images"):
            if name.startswith(("#", " ")) or set(name) & set("\t\r\n"):
                raise EvaluationError(
                    f"{database}: the image name {name!r} begins like a comment or has a tab or a "
                    "line end in it; a list of edges cannot have it.")
    partial = target.with_suffix(".partial")
    with open(partial, "w", newline="", encoding="utf-8", errors="surrogateescape") as file:
        writer = csv.writer(file, delimiter="\t", lineterminator="\n", quoting=csv.QUOTE_NONE,
                            quotechar=None, escapechar=None)
        file.write(f"# Pairs with {MIN_NUM_INLIERS} matches or more.\n")
        writer.writerow(["photo1", "photo2", "inliers", "config", "matches"])
        for row in rows_of_database(database):
            if row[4] >= MIN_NUM_INLIERS:
                writer.writerow(row)
    partial.replace(target)
