"""`brakecli new`."""

from difflib import get_close_matches
from pathlib import Path
from typing import Annotated

import typer

from brakecli.cli.options import Force, Quiet, option, output_option
from brakecli.cli.output import show, warn
from brakecli.errors import UsageError, printable
from brakecli.faces import as_argument

NAME = "Name of the file, with or without .toml; that of a starter gives this one, others the starter of a case."


def command(
    name: Annotated[str, typer.Argument(metavar="NAME", help=NAME)] = "case",
    listed: Annotated[bool, option("List the starters with their questions.", None, "--list")] = False,
    output: Annotated[Path | None, output_option("File to write", "NAME.toml")] = None,
    mass: Annotated[float | None, option("Mass of the shoe of a brake of your own.", "KG")] = None,
    frequency: Annotated[float | None, option("Frequency of the mode that vibrates.", "HZ")] = None,
    load: Annotated[float | None, option("Force that presses the shoe on.", "N")] = None,
    speed: Annotated[float | None, option("Speed of the wheel's surface.", "M/S")] = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Write a commented case that runs, also of your own brake."""
    from brakecli.analysis.similar import Brake, similar
    from brakecli.case.read import starters
    from brakecli.files.atomic import new_output
    from brakecli.views.terminal import grid

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
    if near and starter not in texts:
        remedy = f"did you mean {near[0]}? A file of that name has the option -o"
        raise UsageError(f"no starter is called {printable(starter)}; {remedy}")
    base = text.partition('\ncase = "')[2].partition('"')[0]
    brake = Brake(mass, frequency, load, speed)
    of_brake = None
    if brake != Brake():
        if base:
            remedy = f"give them to a starter of a case, and name that case in {starter}.toml"
            raise UsageError(f"{starter} is no case, and the numbers of a brake make one; {remedy}")
        of_brake = similar(starter if starter in texts else "case", text, brake)
        text = of_brake.text
    # a sweep or a study has a base
    written = {path: text}
    if base and not (path.parent / base).exists():
        written[path.parent / base] = texts[base.removesuffix(".toml")]
    for place, content in written.items():
        with new_output(place, force=force) as file:
            file.write(content.encode())
            file.publish()
    if not quiet:
        shown = f"brakecli branch {as_argument(path)} --parameter friction.coefficient=0:1"
        follows = starter == "branch"
        verb = "scatter" if text == texts["scatter"] else "sweep" if base else "run"
        how = shown if follows else f"brakecli {verb} {as_argument(path)}"
        show(f"{' and '.join(map(str, written))}: written; run it with: {how}")
        if of_brake:
            show(of_brake.sentence)
    if of_brake:
        from brakecli.case.read import parse_case
        from brakecli.front.asked import slips_in

        warn(*slips_in(parse_case(text, str(path))))
