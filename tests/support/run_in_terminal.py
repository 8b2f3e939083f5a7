"""run_in_terminal.py COLUMNS OUTPUT [--interrupt] COMMAND...: runs it on a terminal of its own.

The terminal, of 24 rows, is its standard input and error output. Exits with its exit code and writes
  OUTPUT.stdout   its standard output,
  OUTPUT.raw      what it sent to the terminal,
  OUTPUT.frames   the lines of the screen after each drawn block, a form feed after each,
  OUTPUT.final    the lines of the screen at the end, those that were scrolled out of it included.
Fails if something is sent that this terminal does not know, or if a line of the block is longer than
the terminal is wide. --interrupt: types Ctrl-C once the block was drawn.
"""

import fcntl
import os
import pty
import re
import struct
import sys
import termios

ROWS = 24


class Terminal:
    """As much of one as the program needs."""

    def __init__(self, columns: int):
        self.columns = columns
        self.lines = [""]  # The last ROWS of them are the screen.
        self.row = 0  # Of lines.
        self.column = 0
        self.wraps = True
        self.frames: list[list[str]] = []
        self.rest = ""

    def feed(self, text: str) -> None:
        text = self.rest + text
        self.rest = ""
        position = 0
        while position < len(text):
            match = re.compile(r"\x1b\[(\??)([0-9;]*)([A-Za-z])").match(text, position)
            if match:
                self.control(*match.groups())
                position = match.end()
            elif text[position] == "\x1b":
                if len(text) - position > 20:
                    sys.exit(f"unknown: {text[position:position + 20]!r}")
                self.rest = text[position:]
                return
            else:
                self.put(text[position])
                position += 1

    def control(self, private: str, number: str, letter: str) -> None:
        code = private + number + letter
        line = self.lines[self.row]
        if letter == "A":
            self.row -= int(number or 1)
            if self.row < max(0, len(self.lines) - ROWS):
                sys.exit("the cursor went above the screen")
        elif code == "C":
            self.column += 1
        elif code == "K":
            self.lines[self.row] = line[:self.column]
        elif code == "2K":
            self.lines[self.row] = ""
        elif code == "J":
            self.lines[self.row] = line[:self.column]
            # The rows stay, empty.
            for row in range(self.row + 1, len(self.lines)):
                self.lines[row] = ""
        elif code == "?7l":
            self.wraps = False
        elif code == "?7h":
            self.wraps = True
            self.frames.append([*self.lines])
        elif letter != "m":
            sys.exit(f"unknown: {code!r}")

    def put(self, character: str) -> None:
        if character == "\r":
            self.column = 0
            return
        if character == "\n":
            self.next_row()
            return
        if self.column == self.columns:
            if not self.wraps:
                sys.exit(f"longer than {self.columns} columns: {self.lines[self.row]}")
            self.column = 0
            self.next_row()
        line = self.lines[self.row].ljust(self.column)
        self.lines[self.row] = line[:self.column] + character + line[self.column + 1:]
        self.column += 1

    def next_row(self) -> None:
        self.row += 1
        if self.row == len(self.lines):
            self.lines.append("")


def main() -> int:
    columns, output, command = int(sys.argv[1]), sys.argv[2], sys.argv[3:]
    interrupts = command[0] == "--interrupt"
    command = command[interrupts:]
    pid, terminal = pty.fork()
    if pid == 0:
        file = os.open(output + ".stdout", os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
        os.dup2(file, 1)
        fcntl.ioctl(2, termios.TIOCSWINSZ, struct.pack("HHHH", ROWS, columns, 0, 0))
        os.execv(command[0], command)
    screen = Terminal(columns)
    with open(output + ".raw", "wb") as raw:
        while True:
            try:
                data = os.read(terminal, 4096)
            except OSError:  # Nobody has the terminal open any more.
                break
            if not data:
                break
            raw.write(data)
            screen.feed(data.decode(errors="replace"))
            if interrupts and screen.frames:
                os.write(terminal, b"\x03")
                interrupts = False
    with open(output + ".frames", "w", encoding="utf-8") as file:
        for frame in screen.frames:
            file.write("".join(line.rstrip() + "\n" for line in frame) + "\f\n")
    with open(output + ".final", "w", encoding="utf-8") as file:
        file.writelines(line.rstrip() + "\n" for line in screen.lines)
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])


if __name__ == "__main__":
    sys.exit(main())
