"""Manual pages: one for the program, and one for each of its commands."""


def escaped(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\\&" + text if text.startswith((".", "'")) else text


def entry_lines(entry):
    names = ", ".join(f"\\fB{escaped(name)}\\fR" for name in entry.names)
    argument = f" \\fI{escaped(entry.argument)}\\fR" if entry.argument else ""
    return [".TP", names + argument, escaped(entry.text) or "\\&"]


def sections_of(command, heading):
    lines = []
    for title, entries in command.sections.items():
        if entries:
            lines.append(f'{heading} "{("Arguments" if title == "Positionals" else title).upper()}"')
            lines += [line for entry in entries for line in entry_lines(entry)]
    return lines


def page(command, version):
    """The page of a command. Commands below a command of the program are parts of its page."""
    name = "-".join(command.words)
    lines = [f'.TH "{name.upper()}" 1 "" "tensorray {version}"', ".SH NAME",
             f"{escaped(name)} \\- {escaped(command.summary)}", ".SH SYNOPSIS", escaped(command.usage)]
    lines += sections_of(command, ".SH")
    if command.commands and len(command.words) == 1:
        lines.append(".SH COMMANDS")
        for below in command.commands:
            lines += [".TP", f"\\fB{escaped('-'.join(below.words))}\\fR(1)", escaped(below.summary)]
    elif command.commands:
        for below in command.commands:
            lines += [f'.SH "{" ".join(below.words[1:]).upper()}"', escaped(below.summary) + ".", ".PP",
                      escaped(below.usage)]
            lines += sections_of(below, ".SS")
    lines += [".SH EXIT STATUS", "0 done; 1 it failed; 2 the command line or the scene is wrong; 130 interrupted."]
    return "\n".join(lines) + "\n"


def pages(program, version):
    """Names of files, and their contents."""
    return {"-".join(command.words) + ".1": page(command, version) for command in [program, *program.commands]}
