"""What `tensorray --help` says, as data."""

import dataclasses
import re
import subprocess

COLUMN = 30  # Where descriptions begin.


@dataclasses.dataclass
class Entry:
    names: list  # ["-o", "--output"], or of a positional argument its name.
    argument: str  # "FILE"; empty: none.
    text: str

    @property
    def is_option(self):
        return self.names[0].startswith("-")


@dataclasses.dataclass
class Command:
    words: list  # ["tensorray", "make", "vortex"]
    summary: str
    usage: str
    sections: dict  # Title: entries. "Positionals", "Options" and groups of options.
    commands: list  # The commands below it.

    @property
    def name(self):
        return self.words[-1]

    @property
    def options(self):
        return [entry for title, entries in self.sections.items() for entry in entries if entry.is_option]


def entries_of(lines):
    """The lines of a section as pairs: what stands left, and its description."""
    pairs = []
    for i, line in enumerate(lines):
        if line.startswith(" " * COLUMN):
            pairs[-1][1] += line.strip()
        elif i + 1 < len(lines) and lines[i + 1].startswith(" " * COLUMN):
            pairs.append([line.strip(), ""])
        else:
            pairs.append([line[:COLUMN].strip(), line[COLUMN:].strip()])
    return pairs


def entry_of(left, text):
    names, _, argument = left.partition(" ")
    argument = re.sub(r" ?(REQUIRED|Excludes:.*|Needs:.*)$", "", re.sub(r" ?REQUIRED", "", argument)).strip()
    return Entry(names.split(","), re.sub(r"^\w+:(\w+ in )", r"\1", argument), text)


def read(program, words=("tensorray",)):
    """The command `words`, with all commands below it."""
    text = subprocess.run([program, *words[1:], "--help"], check=True, capture_output=True, text=True).stdout
    before, _, after = text.partition("Usage: ")
    usage, *lines = after.splitlines()
    groups, title = {}, None
    for line in lines:
        if line and not line.startswith(" "):
            title = line.rstrip(":")
            groups[title] = []
        elif line.strip():
            groups[title].append(line)
    sections = {title: [entry_of(*pair) for pair in entries_of(lines)] for title, lines in groups.items()}
    below = sections.pop("Subcommands", [])
    return Command(list(words), " ".join(before.split()), usage.strip(), sections,
                   [read(program, [*words, entry.names[0]]) for entry in below])
