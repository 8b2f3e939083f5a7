"""COLMAP's vocabulary tree: learning one, and the ranked lists that it gives."""

import contextlib
import re
from pathlib import Path

from .database import open_readonly
from .errors import EvaluationError
from .runs import Step, run_logged, stamp_of

# Later versions than 3.8 write what glog puts before a line.
ANSWER = re.compile(r"(?:[IWE]\d{8} [^\]]*\])?\s*image_id=(\d+), image_name=(.*), score=([-+0-9.eE]+)\s*$")
QUERY = re.compile(r"Querying for image (.*) \[(\d+)/(\d+)\]")

# Images in a ranked list at most.
NUM_LISTED = 1000


def build_tree(colmap: str, database: Path, stamp: str, tree: Path) -> float:
    """Learns a tree from the images themselves; returns the seconds it took.

    stamp: of the database's contents. COLMAP writes to any database that it opens.
    """
    step = Step(tree.with_suffix(".step.json"), stamp_of("tree", colmap, stamp))
    kept = step.result()
    if kept is None or not tree.exists():
        seconds = run_logged([colmap, "vocab_tree_builder", "--database_path", str(database),
                              "--vocab_tree_path", str(tree)], tree.with_suffix(".log"))
        kept = step.keep({"seconds": seconds})
    return kept["seconds"]


def parse_answers(text: str, names: dict[int, str]) -> list[tuple[str, str, float]]:
    """(image, other image, score) of what `colmap vocab_tree_retriever` prints."""
    answers = []
    query = None
    for line in text.split("\n"):
        asked = QUERY.search(line)
        if asked:
            query = asked.group(1)
            continue
        found = ANSWER.match(line)
        if not found:
            continue
        if query is None:
            raise EvaluationError(
                "The output of `colmap vocab_tree_retriever` begins with an answer: this version "
                "of COLMAP writes it in another way than 3.8 does."
            )
        other = names[int(found.group(1))]
        if other != query:
            answers.append((query, other, float(found.group(3))))
    return answers


def retrieve(colmap: str, database: Path, stamp: str, tree: Path, lists: Path) -> float:
    """Writes the ranked lists of all images; returns the seconds, indexing included."""
    step = Step(lists.with_suffix(".step.json"), stamp_of("lists", colmap, stamp, tree))
    kept = step.result()
    if kept is None or not lists.exists():
        log = lists.with_suffix(".log")
        seconds = run_logged([colmap, "vocab_tree_retriever", "--database_path", str(database),
                              "--vocab_tree_path", str(tree), "--num_images",
                              str(NUM_LISTED)], log)
        with contextlib.closing(open_readonly(database)) as connection:
            names = dict(connection.execute("SELECT image_id, name FROM images"))
        answers = parse_answers(log.read_text(encoding="utf-8", errors="surrogateescape"), names)
        if not answers:
            raise EvaluationError(f"`colmap vocab_tree_retriever` gave no answer, see {log}.")
        partial = lists.with_suffix(".partial")
        with open(partial, "w", encoding="utf-8", errors="surrogateescape") as file:
            for image, other, score in answers:
                file.write(f"{image}\t{other}\t{score}\n")
        partial.replace(lists)
        kept = step.keep({"seconds": seconds})
    return kept["seconds"]
