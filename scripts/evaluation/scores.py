"""How well a descriptor tells edges from non-edges, and what the graph itself tells."""

from collections import Counter, deque
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .truth import Truth

MAX_NUM_PAIRS = 600_000
BLOCK = 8192  # Pairs whose vectors are gathered at a time.
UNREACHABLE = 10**6


@dataclass
class Scores:
    """Scores of pairs of images; greater is more alike."""

    name: str
    edges: np.ndarray
    non_edges: np.ndarray  # All of them, or a random sample.
    axis: str
    # How many non-edges there are for each one that is scored.
    non_edges_each: float = 1.0


def edge_keys(truth: Truth) -> np.ndarray:
    return truth.edges[:, 0] * len(truth.names) + truth.edges[:, 1]


def pairs_to_score(truth: Truth, seed: int) -> tuple[np.ndarray, np.ndarray, float]:
    """The rows and columns of all non-edges, or of a sample of them if there are too many; and how
    many there are for each of these."""
    count = len(truth.names)
    if count * (count - 1) // 2 <= MAX_NUM_PAIRS:
        rows, columns = np.triu_indices(count, 1)
    else:
        random = np.random.default_rng(seed)
        rows, columns = np.sort(random.integers(0, count, (2, MAX_NUM_PAIRS)), axis=0)
        rows, columns = np.divmod(np.unique(rows * count + columns), count)
    is_non_edge = (rows != columns) & ~np.isin(rows * count + columns, edge_keys(truth))
    num_non_edges = count * (count - 1) // 2 - len(truth.edges)
    return rows[is_non_edge], columns[is_non_edge], num_non_edges / max(1, is_non_edge.sum())


def read_vectors(path: Path, names: list[str]) -> np.ndarray:
    """Rows of unit length in the order of the names; zero where there is no vector."""
    rows = np.load(path, mmap_mode="r")
    given = path.with_suffix(".txt").read_text(encoding="utf-8", errors="surrogateescape")
    place = {name: i for i, name in enumerate(given.split("\n"))}
    vectors = np.zeros((len(names), rows.shape[1]), np.float32)
    for i, name in enumerate(names):
        if name in place:
            vectors[i] = rows[place[name]]
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(lengths > 0, lengths, 1)


def vector_scores(name: str, vectors: np.ndarray, truth: Truth, seed: int) -> Scores:
    def distances(rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        blocks = [np.einsum("ij,ij->i", vectors[rows[i:i + BLOCK]], vectors[columns[i:i + BLOCK]])
                  for i in range(0, len(rows), BLOCK)]
        return 2 - 2 * np.concatenate(blocks)

    rows, columns, non_edges_each = pairs_to_score(truth, seed)
    return Scores(name, -distances(truth.edges[:, 0], truth.edges[:, 1]),
                  -distances(rows, columns), "squared distance", non_edges_each)


def list_scores(name: str, lists: Path, truth: Truth, seed: int) -> Scores:
    """Of ranked lists: the greater of the two scores of a pair, 0 where it is not listed."""
    index = {image: i for i, image in enumerate(truth.names)}
    matrix = np.zeros((len(truth.names), len(truth.names)), np.float32)
    with open(lists, encoding="utf-8", errors="surrogateescape", newline="\n") as file:
        for line in file:
            image, other, score = line.rstrip("\n").split("\t")
            if image in index and other in index:
                matrix[index[image], index[other]] = float(score)
    matrix = np.maximum(matrix, matrix.T)
    rows, columns, non_edges_each = pairs_to_score(truth, seed)
    return Scores(name, matrix[truth.edges[:, 0], truth.edges[:, 1]], matrix[rows, columns],
                  "score", non_edges_each)


def roc(scores: Scores) -> tuple[np.ndarray, np.ndarray]:
    """False and true positive rates for every threshold, from (0, 0) to (1, 1)."""
    values = np.concatenate([scores.edges, scores.non_edges])
    is_edge = np.zeros(len(values), bool)
    is_edge[:len(scores.edges)] = True
    order = np.argsort(-values, kind="stable")
    values, is_edge = values[order], is_edge[order]
    last_of_value = np.append(values[1:] != values[:-1], True)
    true = np.cumsum(is_edge)[last_of_value] / len(scores.edges)
    false = np.cumsum(~is_edge)[last_of_value] / len(scores.non_edges)
    return np.append(0, false), np.append(0, true)


def area_under_roc(scores: Scores) -> float:
    false, true = roc(scores)
    return float(np.sum(np.diff(false) * (true[1:] + true[:-1]) / 2))


def average_precision(scores: Scores) -> float:
    """The mean precision at the edges, of equal scores all at once."""
    false, true = roc(scores)
    num_true = true * len(scores.edges)
    num_false = false * len(scores.non_edges) * scores.non_edges_each
    precision = num_true[1:] / (num_true[1:] + num_false[1:])
    return float(np.sum(np.diff(true) * precision))


def modified_graph_distances(truth: Truth) -> tuple[Counter, Counter]:
    """How many edges and non-edges there are at every distance in the graph.

    The distance of an edge is that without the edge itself (GraphMatch, section 3.3).
    """
    neighbors = truth.adjacency()

    def distance_without_edge(a: int, b: int) -> int:
        if neighbors[a] & neighbors[b]:
            return 2
        seen, queue = {a}, deque([(a, 0)])
        while queue:
            vertex, length = queue.popleft()
            for other in neighbors[vertex]:
                if vertex == a and other == b:
                    continue
                if other == b:
                    return length + 1
                if other not in seen:
                    seen.add(other)
                    queue.append((other, length + 1))
        return UNREACHABLE

    edges = Counter(distance_without_edge(int(a), int(b)) for a, b in truth.edges)
    non_edges: Counter = Counter()
    count = len(truth.names)
    num_reached = 0
    for a in range(count):
        seen, queue = {a}, deque([(a, 0)])
        while queue:
            vertex, length = queue.popleft()
            for other in neighbors[vertex]:
                if other not in seen:
                    seen.add(other)
                    queue.append((other, length + 1))
                    if other > a and length + 1 > 1:
                        non_edges[length + 1] += 1
                        num_reached += 1
    non_edges[UNREACHABLE] = count * (count - 1) // 2 - len(truth.edges) - num_reached
    return edges, non_edges
