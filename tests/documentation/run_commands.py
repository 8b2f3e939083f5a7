#!/usr/bin/python3
"""run_commands.py BUILD_DIR WORK_DIR [PAGE]...: runs every command of README.md, CONTRIBUTING.md, CHANGELOG.md and
docs/*.md, or of the pages that are named.

A fenced block with the info string `bash` is run, by a shell of its own with -euo pipefail; the blocks of a page one
after the other in one directory, which holds images/ at first. An HTML comment before a block says otherwise:

  prepared: THINGS   a new directory, with images/ and, of what is named: database.db (its features), matched.db (the
                     same after graphmatch_matcher)
  not run: REASON    the next block cannot be run here
  printed            the next block, of text, is what the last command printed: its lines have to be in the output,
                     whatever the numbers are; "..." stands for lines that are left out

/usr/local stands for a directory of the test. Other blocks have another info string: text for what is printed or typed
into a file. Programs that Debian does not have are stood in for by tests/stand_ins, unless they are installed.

Exit code 77 if COLMAP or the program that renders photos is missing."""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import time
import typing

import markdown

INFO = {"bash", "text", "ini", "json", "python", "cmake", "sql"}
COMMAND = re.compile(r"(\$ |sudo |colmap |graphmatch_matcher |glomap |scripts/|cmake |ctest |python3 |apt|ns-|\./)")
TIMEOUT = 600


class Failure(Exception):
    """A page that is wrong: where, and what."""


class Preparations:
    """What the directories of pages are filled with, made once."""

    def __init__(self, build: pathlib.Path, work: pathlib.Path) -> None:
        self.build = build
        self.work = work
        self.bin = work / "bin"
        self.environment = dict(os.environ)
        self.environment.pop("DISPLAY", None)
        self.environment.update(HOME=str(work / "home"), TMPDIR=str(work / "tmp"),
                                PATH=f"{self.bin}:{os.environ['PATH']}")
        for directory in (self.bin, work / "home", work / "tmp"):
            directory.mkdir(parents=True)
        (self.bin / "graphmatch_matcher").symlink_to(build / "colmap_graphmatch/graphmatch_matcher")
        # Where `cmake --install --prefix /usr/local` puts the program `colmap` for callers of COLMAP.
        wrappers = work / "local/libexec/colmap-graphmatch"
        wrappers.mkdir(parents=True)
        (wrappers / "colmap").symlink_to(markdown.ROOT / "scripts/colmap")
        self.add_stand_ins()
        self.render()

    def add_stand_ins(self) -> None:
        stand_ins = markdown.ROOT / "tests/stand_ins"
        for program in ("glomap", "ns-process-data"):
            if not shutil.which(program):
                (self.bin / program).symlink_to(stand_ins / program)
        commands = subprocess.run(["colmap", "help"], capture_output=True, text=True, check=True).stdout
        if "global_mapper" not in commands:
            (self.bin / "colmap").symlink_to(stand_ins / "colmap")
        if subprocess.run(["python3", "-c", "import hloc"], capture_output=True).returncode != 0:
            self.environment["PYTHONPATH"] = str(stand_ins)

    def render(self) -> None:
        """One place with enough photos for a model, and three photos of another, which are not."""
        subprocess.run([self.build / "scripts/photo_renderer/render_photos", "--output_path", self.work / "rendered",
                        "--truth_path", self.work / "cameras.tsv"], check=True, stdout=subprocess.DEVNULL)
        names: typing.Dict[str, typing.List[str]] = {}
        for line in (self.work / "cameras.tsv").read_text().splitlines()[2:]:
            name, monument = line.split("\t")[:2]
            names.setdefault(monument, []).append(name)
        (self.work / "images").mkdir()
        for name in names["0"][:11] + names["1"][:3]:
            shutil.copy(self.work / "rendered" / name, self.work / "images" / name)

    def run(self, *command: typing.Any) -> None:
        done = subprocess.run(command, env=self.environment, capture_output=True, text=True, timeout=TIMEOUT)
        if done.returncode != 0:
            raise Failure(f"{command}: exit code {done.returncode}\n{done.stdout}{done.stderr}")

    def database(self) -> pathlib.Path:
        path = self.work / "database.db"
        if not path.exists():
            # The spelling of the installed COLMAP.
            usage = subprocess.run(["colmap", "feature_extractor", "-h"], capture_output=True, text=True).stdout
            use_gpu = re.search(r"--\w+\.use_gpu", usage)
            self.run("colmap", "feature_extractor", "--database_path", path, "--image_path", self.work / "images",
                     use_gpu[0], "0", "--SiftExtraction.max_num_features", "1024")
        return path

    def matched(self) -> pathlib.Path:
        path = self.work / "matched.db"
        if not path.exists():
            shutil.copy(self.database(), path)
            self.run(self.bin / "graphmatch_matcher", "--database_path", path)
        return path

    def directory(self, name: str, things: typing.List[str]) -> pathlib.Path:
        directory = self.work / "pages" / name
        shutil.copytree(self.work / "images", directory / "images")
        for thing in things:
            source = {"images": None, "database.db": self.database, "matched.db": self.matched}.get(thing, "unknown")
            if source == "unknown":
                raise Failure(f"what is {thing}?")
            if source is not None:
                shutil.copy(source(), directory / thing)
        return directory


def shape(line: str) -> str:
    """A line of output without its numbers and the width of its columns."""
    return re.sub(r"\s+", " ", re.sub(r"\d[\d.,]*", "0", line)).strip()


def run_page(page: pathlib.Path, preparations: Preparations, run: typing.List[str],
             not_run: typing.List[str]) -> None:
    """Runs the blocks of a page. Appends the places of those that were run, and of those that were not with the
    reason."""
    name = str(page.relative_to(markdown.ROOT))
    directory = None
    num_directories = 0
    reason = None
    printed = False
    output = ""
    things = ["images"]
    for block in markdown.blocks(page):
        place = f"{name}:{block.line}"
        if block.info == "comment":
            if block.text.startswith("prepared:"):
                things, directory = block.text[len("prepared:"):].split(), None
            elif block.text.startswith("not run:"):
                reason = block.text[len("not run:"):].strip()
            printed = block.text == "printed"
            continue
        if block.info not in INFO and not block.info.startswith("{"):
            raise Failure(f"{place}: a block needs an info string: bash (it is run), text, ...")
        if block.info == "bash" and reason:
            not_run.append(f"{place}: {reason}")
        elif block.info == "bash":
            if directory is None:
                num_directories += 1
                directory = preparations.directory(f"{page.stem}.{num_directories}", things)
            start = time.monotonic()
            commands = block.text.replace("/usr/local/", f"{preparations.work}/local/")
            done = subprocess.run(["bash", "-euo", "pipefail", "-c", commands], cwd=directory,
                                  env=preparations.environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                  stderr=subprocess.STDOUT, text=True, timeout=TIMEOUT)
            output = done.stdout
            if done.returncode != 0:
                raise Failure(f"{place}: exit code {done.returncode}\n{block.text}--- printed:\n{output}")
            run.append(place)
            print(f"ran {place} ({time.monotonic() - start:.1f} s)", flush=True)
        elif reason:
            raise Failure(f"{place}: only blocks of commands are not run")
        elif block.info == "text":
            for line in block.text.splitlines():
                if COMMAND.match(line):
                    raise Failure(f"{place}: a command in a block of text: {line}")
            if printed:
                shapes = {shape(line) for line in output.splitlines()}
                for line in block.text.splitlines():
                    if line.strip() not in ("", "...") and shape(line) not in shapes:
                        raise Failure(f"{place}: the last command does not print\n{line}\n--- but:\n{output}")
        reason, printed = None, False


def main() -> None:
    build, work = (pathlib.Path(argument).resolve() for argument in sys.argv[1:3])
    if not shutil.which("colmap"):
        print("COLMAP is not installed.")
        sys.exit(77)
    if not (build / "scripts/photo_renderer/render_photos").exists():
        print("There is no render_photos: the build is one without GRAPHMATCH_BUILD_DEMO.")
        sys.exit(77)
    shutil.rmtree(work, ignore_errors=True)
    preparations = Preparations(build, work)
    selected = [markdown.ROOT / page for page in sys.argv[3:]] or markdown.pages()
    run: typing.List[str] = []
    not_run: typing.List[str] = []
    failures = []
    for page in selected:
        # A page ends at its first failure, for what follows builds on it; the other pages are run all the same.
        try:
            run_page(page, preparations, run, not_run)
        except (Failure, subprocess.TimeoutExpired) as error:
            failures.append(str(error))
    print(f"{len(run)} blocks of commands were run, {len(not_run)} were not:")
    for place in not_run:
        print(f"  {place}")
    for failure in failures:
        print(f"FAILED: {failure}", file=sys.stderr)
    if failures or not run and not not_run:
        sys.exit(1)


main()
