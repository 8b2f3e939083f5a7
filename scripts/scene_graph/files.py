"""Writes a scene the way graphmatch_matcher reads it."""

import sqlite3
from pathlib import Path

import numpy as np

from evaluation.runs import run_logged

from .generator import Scene

DESCRIPTOR_DIM = 128


def image_name(index: int) -> str:
    return f"i{index:06d}.jpg"


def write_database(path: Path, num_images: int, colmap: str) -> None:
    """Images with one feature each: the vectors come from a file."""
    path.unlink(missing_ok=True)
    run_logged([colmap, "database_creator", "--database_path", str(path)],
               path.with_suffix(".log"))
    connection = sqlite3.connect(path)
    connection.execute("INSERT INTO cameras (camera_id, model, width, height, params, "
                       "prior_focal_length) VALUES (1, 0, 1000, 1000, ?, 0)",
                       (np.array([1000.0, 500, 500]).tobytes(),))
    ids = range(1, num_images + 1)
    connection.executemany("INSERT INTO images (image_id, name, camera_id) VALUES (?, ?, 1)",
                           ((i, image_name(i - 1)) for i in ids))
    keypoint = np.array([[500, 500, 1, 0]], np.float32).tobytes()
    connection.executemany("INSERT INTO keypoints (image_id, rows, cols, data) "
                           "VALUES (?, 1, 4, ?)", ((i, keypoint) for i in ids))
    descriptor = bytes([45]) * DESCRIPTOR_DIM
    connection.executemany("INSERT INTO descriptors (image_id, rows, cols, data) "
                           f"VALUES (?, 1, {DESCRIPTOR_DIM}, ?)", ((i, descriptor) for i in ids))
    connection.commit()
    connection.close()


def write_scene(scene: Scene, directory: Path, colmap: str) -> None:
    """images.db, truth.tsv, vectors.npy and vectors.txt."""
    directory.mkdir(parents=True, exist_ok=True)
    write_database(directory / "images.db", scene.num_images, colmap)
    with open(directory / "truth.tsv", "w", encoding="utf-8") as file:
        file.write("photo1\tphoto2\tinliers\n")
        for (a, b), inliers in zip(scene.edges, scene.inliers):
            file.write(f"{image_name(a)}\t{image_name(b)}\t{inliers}\n")
    np.save(directory / "vectors.npy", scene.vectors)
    (directory / "vectors.txt").write_text(
        "".join(f"{image_name(i)}\n" for i in range(scene.num_images)), encoding="utf-8")
