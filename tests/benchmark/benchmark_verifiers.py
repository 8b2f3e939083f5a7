#!/usr/bin/env python3
"""How the verifiers' verdicts on the same matches differ from COLMAP's, and what a candidate pair costs.

  benchmark_verifiers.py BUILD_DIR FEATURES NUM_RUNS [--pairs LIST] [COLMAP...]

FEATURES: a COLMAP database with features, which stays as it is. Its pairs (all, or those of LIST, two names a line) are
matched once; then each verifier judges the matches of 15 and more, NUM_RUNS times, by turns, for each COLMAP (default:
the installed one). `another seed` is COLMAP with another random seed: what is no more than that is noise. A cost is CPU
time of all processes, less that of a run that finds nothing to do, a candidate pair: the median of the runs.
"""

import argparse
import contextlib
import pathlib
import resource
import shutil
import sqlite3
import statistics
import subprocess
import tempfile

MIN_NUM_INLIERS = 15
NOT_VERIFIED = (0, 1, 7)  # COLMAP's undefined, degenerate and watermark.

SYSTEMS = {
    "colmap": ["--GraphMatching.verifier", "colmap"],
    "another seed": ["--GraphMatching.verifier", "colmap", "--random_seed", "1"],
    "screened": ["--GraphMatching.verifier", "screened"],
    "native": ["--GraphMatching.verifier", "native"],
}


def copy(source: pathlib.Path, target: pathlib.Path) -> None:
    for old in target.parent.glob(target.name + "*"):
        old.unlink()
    shutil.copyfile(source, target)


@contextlib.contextmanager
def opened(database: pathlib.Path):
    """A connection that is closed in the end, so that nothing is left in a file beside the database."""
    with contextlib.closing(sqlite3.connect(database)) as connection, connection:
        yield connection


def cpu_seconds(command: list[str]) -> float:
    """CPU time of the command and of all that it starts and waits for."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if result.returncode != 0:
        raise SystemExit(f"{' '.join(command)}: exit code {result.returncode}\n{result.stderr[-2000:]}")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def verdicts(database: pathlib.Path) -> dict[int, tuple[int, int]]:
    """Configuration and number of inliers of every candidate pair."""
    with opened(database) as connection:
        rows = connection.execute(
            "SELECT t.pair_id, t.config, t.rows FROM two_view_geometries t JOIN matches m USING (pair_id) WHERE m.rows >= ?",
            (MIN_NUM_INLIERS,))
        return {pair: (config, inliers) for pair, config, inliers in rows}


def is_edge(verdict: tuple[int, int]) -> bool:
    return verdict[1] >= MIN_NUM_INLIERS and verdict[0] not in NOT_VERIFIED


def difference(reference: dict[int, tuple[int, int]], other: dict[int, tuple[int, int]]) -> str:
    """The cells of a row: edges lost, won, the most inliers of these, other configurations, ratio of inliers."""
    lost = [pair for pair in reference if is_edge(reference[pair]) and not is_edge(other[pair])]
    won = [pair for pair in reference if is_edge(other[pair]) and not is_edge(reference[pair])]
    common = [pair for pair in reference if is_edge(reference[pair]) and is_edge(other[pair])]
    most = max([reference[pair][1] for pair in lost] + [other[pair][1] for pair in won], default=0)
    configurations = sum(reference[pair][0] != other[pair][0] for pair in common)
    ratios = sorted(other[pair][1] / reference[pair][1] for pair in common)
    return (f"{len(lost)} | {len(won)} | {most} | {100 * configurations / len(common):.1f} % | "
            f"{ratios[len(ratios) // 20]:.3f}, {ratios[len(ratios) - 1 - len(ratios) // 20]:.3f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("features", type=pathlib.Path)
    parser.add_argument("num_runs", type=int)
    parser.add_argument("colmap", nargs="*", default=["colmap"])
    parser.add_argument("--pairs", type=pathlib.Path)
    arguments = parser.parse_args()
    choice = ["--GraphMatching.strategy", "exhaustive"]
    if arguments.pairs:
        choice = ["--GraphMatching.match_list_path", str(arguments.pairs)]
    matcher = str(arguments.build / "colmap_graphmatch" / "graphmatch_matcher")

    with tempfile.TemporaryDirectory() as directory:
        matched = pathlib.Path(directory) / "matched.db"
        run = pathlib.Path(directory) / "run.db"
        copy(arguments.features, matched)
        with opened(matched) as connection:
            connection.execute("DELETE FROM matches")
            connection.execute("DELETE FROM two_view_geometries")
        cpu_seconds([matcher, "--database_path", str(matched), *choice, *SYSTEMS["native"]])
        # Matches without a geometry are verified and not matched again.
        with opened(matched) as connection:
            connection.execute("DELETE FROM two_view_geometries WHERE pair_id IN (SELECT pair_id FROM matches WHERE rows >= ?)",
                               (MIN_NUM_INLIERS,))
        print("| | | edges lost | won | most inliers of these | other configuration | ratio of inliers, 5th and 95th percentile "
              "| ms a candidate pair |")
        print("|---|---|---:|---:|---:|---:|---|---:|")
        for colmap in arguments.colmap:
            costs: dict[str, list[float]] = {system: [] for system in SYSTEMS}
            found: dict[str, dict[int, tuple[int, int]]] = {}
            for _ in range(arguments.num_runs):
                for system, options in SYSTEMS.items():
                    command = [matcher, "--database_path", str(run), "--colmap_path", colmap, *choice, *options]
                    copy(matched, run)
                    seconds = cpu_seconds(command)
                    found[system] = verdicts(run)
                    costs[system].append((seconds - cpu_seconds(command)) / len(found[system]))
            reference = found["colmap"]
            num_edges = sum(map(is_edge, reference.values()))
            for system in SYSTEMS:
                cells = difference(reference, found[system]) if system != "colmap" else f"{num_edges} of {len(reference)} | | | |"
                print(f"| {colmap} | {system} | {cells} | {1000 * statistics.median(costs[system]):.2f} |", flush=True)


if __name__ == "__main__":
    main()
