"""COLMAP databases, as far as an evaluation reads, copies and thins them."""

import contextlib
import sqlite3
from pathlib import Path

from .errors import EvaluationError

MAX_NUM_IMAGES = 2147483647
# Undefined, degenerate, and a watermark: COLMAP does not take such pairs for edges.
NO_EDGE_CONFIGS = (0, 1, 7)
MIN_NUM_INLIERS = 15


def open_readonly(path: Path) -> sqlite3.Connection:
    if not path.is_file():
        raise EvaluationError(f"There is no database {path}.")
    try:
        connection = sqlite3.connect(path.resolve().as_uri() + "?mode=ro", uri=True)
        connection.execute("SELECT image_id, name FROM images LIMIT 1").fetchall()
    except sqlite3.Error as error:
        raise EvaluationError(f"{path} cannot be read as a COLMAP database: {error}.") from error
    return connection


def read_names(path: Path) -> list[str]:
    """The names of the images with features, by ascending id."""
    with contextlib.closing(open_readonly(path)) as connection:
        names = [
            name
            for (name,) in connection.execute(
                "SELECT name FROM images WHERE image_id IN "
                "(SELECT image_id FROM descriptors WHERE rows > 0) ORDER BY image_id"
            )
        ]
    if not names:
        raise EvaluationError(
            f"No image of {path} has features. Run `colmap feature_extractor` first."
        )
    return names


def copy_features(source: Path, target: Path) -> None:
    """A copy without matches. Other programs may have the source open."""
    partial = target.with_suffix(".partial")
    partial.unlink(missing_ok=True)
    copy = sqlite3.connect(partial)
    with contextlib.closing(open_readonly(source)) as connection:
        connection.backup(copy)
    copy.execute("DELETE FROM matches")
    copy.execute("DELETE FROM two_view_geometries")
    copy.commit()
    copy.close()
    partial.replace(target)


def pair_id(image_id1: int, image_id2: int) -> int:
    return min(image_id1, image_id2) * MAX_NUM_IMAGES + max(image_id1, image_id2)


def keep_pairs(source: Path, target: Path, pairs: set[tuple[str, str]]) -> int:
    """Copies a matched database with these pairs alone, by names; returns how many it has."""
    partial = target.with_suffix(".partial")
    partial.unlink(missing_ok=True)
    copy = sqlite3.connect(partial)
    with contextlib.closing(open_readonly(source)) as connection:
        connection.backup(copy)
    ids = {name: image_id for image_id, name in copy.execute("SELECT image_id, name FROM images")}
    copy.execute("CREATE TEMP TABLE kept (pair_id INTEGER PRIMARY KEY)")
    copy.executemany(
        "INSERT OR IGNORE INTO kept VALUES (?)",
        ((pair_id(ids[a], ids[b]),) for a, b in pairs if a in ids and b in ids),
    )
    for table in ("two_view_geometries", "matches"):
        copy.execute(f"DELETE FROM {table} WHERE pair_id NOT IN (SELECT pair_id FROM kept)")
    count = copy.execute("SELECT count(*) FROM two_view_geometries").fetchone()[0]
    copy.commit()
    copy.close()
    partial.replace(target)
    return count
