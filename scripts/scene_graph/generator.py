"""Makes a matching graph and image vectors with given numbers of images and edges.

A photo of the scene is a point in a space of views (two dimensions: where one stands, and how far
away), in one of several popular places whose sizes follow Zipf's law; its range says how much it
sees. Two photos are an edge when their distance, divided by the sum of their ranges, is among the
num_edges smallest. There are as many places as make the graph as transitive as that of real photos.
The other photos of the collection show something else and have no edge.

The vector of a photo is a smooth function of its view (random Fourier features: the product of two
is a Gaussian of their distance), weighted by how distinctive the photo is, plus a vector that has
nothing to do with the view. Its constants are set so that products of edges and of non-edges have
the distributions that Fisher vectors (16 components, the 1,000 features of largest scale) have on
569 real photos of 29 places with 4,406 exhaustive edges, from which TRANSITIVITY is, too.
"""

from dataclasses import dataclass

import numpy as np

from evaluation.errors import EvaluationError

# Products x.y of real photos, at these quantiles.
QUANTILES = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
REAL_EDGES = (0.052, 0.127, 0.281, 0.370, 0.472, 0.641, 0.777)
REAL_NON_EDGES = (-0.155, -0.111, -0.044, 0.006, 0.059, 0.151, 0.295)

VIEW_DIM = 2
NUM_VIEW_FEATURES = 1024  # Entries of the vector that depend on the view.
NUM_OTHER_FEATURES = 60  # Effective ones of the rest: fewer make unlike photos more alike.
# The length of the Gaussian, in units of the longest distance of an edge.
VIEW_LENGTH = 0.75
# Distinctiveness is distributed as Beta of these.
DISTINCTIVENESS = (3.0, 2.6)
TRANSITIVITY = 0.57  # Of two neighbours of a photo, how often they are neighbours.
PLACE_DISTANCE = 6.0  # Between neighbouring places, in standard deviations of a place.
RANGE_SPREAD = 0.35  # Standard deviation of the logarithm of a photo's range.
BLOCK = 2048


@dataclass
class Scene:
    num_images: int
    edges: np.ndarray  # E x 2, the smaller index first
    inliers: np.ndarray  # E
    vectors: np.ndarray  # N x D, unit length


def place_sizes(count: int, num_edges: int) -> np.ndarray:
    """Shares of the photos in each place, by Zipf's law, of as many places as make the graph as
    transitive as the real one: TRANSITIVITY of the pairs within places are edges."""
    for num_places in range(1, count):
        weights = 1 / np.arange(1, num_places + 1)
        weights /= weights.sum()
        if TRANSITIVITY * ((count * weights) ** 2).sum() / 2 <= num_edges:
            break
    return weights


def make_views(count: int, num_edges: int, random: np.random.Generator) -> np.ndarray:
    """Views of the photos of the scene: places of different sizes, some of which overlap."""
    weights = place_sizes(count, num_edges)
    place = random.choice(len(weights), count, p=weights)
    centres = random.uniform(0, PLACE_DISTANCE * len(weights) ** (1 / VIEW_DIM),
                             (len(weights), VIEW_DIM))
    return centres[place] + random.normal(0, 1, (count, VIEW_DIM))


def scaled_distances(views: np.ndarray, ranges: np.ndarray, first: int) -> np.ndarray:
    """Of a block of photos to all: distance / sum of ranges; infinite below the diagonal."""
    block = slice(first, min(first + BLOCK, len(views)))
    squares = (views**2).sum(axis=1)
    squared = squares[block, None] + squares[None] - 2 * views[block] @ views.T
    distances = np.sqrt(np.maximum(squared, 0)) / (ranges[block, None] + ranges[None])
    rows = np.arange(block.start, block.stop)
    distances[rows[:, None] >= np.arange(len(views))[None]] = np.inf
    return distances


def nearest_pairs(views: np.ndarray, ranges: np.ndarray, num_edges: int,
                  random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """The num_edges pairs of the smallest scaled distances, and those."""
    count = len(views)
    num_pairs = count * (count - 1) // 2
    if num_edges > num_pairs:
        raise EvaluationError(f"{count} photos have no {num_edges} pairs: a greater --share is needed.")
    sample = random.integers(0, count, (2, 400_000))
    sample = sample[:, sample[0] != sample[1]]
    sampled = (np.linalg.norm(views[sample[0]] - views[sample[1]], axis=1)
               / (ranges[sample[0]] + ranges[sample[1]]))
    share = num_edges / num_pairs
    limit = np.quantile(sampled, min(1.0, share * 1.15 + 0.002))
    while True:
        rows, columns, values = [], [], []
        for first in range(0, count, BLOCK):
            distances = scaled_distances(views, ranges, first)
            row, column = np.nonzero(distances <= limit)
            rows.append(row + first)
            columns.append(column)
            values.append(distances[row, column])
        found = np.concatenate(values)
        if len(found) >= num_edges:
            break
        limit *= 1.2
    nearest = np.argpartition(found, num_edges - 1)[:num_edges]
    pairs = np.stack([np.concatenate(rows), np.concatenate(columns)], axis=1)[nearest]
    order = np.lexsort((pairs[:, 1], pairs[:, 0]))
    return pairs[order], found[nearest][order]


def make_scene(num_images: int, num_edges: int, share_of_scene: float, dim: int,
               seed: int) -> Scene:
    """share_of_scene: of the photos that show the scene; the others have no edge.

    dim: entries of a vector; those beyond the ones that carry something are zero.
    """
    random = np.random.default_rng(seed)
    in_scene = np.sort(random.choice(num_images, round(share_of_scene * num_images),
                                     replace=False))
    views = make_views(len(in_scene), num_edges, random)
    ranges = np.exp(random.normal(0, RANGE_SPREAD, len(in_scene)))
    pairs, distances = nearest_pairs(views, ranges, num_edges, random)
    edge_length = np.linalg.norm(views[pairs[:, 0]] - views[pairs[:, 1]], axis=1)
    length = VIEW_LENGTH * np.quantile(edge_length, 0.95)

    if dim < NUM_VIEW_FEATURES + NUM_OTHER_FEATURES:
        raise EvaluationError(f"--dim is {dim}; it must be at least "
                              f"{NUM_VIEW_FEATURES + NUM_OTHER_FEATURES}.")
    vectors = np.zeros((num_images, dim), np.float32)
    frequencies = random.normal(0, 1 / length, (VIEW_DIM, NUM_VIEW_FEATURES // 2))
    weights = random.beta(*DISTINCTIVENESS, num_images)
    weights[np.setdiff1d(np.arange(num_images), in_scene)] = 0
    angles = (views @ frequencies).astype(np.float32)
    scale = np.sqrt(weights[in_scene] / (NUM_VIEW_FEATURES // 2)).astype(np.float32)[:, None]
    vectors[in_scene, :NUM_VIEW_FEATURES // 2] = np.cos(angles) * scale
    vectors[in_scene, NUM_VIEW_FEATURES // 2:NUM_VIEW_FEATURES] = np.sin(angles) * scale
    other = random.normal(0, 1, (num_images, NUM_OTHER_FEATURES)).astype(np.float32)
    other *= (np.sqrt(1 - weights) / np.linalg.norm(other, axis=1)).astype(np.float32)[:, None]
    vectors[:, NUM_VIEW_FEATURES:NUM_VIEW_FEATURES + NUM_OTHER_FEATURES] = other
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)

    # Nearer views share more features.
    inliers = 15 + np.round(300 * (1 - distances / distances.max()) ** 2).astype(np.int64)
    return Scene(num_images, in_scene[pairs], inliers, vectors)


def products(scene: Scene, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Products of the vectors of edges and of a sample of non-edges."""
    random = np.random.default_rng(seed)
    edges = np.einsum("ij,ij->i", scene.vectors[scene.edges[:, 0]],
                      scene.vectors[scene.edges[:, 1]])
    sample = np.sort(random.integers(0, scene.num_images, (2, 200_000)), axis=0)
    keys = scene.edges[:, 0] * scene.num_images + scene.edges[:, 1]
    is_pair = (sample[0] != sample[1]) & ~np.isin(sample[0] * scene.num_images + sample[1], keys)
    rows, columns = sample[:, is_pair]
    return edges, np.concatenate([
        np.einsum("ij,ij->i", scene.vectors[rows[i:i + BLOCK]], scene.vectors[columns[i:i + BLOCK]])
        for i in range(0, len(rows), BLOCK)])
