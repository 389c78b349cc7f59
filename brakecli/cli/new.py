"""`brakecli new`."""

from difflib import get_close_matches
from pathlib import Path
from typing import Annotated

import typer

from brakecli.cli.options import Force, Quiet, option, output_option
from brakecli.cli.output import show
from brakecli.errors import UsageError, printable
from brakecli.faces import as_argument
from brakecli.front.progress import say

NAME = "Name of the file, with or without .toml; that of a starter gives this one, others the starter of a case."


def command(
    name: Annotated[str, typer.Argument(metavar="NAME", help=NAME)] = "case",
    listed: Annotated[bool, option("List the starters with their questions.", None, "--list")] = False,
    output: Annotated[Path | None, output_option("File to write", "NAME.toml")] = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Write a commented starter case or sweep that runs."""
    from brakecli.case.read import starters
    from brakecli.files.atomic import new_output
    from brakecli.front.tables import grid

    texts = starters()
    if listed:
        questions = [text.partition("\n")[0].removeprefix("# ") for text in texts.values()]
        show(grid({"starter": [*texts], "its question": questions}))
        return
    if not name:
        raise UsageError("the name is empty; give one, or leave it out for case.toml")
    path = output or Path(name if name.endswith(".toml") else f"{name}.toml")
    starter = name.removesuffix(".toml")
    text = texts.get(starter, texts["case"])
    near = get_close_matches(starter, texts, n=1, cutoff=0.7)
    # a sweep or a study has one
    written = {path: text}
    base = text.partition('\ncase = "')[2].partition('"')[0]
    if base and not (path.parent / base).exists():
        written[path.parent / base] = texts[base.removesuffix(".toml")]
    for place, content in written.items():
        with new_output(place, force=force) as file:
            file.write(content.encode())
            file.publish()
    if not quiet:
        shown = f"brakecli branch {as_argument(path)} --parameter friction.coefficient=0:1"
        follows = text == texts["branch"]
        verb = "scatter" if text == texts["scatter"] else "sweep" if base else "run"
        how = shown if follows else f"brakecli {verb} {as_argument(path)}"
        show(f"{' and '.join(map(str, written))}: written; run it with: {how}")
        if near and starter not in texts:
            say(f"no starter is called {printable(starter)}, so this is that of a case; did you mean {near[0]}?")
