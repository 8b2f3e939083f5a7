"""completion_test.py DOCUMENTS WORK: the completions in DOCUMENTS, asked by bash and by zsh as a user would ask them:
keys are typed into a terminal, and what the shell then shows is read."""

import fcntl
import os
import pathlib
import pty
import re
import select
import struct
import sys
import termios
import time
import unittest

DOCUMENTS = pathlib.Path(sys.argv[1]).resolve()
WORK = pathlib.Path(sys.argv[2]).resolve()
PROGRAM = "graphmatch_matcher "

# Keys that have the shell print its line, and forget it.
SHOW = "\x18\x0f"
PROMPT = "READY> "


class Option:
    def __init__(self, name, values, has_effect, spellings):
        self.name = name
        self.has_effect = has_effect
        self.spellings = spellings
        listed = re.match(r"one of ([^:]*)", values)
        self.choices = listed[1].split(", ") if listed else ["0", "1"] if values == "0 or 1" else []


def read_options():
    options = []
    has_effect = True
    for line in (DOCUMENTS / "options.md").read_text().splitlines():
        if line.startswith("## "):
            has_effect = line != "## Accepted without effect"
        row = re.match(r"\| `([^`]+)` \| ([^|]*) \|", line)
        unused = re.match(r"  `([^`]+)`$", line)
        if unused:
            options.append(Option(unused[1], "", has_effect, []))
        if row:
            options.append(Option(row[1], row[2], has_effect, re.findall(r"[0-9]: `([^`]+)`", line)))
    return options


class Shell:
    """A shell on a terminal that is so large that nothing is cut off."""

    def __init__(self, command, setup):
        pid, self.terminal = pty.fork()
        if pid == 0:
            path = f"{WORK}/programs:{os.environ['PATH']}"
            os.chdir(WORK / "here")
            os.execvpe(command[0], command, {"PATH": path, "HOME": str(WORK), "TERM": "xterm", "LC_ALL": "C"})
        self.pid = pid
        fcntl.ioctl(self.terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 1000, 1000, 0, 0))
        # In pieces, so that what the terminal echoes is not taken for the prompt.
        lines = setup + [f"PS1='{PROMPT[:3]}''{PROMPT[3:]}'"]
        os.write(self.terminal, "".join(line + "\n" for line in lines).encode())
        self.read_until(re.escape(PROMPT))

    def read_until(self, pattern):
        shown = ""
        deadline = time.monotonic() + 120
        while not (found := re.search(pattern, shown, re.DOTALL)):
            if not select.select([self.terminal], [], [], max(0, deadline - time.monotonic()))[0]:
                raise AssertionError(f"no {pattern!r}: {shown!r}")
            shown += os.read(self.terminal, 65536).decode(errors="replace")
        # Until the shell reads keys itself the terminal would, and take some of them for its own.
        while termios.tcgetattr(self.terminal)[3] & termios.ICANON:
            time.sleep(0.01)
        return found

    def complete(self, keys):
        """The line after these keys, and all that was shown meanwhile."""
        os.write(self.terminal, (keys + SHOW).encode())
        found = self.read_until(f"^(.*)<<(.*?)>>.*{PROMPT}")
        return found[2], found[1]

    def close(self):
        os.close(self.terminal)
        os.waitpid(self.pid, 0)


class Completion:
    """What holds for every shell."""

    @classmethod
    def setUpClass(cls):
        cls.shell = cls.make_shell()

    @classmethod
    def tearDownClass(cls):
        cls.shell.close()

    def expect_line(self, typed, line):
        self.assertEqual(self.shell.complete(PROGRAM + typed + "\t")[0], PROGRAM + line, typed)

    def test_every_option_that_the_help_lists_is_offered(self):
        offered = self.offered("--")
        options = [option for option in read_options() if option.has_effect]
        self.assertGreater(len(options), 60)
        self.assertEqual([option.name for option in options if "--" + option.name not in offered], [])

    def test_other_names_are_offered_where_nothing_else_begins_like_that(self):
        self.assertNotIn("--VocabTreeMatching.num_checks", self.offered("--"))
        self.assertIn("--VocabTreeMatching.num_checks", self.offered("--VocabTreeMatching.num_c"))
        for option in read_options():
            for name in [option.name] + option.spellings:
                with self.subTest(name=name):
                    # Up to the last letter; others may go on where this one ends.
                    line = self.shell.complete(PROGRAM + "--" + name[:-1] + "\t")[0]
                    self.assertEqual(line.rstrip(" ="), PROGRAM + "--" + name)

    def test_every_choice_is_offered(self):
        with_choices = [option for option in read_options() if option.choices]
        self.assertGreater(len(with_choices), 20)
        for option in with_choices:
            with self.subTest(name=option.name):
                self.assertLessEqual(set(option.choices), self.offered(f"--{option.name} "))
        self.expect_line("--GraphMatching.matcher ex", "--GraphMatching.matcher exact ")
        self.expect_line("--GraphMatching.matcher=ex", "--GraphMatching.matcher=exact ")
        self.expect_line("--SiftMatching.cross_check 1 --Graph", "--SiftMatching.cross_check 1 --GraphMatching.")

    def test_files(self):
        self.expect_line("--database_path alp", "--database_path alpha.db ")
        self.expect_line("--database_path=alp", "--database_path=alpha.db ")
        self.expect_line("--database_path wi", "--database_path with\\ space.db ")
        self.expect_line("--VocabTreeMatching.vocab_tree_path alp", "--VocabTreeMatching.vocab_tree_path alpha.db ")

    def test_directories(self):
        self.expect_line("--image_path ", "--image_path directory/")
        self.expect_line("--GraphMatching.work_path=d", "--GraphMatching.work_path=directory/")

    def test_programs(self):
        self.expect_line("--colmap_path a_colm", "--colmap_path a_colmap ")

    def test_flags_and_numbers_have_no_values(self):
        self.expect_line("--version --database_p", "--version --database_path ")
        self.expect_line("--GraphMatching.max_num_neighbors alp", "--GraphMatching.max_num_neighbors alp")


class BashCompletion(Completion, unittest.TestCase):
    @classmethod
    def make_shell(cls):
        return Shell(
            ["bash", "--norc", "--noprofile", "-i"],
            [
                "bind 'set completion-query-items 0'; bind 'set page-completions off'; bind 'set bell-style none'",
                "bind 'set enable-bracketed-paste off'",
                r"""show() { printf '\074<%s>\076\n' "$READLINE_LINE"; READLINE_LINE=; }""",
                r"""bind -x '"\C-x\C-o": show'""",
                f"source '{DOCUMENTS}/graphmatch_matcher.bash'",
            ],
        )

    def offered(self, typed):
        return set(self.shell.complete(PROGRAM + typed + "\t\t\t")[1].split())


class ZshCompletion(Completion, unittest.TestCase):
    @classmethod
    def make_shell(cls):
        return Shell(
            ["zsh", "-f", "-i"],
            [
                "unsetopt beep prompt_sp",
                f"fpath=('{DOCUMENTS}' $fpath); autoload -Uz compinit; compinit -D -u",
                r"""show() { zle -I; printf '\074<%s>\076\n' "$BUFFER"; BUFFER=; }; zle -N show""",
                r"""bindkey '^X^O' show""",
                # Lists are not shown while more keys are waiting: what would be in them is written to a file.
                r"""compadd() {
                  local -a words
                  [[ ${@[1,(i)(-|--)]} == *-(O|A|D)\ * ]] || {
                    builtin compadd -A words "$@"
                    print -rl -- $words >>~/offered
                  }
                  builtin compadd "$@"
                }""",
            ],
        )

    def offered(self, typed):
        (WORK / "offered").unlink(missing_ok=True)
        self.shell.complete(PROGRAM + typed + "\t")
        return set((WORK / "offered").read_text().split())

    def expect_line(self, typed, line):
        # After the name of an option zsh writes the sign that its value may follow.
        shown = self.shell.complete(PROGRAM + typed + "\t")[0]
        self.assertEqual(re.sub(r"(--\S+_path)=$", r"\1 ", shown), PROGRAM + line, typed)


if __name__ == "__main__":
    (WORK / "here" / "directory").mkdir(parents=True)
    for file in ("alpha.db", "with space.db"):
        (WORK / "here" / file).touch()
    (WORK / "programs").mkdir()
    for program in ("a_colmap", PROGRAM.strip()):
        (WORK / "programs" / program).write_text("#!/bin/sh\n")
        (WORK / "programs" / program).chmod(0o755)
    unittest.main(argv=sys.argv[:1], verbosity=2)
