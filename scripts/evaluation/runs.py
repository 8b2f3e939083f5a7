"""Runs of graphmatch_matcher, each kept so that an interrupted evaluation goes on."""

import csv
import hashlib
import json
import re
import shutil
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import database
from .errors import EvaluationError


def find_program(given: str | None, name: str, hint: str) -> str:
    found = shutil.which(given or name)
    if found is None:
        raise EvaluationError(f"Cannot find the program {given or name}. {hint}")
    return found


def find_matcher(given: str | None) -> str:
    root = Path(__file__).resolve().parents[2]
    built = root / "build/release/colmap_graphmatch/graphmatch_matcher"
    if given is None and built.exists():
        given = str(built)
    return find_program(given, "graphmatch_matcher", "Build it (README), or give --matcher.")


def stamp_of(*parts: object) -> str:
    """Changes when an argument does, or a file that is named by one."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(repr(part).encode())
        if isinstance(part, Path) and part.exists():
            status = part.stat()
            digest.update(f"{status.st_size} {status.st_mtime_ns}".encode())
    return digest.hexdigest()


class Step:
    """Something that is done once: its result is a JSON file with the stamp of its inputs."""

    def __init__(self, path: Path, stamp: str):
        self.path = path
        self.stamp = stamp

    def result(self) -> dict | None:
        try:
            kept = json.loads(self.path.read_text())
            if kept["stamp"] == self.stamp:
                return kept["result"]
        except (OSError, ValueError, KeyError, TypeError):
            pass
        # What is about to be done again may be interrupted halfway.
        self.path.unlink(missing_ok=True)
        return None

    def keep(self, result: dict) -> dict:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        partial = self.path.with_suffix(".partial")
        partial.write_text(json.dumps({"stamp": self.stamp, "result": result}, indent=1))
        partial.replace(self.path)
        return result


def keep_copy(source: Path, target: Path) -> None:
    """Has a copy of the features at `target` that may be worked on, made anew if they change."""
    step = Step(target.with_suffix(".copy.json"), stamp_of("copy", source))
    if step.result() is None or not target.exists():
        database.copy_features(source, target)
        step.keep({})


def run_logged(command: list[str], log: Path, harmless: str = "") -> float:
    """Runs a program and returns the seconds it took.

    harmless: what a failing program says if its failure is a result like others.
    """
    start = time.monotonic()
    log.parent.mkdir(parents=True, exist_ok=True)
    with open(log, "w", encoding="utf-8") as file:
        file.write(" ".join(command) + "\n")
        file.flush()
        code = subprocess.run(command, stdout=file, stderr=subprocess.STDOUT, check=False).returncode
    text = log.read_text(errors="replace") if code != 0 else ""
    if code != 0 and not (harmless and harmless in text):
        # Of this project's programs and of COLMAP: without glog's time and place.
        last = re.sub(r"^[IWEF]\d{8} \S+ +\d+ [^]]*\] ", "", text.strip().splitlines()[-1])
        raise EvaluationError(f"{command[0]} ended with exit code {code}: {last} (see {log})")
    return time.monotonic() - start


@dataclass
class Run:
    """What a run tested, in order."""

    report: dict
    images: np.ndarray  # T x 2 indices of images, the smaller first
    is_edge: np.ndarray  # T
    seconds: np.ndarray  # T: since the start, pre-processing included
    extra_preprocessing: float = 0  # Of other programs; part of `seconds`.

    @property
    def preprocessing(self) -> float:
        seconds = self.report["seconds"]
        own = seconds["mixture"] + seconds["vectors"] + seconds["ranking"]
        return own + self.extra_preprocessing


def read_run(log: Path, report: dict, names: list[str]) -> Run:
    index = {name: i for i, name in enumerate(names)}
    images, is_edge, seconds = [], [], []
    with open(log, newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            images.append(sorted((index[row["image1"]], index[row["image2"]])))
            is_edge.append(row["edge"] == "1")
            seconds.append(float(row["seconds"]))
    return Run(report, np.array(images, dtype=np.int64).reshape(-1, 2), np.array(is_edge, bool),
               np.array(seconds))


class Matcher:
    """Replays systems on a database with features."""

    def __init__(self, program: str, features: Path, stamp: str, truth: Path, names: list[str],
                 directory: Path, common: list[str]):
        self.program = program
        self.features = features
        self.features_stamp = stamp  # Of its contents.
        self.truth = truth
        self.names = names
        self.directory = directory
        self.common = common

    def replay(self, name: str, arguments: list[str], inputs: list[Path] = (),
               outputs: list[Path] = ()) -> Run:
        """inputs, outputs: files that the arguments name."""
        log = self.directory / f"{name}.csv"
        report = self.directory / f"{name}.report.json"
        command = [self.program, "--database_path", str(self.features),
                   "--GraphMatching.replay_path", str(self.truth),
                   "--GraphMatching.pair_log", str(log), "--GraphMatching.report", str(report),
                   *self.common, *arguments]
        step = Step(self.directory / f"{name}.step.json",
                    stamp_of(command, Path(self.program), self.features_stamp, self.truth, *inputs))
        kept = step.result()
        if kept is None or not all(path.exists() for path in (log, *outputs)):
            run_logged(command, self.directory / f"{name}.log")
            kept = step.keep(json.loads(report.read_text()))
        return read_run(log, kept, self.names)
