"""Completion for bash, zsh and fish."""


def all_commands(command):
    """A command and all below it."""
    return [command] + [below for each in command.commands for below in all_commands(each)]


def words_of(command):
    return [below.name for below in command.commands] + [name for option in command.options for name in option.names]


def bash(program):
    cases = "\n".join(f'    "{" ".join(command.words[1:])}") words="{" ".join(words_of(command))}" ;;'
                      for command in all_commands(program))
    commands = " ".join(f'"{" ".join(command.words[1:])}"' for command in all_commands(program)[1:])
    return f"""# bash completion for tensorray, made from its --help
_tensorray() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} command="" known words i
  for ((i = 1; i < COMP_CWORD; ++i)); do
    for known in {commands}; do
      [ "${{command:+$command }}${{COMP_WORDS[i]}}" != "$known" ] || {{ command=$known; break; }}
    done
  done
  case $command in
{cases}
  esac
  # Names of files and values are completed by the default.
  if [[ $word == -* || ( -z $command || $command == make ) ]]; then
    COMPREPLY=($(compgen -W "$words" -- "$word"))
  else
    COMPREPLY=()
  fi
}}
complete -o default -F _tensorray tensorray
"""


def zsh_text(text):
    for mark in ("\\", "'", "[", "]", ":"):
        text = text.replace(mark, {"'": "'\\''"}.get(mark, "\\" + mark))
    return text


def zsh_argument(option):
    values = ":value:_files" if option.argument else ""
    names = option.names
    if len(names) == 1:
        return f"'*{names[0]}[{zsh_text(option.text)}]{values}'"
    return f"'*'{{{','.join(names)}}}'[{zsh_text(option.text)}]{values}'"


def zsh_function(command):
    name = "_" + "_".join(command.words).replace("-", "_")
    arguments = [zsh_argument(option) for option in command.options]
    if not command.commands:
        lines = ["  _arguments \\", *(f"    {argument} \\" for argument in arguments), "    '*:file:_files'"]
        return "\n".join([f"{name}() {{", *lines, "}"])
    described = " ".join(f"'{below.name}:{zsh_text(below.summary)}'" for below in command.commands)
    cases = "\n".join(f"    {below.name}) {name}_{below.name.replace('-', '_')} ;;" for below in command.commands)
    lines = ["  local context state line", "  _arguments -C \\",
             *(f"    {argument} \\" for argument in arguments),
             "    '1: :->command' '*:: :->rest'", f"  local -a commands=({described})", "  case $state in",
             "  command) _describe command commands ;;", "  rest) case $words[1] in", cases, "    esac ;;", "  esac"]
    return "\n".join([f"{name}() {{", *lines, "}"])


def zsh(program):
    functions = "\n\n".join(zsh_function(command) for command in reversed(all_commands(program)))
    head = "#compdef tensorray\n# zsh completion for tensorray, made from its --help"
    return f'{head}\n\n{functions}\n\n_tensorray "$@"\n'


def fish_quoted(text):
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"


def fish_line(condition, option):
    flags = "".join(f" -l {name[2:]}" if name.startswith("--") else f" -s {name[1:]}" for name in option.names)
    value = " -r" if option.argument else ""
    return f"complete -c tensorray -n {fish_quoted(condition)}{flags}{value} -d {fish_quoted(option.text)}"


def fish(program):
    lines = ["# fish completion for tensorray, made from its --help"]
    for command in all_commands(program):
        seen = [f"__fish_seen_subcommand_from {word}" for word in command.words[1:]]
        names = " ".join(below.name for below in command.commands)
        here = "; and ".join(seen + ([f"not __fish_seen_subcommand_from {names}"] if names else [])) or "true"
        for below in command.commands:
            meaning = fish_quoted(below.summary)
            lines.append(f"complete -c tensorray -f -n {fish_quoted(here)} -a {below.name} -d {meaning}")
        lines += [fish_line(here, option) for option in command.options]
    return "\n".join(lines) + "\n"
