"""`colmap mapper` on what a system found, held against the exhaustive reconstruction."""

import shutil
import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .errors import EvaluationError
from .runs import Step, run_logged, stamp_of

MIN_SHARED_IMAGES = 4
NUM_TRIALS = 500


@dataclass
class Alignment:
    """target = scale * rotation @ source + translation"""

    scale: float
    rotation: np.ndarray
    translation: np.ndarray

    def apply(self, points: np.ndarray) -> np.ndarray:
        return self.scale * points @ self.rotation.T + self.translation


def read_images(path: Path) -> dict[str, np.ndarray]:
    """The positions of the cameras in COLMAP's images.bin, by image name."""
    positions = {}
    data = path.read_bytes()
    try:
        (count,) = struct.unpack_from("<Q", data, 0)
        place = 8
        for _ in range(count):
            w, x, y, z, *translation = struct.unpack_from("<7d", data, place + 4)
            place += 4 + 56 + 4
            end = data.index(b"\0", place)
            name = data[place:end].decode(errors="surrogateescape")
            (num_points,) = struct.unpack_from("<Q", data, end + 1)
            place = end + 9 + 24 * num_points
            rotation = np.array([
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
            positions[name] = -rotation.T @ np.array(translation)
    except (struct.error, ValueError) as error:
        raise EvaluationError(f"{path} is not a images.bin of COLMAP: {error}.") from error
    return positions


def read_models(directory: Path) -> list[dict[str, np.ndarray]]:
    """The models that the mapper made, the largest first."""
    models = [read_images(path) for path in sorted(directory.glob("*/images.bin"))]
    return sorted(models, key=len, reverse=True)


def similarity(source: np.ndarray, target: np.ndarray) -> Alignment:
    """Of the least squares (Umeyama, PAMI 1991); n x 3 points each."""
    mean_source, mean_target = source.mean(axis=0), target.mean(axis=0)
    centred_source, centred_target = source - mean_source, target - mean_target
    u, singular, vt = np.linalg.svd(centred_target.T @ centred_source / len(source))
    sign = np.ones(3)
    if np.linalg.det(u) * np.linalg.det(vt) < 0:
        sign[2] = -1
    rotation = u @ np.diag(sign) @ vt
    variance = (centred_source**2).sum() / len(source)
    scale = float((singular * sign).sum() / variance) if variance > 0 else 1.0
    return Alignment(scale, rotation, mean_target - scale * rotation @ mean_source)


def robust_similarity(source: np.ndarray, target: np.ndarray, threshold: float,
                      seed: int) -> Alignment:
    """By RANSAC over three points; refined on all within the threshold."""
    random = np.random.default_rng(seed)
    best = np.zeros(len(source), bool)
    for _ in range(NUM_TRIALS):
        chosen = random.choice(len(source), 3, replace=False)
        alignment = similarity(source[chosen], target[chosen])
        near = np.linalg.norm(alignment.apply(source) - target, axis=1) < threshold
        if near.sum() > best.sum():
            best = near
    return similarity(source[best], target[best]) if best.sum() >= 3 else similarity(source, target)


def extent(positions: np.ndarray) -> float:
    """Twice the median distance from the median position: outliers do not stretch it."""
    return 2 * float(np.median(np.linalg.norm(positions - np.median(positions, axis=0), axis=1)))


def camera_distances(models: list[dict], references: list[dict], seed: int) -> np.ndarray:
    """Distances of cameras to those of the reference after alignment, in parts of its extent.

    Every model is aligned with the reference model that it shares the most images with.
    """
    distances = []
    for model in models:
        shared = [sorted(model.keys() & reference.keys()) for reference in references]
        if not shared:
            continue
        best = max(range(len(references)), key=lambda i: len(shared[i]))
        if len(shared[best]) < MIN_SHARED_IMAGES:
            continue
        target = np.array([references[best][name] for name in shared[best]])
        source = np.array([model[name] for name in shared[best]])
        size = extent(np.array(list(references[best].values())))
        alignment = robust_similarity(source, target, 0.05 * size, seed)
        distances.append(np.linalg.norm(alignment.apply(source) - target, axis=1) / size)
    return np.concatenate(distances) if distances else np.zeros(0)


def run_mapper(colmap: str, database: Path, stamp: str, image_path: Path,
               directory: Path) -> float:
    """Returns the seconds it took. stamp: of the database's contents."""
    step = Step(directory / "step.json", stamp_of("mapper", colmap, stamp))
    kept = step.result()
    if kept is None:
        directory.mkdir(parents=True, exist_ok=True)
        for model in directory.glob("[0-9]*"):  # Of an earlier run; the mapper would leave some.
            shutil.rmtree(model)
        seconds = run_logged([colmap, "mapper", "--database_path", str(database), "--image_path",
                              str(image_path), "--output_path", str(directory)],
                             directory / "mapper.log", harmless="failed to create sparse model")
        kept = step.keep({"seconds": seconds})
    return kept["seconds"]
