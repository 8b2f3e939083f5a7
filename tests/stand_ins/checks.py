"""Stand-ins for programs that Debian does not have: they take the options of the real ones, look at what they are
given as those would, and say what they found. They make no models."""

import argparse
import pathlib
import sqlite3
import sys
import typing


def refuse(text: str) -> typing.NoReturn:
    print(f"stand-in: {text}", file=sys.stderr)
    sys.exit(1)


def global_mapper(program: str, arguments: typing.List[str]) -> None:
    """GLOMAP's mapper and COLMAP 4's global_mapper: a database with verified pairs, its images, an output."""
    parser = argparse.ArgumentParser(prog=program, allow_abbrev=False)
    for option in ("--database_path", "--image_path", "--output_path"):
        parser.add_argument(option, required=True, type=pathlib.Path)
    options = parser.parse_args(arguments)
    if not options.database_path.is_file():
        refuse(f"there is no database {options.database_path}")
    database = sqlite3.connect(f"file:{options.database_path}?mode=ro", uri=True)
    names = [name for name, in database.execute("SELECT name FROM images")]
    for name in names:
        if not (options.image_path / name).is_file():
            refuse(f"there is no {options.image_path / name}")
    # What global mapping uses of a pair: inliers of an essential matrix, a fundamental matrix or a homography.
    verified = database.execute("SELECT pair_id, rows, length(data) FROM two_view_geometries "
                                "WHERE config BETWEEN 2 AND 6 AND rows >= 15").fetchall()
    if not verified:
        refuse(f"{options.database_path} has no verified pair")
    for pair_id, rows, length in verified:
        if length != 8 * rows:
            refuse(f"pair {pair_id} has {length} bytes of {rows} inliers")
    options.output_path.mkdir(parents=True, exist_ok=True)
    print(f"stand-in for {program}: {len(names)} images, {len(verified)} verified pairs")
