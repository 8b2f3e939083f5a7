"""A proposal for choosing pairs, tried on finished graphs: test the likeliest pairs first.

How likely a pair is an edge is estimated by logistic regression over what is known of it before it
is tested: the product of its vectors, its ranks in both lists, how many neighbours its images have
in common, and how often a neighbour of one was tested against the other in vain. The regression is
learnt anew after every batch from the pairs that this very run has tested. Dense matrices: for
collections of a few thousand images.
"""

import numpy as np

from .truth import Truth

MAX_NUM_IMAGES = 3000
BATCH = 300
NUM_STEPS = 8
NUM_EXAMPLES = 20_000
# What the regression starts from and is drawn to: constant, product, logarithms of the smaller and
# the greater rank, of common neighbours and of failures, common / (common + failures + 1), whether
# there is a common neighbour, product of the two logarithms.
PRIOR = np.array([0.0, 4.0, -0.6, -0.4, 1.0, -0.5, 2.0, 0.5, 0.0])
# Added to the log-odds of pairs with a common neighbour: closing what was begun comes first.
CLOSING = 1.0


def fit(inputs: np.ndarray, outcomes: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Newton's method, with a normal distribution around the prior."""
    for _ in range(NUM_STEPS):
        likely = 1 / (1 + np.exp(-inputs @ weights))
        gradient = inputs.T @ (likely - outcomes) + (weights - PRIOR)
        hessian = (inputs * (likely * (1 - likely))[:, None]).T @ inputs + np.eye(len(PRIOR))
        weights = weights - np.linalg.solve(hessian, gradient)
    return weights


def curve(vectors: np.ndarray, truth: Truth, max_num_tests: int) -> list[tuple[int, float]]:
    """(pairs tested, fraction of the edges found) after every batch."""
    count = len(truth.names)
    rows, columns = np.triu_indices(count, 1)
    is_edge = np.zeros((count, count), bool)
    is_edge[truth.edges[:, 0], truth.edges[:, 1]] = True
    is_edge = is_edge[rows, columns]
    products = vectors @ vectors.T
    np.fill_diagonal(products, -np.inf)
    rank = np.empty((count, count), np.float32)
    np.put_along_axis(rank, np.argsort(-products, axis=1, kind="stable"),
                      np.arange(count, dtype=np.float32)[None].repeat(count, 0), 1)
    least = np.minimum(rank, rank.T)[rows, columns]
    greatest = np.maximum(rank, rank.T)[rows, columns]
    known = [np.ones(len(rows)), products[rows, columns], np.log1p(least), np.log1p(greatest)]

    edges = np.zeros((count, count), np.float32)
    failures = np.zeros((count, count), np.float32)
    tested = np.zeros(len(rows), bool)
    weights = PRIOR
    examples, outcomes = np.empty((0, len(PRIOR))), np.empty(0)
    points = []
    while tested.sum() < min(max_num_tests, len(rows)):
        common = (edges @ edges)[rows, columns]
        vain = edges @ failures
        vain = (vain + vain.T)[rows, columns]
        inputs = np.stack([*known, np.log1p(common), np.log1p(vain), common / (common + vain + 1),
                           common > 0, np.log1p(common) * np.log1p(vain)], axis=1)
        if points:
            odds = inputs @ weights + CLOSING * (common > 0)
            odds[tested] = -np.inf
            size = min(max(BATCH, int(tested.sum()) // 20), int((~tested).sum()))
            batch = np.argpartition(-odds, size - 1)[:size]
        else:
            batch = np.nonzero(least == 0)[0]
        tested[batch] = True
        examples = np.concatenate([examples, inputs[batch]])[-NUM_EXAMPLES:]
        outcomes = np.concatenate([outcomes, is_edge[batch]])[-NUM_EXAMPLES:]
        for matrix, which in ((edges, batch[is_edge[batch]]), (failures, batch[~is_edge[batch]])):
            matrix[rows[which], columns[which]] = matrix[columns[which], rows[which]] = 1
        weights = fit(examples, outcomes, weights)
        points.append((int(tested.sum()), float((is_edge & tested).sum() / len(truth.edges))))
    return points
