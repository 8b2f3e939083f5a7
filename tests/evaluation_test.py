"""Tests of scripts/evaluation and scripts/scene_graph: python3 tests/evaluation_test.py"""

import contextlib
import io
import sqlite3
import struct
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))
from evaluation import (components, database, figures, page, reconstruction,  # noqa: E402
                        scores, truth, vocabulary_tree)
from evaluation.errors import EvaluationError  # noqa: E402
from scene_graph import generator, paper  # noqa: E402


def make_truth(names: list[str], edges: list[tuple[int, int]]) -> truth.Truth:
    return truth.Truth(names, np.array(edges), np.full(len(edges), 30))


class DirectoryTest(unittest.TestCase):
    def setUp(self) -> None:
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.directory = Path(directory.name)

    def make_database(self, names: list[str], pairs: list[tuple[int, int, int, int, int]]) -> Path:
        """pairs: ids, inliers, config, matches."""
        path = self.directory / "database.db"
        with contextlib.closing(sqlite3.connect(path)) as connection:
            connection.executescript(
                "CREATE TABLE images (image_id INTEGER PRIMARY KEY, name TEXT);"
                "CREATE TABLE descriptors (image_id INTEGER PRIMARY KEY, rows INTEGER);"
                "CREATE TABLE matches (pair_id INTEGER PRIMARY KEY, rows INTEGER);"
                "CREATE TABLE two_view_geometries (pair_id INTEGER PRIMARY KEY, rows INTEGER,"
                " config INTEGER);")
            for image_id, name in enumerate(names, 1):
                connection.execute("INSERT INTO images VALUES (?, ?)", (image_id, name))
                connection.execute("INSERT INTO descriptors VALUES (?, 10)", (image_id,))
            for id1, id2, inliers, config, matches in pairs:
                key = database.pair_id(id1, id2)
                connection.execute("INSERT INTO matches VALUES (?, ?)", (key, matches))
                connection.execute("INSERT INTO two_view_geometries VALUES (?, ?, ?)",
                                   (key, inliers, config))
            connection.commit()
        return path


class TruthTest(DirectoryTest):
    def test_database_and_its_export_say_the_same(self) -> None:
        names = ["a b.jpg", "c,d.jpg", "e.jpg", "f.jpg"]
        path = self.make_database(names, [(1, 2, 20, 2, 40), (1, 3, 14, 2, 30), (2, 3, 90, 1, 95),
                                          (3, 4, 15, 3, 15), (1, 4, 0, 0, 3)])
        listed = self.directory / "truth.tsv"
        truth.export(path, listed)
        for source in (path, listed):
            read = truth.read_truth(source, names)
            self.assertEqual(read.edges.tolist(), [[0, 1], [2, 3]])
            self.assertEqual(read.inliers.tolist(), [20, 15])
        # The pairs with enough matches alone, but without an edge, too.
        self.assertEqual(len(listed.read_text().splitlines()), 2 + 4)

    def test_what_is_no_truth(self) -> None:
        path = self.directory / "truth.tsv"
        with self.assertRaisesRegex(EvaluationError, "no truth"):
            truth.read_truth(path, ["a", "b"])
        path.write_text("a\tb\t20\na b 20\n")
        with self.assertRaisesRegex(EvaluationError, "Line 2"):
            truth.read_truth(path, ["a", "b"])
        path.write_text("x\ty\t20\n")
        with self.assertRaisesRegex(EvaluationError, "names the same"):
            truth.read_truth(path, ["a", "b"])

    def test_components(self) -> None:
        self.assertEqual(components.component_sizes(
            make_truth(list("abcdefg"), [(0, 1), (1, 2), (4, 5)])), [3, 2])


class DatabaseTest(DirectoryTest):
    def test_keeps_the_given_pairs_alone(self) -> None:
        path = self.make_database(["a", "b", "c"], [(1, 2, 20, 2, 40), (2, 3, 20, 2, 40)])
        target = self.directory / "kept.db"
        self.assertEqual(database.keep_pairs(path, target, {("c", "b"), ("a", "c")}), 1)
        with contextlib.closing(sqlite3.connect(target)) as connection:
            for table in ("matches", "two_view_geometries"):
                keys = connection.execute(f"SELECT pair_id FROM {table}").fetchall()
                self.assertEqual(keys, [(database.pair_id(2, 3),)])

    def test_copies_features_without_matches(self) -> None:
        path = self.make_database(["a", "b"], [(1, 2, 20, 2, 40)])
        target = self.directory / "copy.db"
        database.copy_features(path, target)
        self.assertEqual(database.read_names(target), ["a", "b"])
        self.assertEqual(list(truth.rows_of_database(target)), [])

    def test_what_is_no_database(self) -> None:
        path = self.directory / "text.db"
        with self.assertRaisesRegex(EvaluationError, "no database"):
            database.read_names(path)
        path.write_text("no database, and long enough to be looked at as one" * 50)
        with self.assertRaisesRegex(EvaluationError, "cannot be read"):
            database.read_names(path)


class ScoresTest(unittest.TestCase):
    def test_roc_by_hand(self) -> None:
        #  Ranked: edge, non-edge, edge, then an edge and a non-edge of equal score.
        ranked = scores.Scores("x", np.array([5.0, 3.0, 1.0]), np.array([4.0, 1.0]), "score")
        false, true = scores.roc(ranked)
        np.testing.assert_allclose(false, [0, 0, 0.5, 0.5, 1])
        np.testing.assert_allclose(true, [0, 1 / 3, 1 / 3, 2 / 3, 1])
        # Of the 6 pairs of an edge and a non-edge 3 are in order and one is a tie.
        self.assertAlmostEqual(scores.area_under_roc(ranked), 3.5 / 6)
        self.assertAlmostEqual(scores.average_precision(ranked), (1 + 2 / 3 + 3 / 5) / 3)

    def test_vectors(self) -> None:
        vectors = np.array([[1, 0], [0.6, 0.8], [0, 1]], np.float32)
        found = scores.vector_scores("x", vectors, make_truth(list("abc"), [(0, 1)]), 0)
        np.testing.assert_allclose(found.edges, [-0.8], atol=1e-6)
        np.testing.assert_allclose(sorted(found.non_edges), [-2, -0.4], atol=1e-6)

    def test_modified_graph_distance(self) -> None:
        # A triangle with a tail of two, and a pair of its own.
        graph = make_truth(list("abcdefg"), [(0, 1), (1, 2), (0, 2), (2, 3), (3, 4), (5, 6)])
        edges, non_edges = scores.modified_graph_distances(graph)
        self.assertEqual(edges, {2: 3, scores.UNREACHABLE: 3})
        self.assertEqual(non_edges, {2: 3, 3: 2, scores.UNREACHABLE: 10})
        self.assertEqual(sum(edges.values()) + sum(non_edges.values()), 21)


class VocabularyTreeTest(unittest.TestCase):
    def test_parses_what_colmap_prints(self) -> None:
        text = ("Indexing image [1/2]\n"
                "Querying for image a, b.jpg [1/2] in 0.010s\n"
                "  image_id=1, image_name=a, b.jpg, score=1.000000\n"
                "  image_id=2, image_name=c.jpg, score=0.250000\n"
                "Querying for image c.jpg [2/2] in 0.010s\n"
                "  image_id=1, image_name=a, b.jpg, score=2.5e-01\n")
        self.assertEqual(vocabulary_tree.parse_answers(text, {1: "a, b.jpg", 2: "c.jpg"}),
                         [("a, b.jpg", "c.jpg", 0.25), ("c.jpg", "a, b.jpg", 0.25)])
        logged = "".join(f"I20261128 22:49:53.558591  9697 vocab_tree.cc:264] {line}\n"
                         for line in text.split("\n"))
        self.assertEqual(len(vocabulary_tree.parse_answers(logged, {1: "a, b.jpg", 2: "c.jpg"})), 2)
        with self.assertRaises(EvaluationError):
            vocabulary_tree.parse_answers("  image_id=1, image_name=a, score=1\n", {1: "a"})


class ReconstructionTest(DirectoryTest):
    def test_similarity_is_found_among_outliers(self) -> None:
        random = np.random.default_rng(1)
        source = random.normal(size=(40, 3))
        rotation, _ = np.linalg.qr(random.normal(size=(3, 3)))
        rotation *= np.sign(np.linalg.det(rotation))
        target = 2.5 * source @ rotation.T + [1, -2, 3]
        target[:12] += random.normal(scale=20, size=(12, 3))
        found = reconstruction.robust_similarity(source, target, 0.1, seed=0)
        self.assertAlmostEqual(found.scale, 2.5, places=6)
        np.testing.assert_allclose(found.rotation, rotation, atol=1e-6)
        np.testing.assert_allclose(found.translation, [1, -2, 3], atol=1e-6)

    def test_distances_are_parts_of_the_extent(self) -> None:
        random = np.random.default_rng(2)
        reference = {f"i{k}": point for k, point in enumerate(random.normal(size=(30, 3)))}
        moved = {name: 3 * point + 7 for name, point in reference.items()}
        size = reconstruction.extent(np.array(list(reference.values())))
        moved["i0"] = moved["i0"] + np.array([3 * size, 0, 0])
        distances = reconstruction.camera_distances([moved, {"other": np.zeros(3)}], [reference], 0)
        self.assertEqual(len(distances), 30)
        self.assertAlmostEqual(distances.max(), 1, places=3)
        self.assertLess(np.median(distances), 1e-6)

    def test_reads_images_bin(self) -> None:
        path = self.directory / "images.bin"
        # A quarter turn about z: the camera is at -R^T t.
        quaternion = (2**-0.5, 0, 0, 2**-0.5)
        path.write_bytes(
            struct.pack("<Q", 1) + struct.pack("<I4d3dI", 7, *quaternion, 1, 2, 3, 1)
            + b"my photo.jpg\0" + struct.pack("<Q", 2) + bytes(2 * 24))
        images = reconstruction.read_images(path)
        self.assertEqual(list(images), ["my photo.jpg"])
        np.testing.assert_allclose(images["my photo.jpg"], [-2, 1, -3], atol=1e-12)
        path.write_bytes(path.read_bytes()[:40])
        with self.assertRaisesRegex(EvaluationError, "images.bin"):
            reconstruction.read_images(path)


class SceneTest(unittest.TestCase):
    def test_has_the_numbers_that_were_asked_for(self) -> None:
        scene = generator.make_scene(600, 5000, 0.7, 1100, seed=3)
        self.assertEqual(scene.edges.shape, (5000, 2))
        self.assertTrue((scene.edges[:, 0] < scene.edges[:, 1]).all())
        self.assertEqual(len(np.unique(scene.edges, axis=0)), 5000)
        self.assertEqual(scene.vectors.shape, (600, 1100))
        np.testing.assert_allclose(np.linalg.norm(scene.vectors, axis=1), 1, atol=1e-5)
        self.assertLessEqual(len(np.unique(scene.edges)), 420)

    def test_is_the_same_for_the_same_seed(self) -> None:
        first, again = (generator.make_scene(200, 900, 0.8, 1100, seed=5) for _ in range(2))
        np.testing.assert_array_equal(first.edges, again.edges)
        np.testing.assert_array_equal(first.vectors, again.vectors)

    def test_is_as_transitive_and_as_separated_as_real_photos(self) -> None:
        scene = generator.make_scene(2000, 20000, 0.7, 1100, seed=1)
        graph = make_truth([str(i) for i in range(2000)], [tuple(e) for e in scene.edges])
        edges, non_edges = scores.modified_graph_distances(graph)
        self.assertGreater(edges[2] / 20000, 0.97)
        self.assertGreater(edges[2] / (edges[2] + non_edges[2]), 0.35)
        products, others = generator.products(scene, 0)
        real = dict(zip(generator.QUANTILES, generator.REAL_EDGES))
        self.assertAlmostEqual(np.median(products), real[0.5], delta=0.05)
        real = dict(zip(generator.QUANTILES, generator.REAL_NON_EDGES))
        self.assertAlmostEqual(np.median(others), real[0.5], delta=0.03)
        self.assertAlmostEqual(np.quantile(others, 0.95), real[0.95], delta=0.05)

    def test_the_papers_rows_agree_with_its_text(self) -> None:
        taj = paper.SCENES[0]
        self.assertEqual(taj.overall, (119285, 48949))
        self.assertEqual((taj.max_tests, paper.SCENES[-1].max_tests), (25, 120))


class PageTest(DirectoryTest):
    def test_is_one_file_with_everything_in_it(self) -> None:
        out = page.Page("Photos & <more>", self.directory / "figures")
        out.table(["system", "recall"], [{"system": "a < b", "recall": 0.5}, {"system": "c"}])
        ranked = scores.Scores("x", np.linspace(0, 1, 50), np.linspace(-1, 0.5, 90), "score")
        out.figure("roc", figures.roc_curves([ranked]), "A caption")
        out.figure("scores", figures.score_densities([ranked]), "Another")
        out.write(self.directory / "index.html")
        text = (self.directory / "index.html").read_text()
        self.assertIn("Photos &amp; &lt;more&gt;", text)
        self.assertIn("<td>a &lt; b</td><td>0.5000</td>", text)
        self.assertEqual(text.count("data:image/png;base64,"), 2)
        self.assertNotIn('src="http', text)
        self.assertTrue((self.directory / "figures/roc.png").exists())


if __name__ == "__main__":
    with contextlib.redirect_stdout(io.StringIO()):
        unittest.main(verbosity=1)
