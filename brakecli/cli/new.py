"""`brakecli new`."""

from collections.abc import Iterator
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated

from brakecli.api.options import Description
from brakecli.api.records import Force, target
from brakecli.cli.options import Quiet, with_options
from brakecli.cli.output import show, warn
from brakecli.errors import UsageError, printable
from brakecli.faces import as_argument


@dataclass(frozen=True)
class New:
    """Options of `new`."""

    name: Annotated[
        str,
        Description(
            "Name of the file, with or without .toml; that of a starter gives this one, others the starter of a "
            "case.",
            "NAME",
            by_place=True,
        ),
    ] = "case"
    listed: Annotated[bool, Description("List the starters with their questions.", names=("--list",))] = False
    output: Annotated[str | None, target("File to write", "NAME.toml")] = None
    mass: Annotated[float | None, Description("Mass of the shoe of a brake of your own.", "KG")] = None
    frequency: Annotated[float | None, Description("Frequency of the mode that vibrates.", "HZ")] = None
    load: Annotated[float | None, Description("Force that presses the shoe on.", "N")] = None
    speed: Annotated[float | None, Description("Speed of the wheel's surface.", "M/S")] = None
    friction: Annotated[float | None, Description("Its own friction coefficient.", "PHI")] = None
    force: Force = False


@with_options
def command(options: New, quiet: Quiet = False) -> None:
    """Write a commented case that runs, also of your own brake."""
    from brakecli.analysis.similar import Brake, similar
    from brakecli.case.read import starters
    from brakecli.results.atomic import new_output
    from brakecli.views.terminal import grid

    texts = starters()
    name = options.name
    if options.listed:
        questions = [text.partition("\n")[0].removeprefix("# ") for text in texts.values()]
        show(grid({"starter": [*texts], "its question": questions}))
        return
    if not name:
        raise UsageError("the name is empty; give one, or leave it out for case.toml")
    path = Path(options.output or (name if name.endswith(".toml") else f"{name}.toml"))
    starter = name.removesuffix(".toml")
    text = texts.get(starter, texts["case"])
    near = get_close_matches(starter, texts, n=1, cutoff=0.7)
    if near and starter not in texts:
        remedy = f"did you mean {near[0]}? A file of that name has the option -o"
        raise UsageError(f"no starter is called {printable(starter)}; {remedy}")
    base = text.partition('\ncase = "')[2].partition('"')[0]  # of a sweep or a study
    brake = Brake(options.mass, options.frequency, options.load, options.speed, options.friction)
    of_brake = None
    if brake != Brake():
        if base:
            remedy = f"give them to a starter of a case, and name that case in {starter}.toml"
            raise UsageError(f"{starter} is no case, and the numbers of a brake make one; {remedy}")
        of_brake = similar(starter if starter in texts else "case", text, brake)
        text = of_brake.text
        warn(*_slips(options, text))
    written = {path: text}
    if base and not (path.parent / base).exists():
        written[path.parent / base] = texts[base.removesuffix(".toml")]
    for destination, content in written.items():
        with new_output(destination, force=options.force) as file:
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


def _slips(options: New, text: str) -> Iterator[str]:
    """Warnings of numbers of a brake that no brake has, by the options that give them.

    Others follow from these, or are those of the starter: nobody has slipped there.
    """
    from brakecli.api.commands import slips_in
    from brakecli.case.read import parse_case

    numbers = {
        "shoe.mass": ("--mass", options.mass),
        "load.force": ("--load", options.load),
        "wheel.angular_speed": ("--speed", options.speed),
        "friction.coefficient": ("--friction", options.friction),
    }
    for warning in slips_in(parse_case(text, "the new case")):
        key, _, said = warning.partition(": ")
        option, number = numbers.get(key, ("", None))
        if number is not None:
            yield f"{option}: {said}"
