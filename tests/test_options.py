"""Records of options: one description for the shell, for docstrings and for signatures."""

import inspect
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated, Any

import pytest
import typer

import brakecli
from brakecli.api.options import Description, takes
from brakecli.cli.options import Quiet, with_options
from brakecli.errors import UsageError
from tests.commands import ROOT

CASE = ROOT / "cases" / "damped.toml"


@dataclass(frozen=True)
class Turn:
    """Options of a command."""

    wheel: Annotated["int | str", Description("Which wheel.", "WHEEL", by_place=True)]
    _: KW_ONLY
    often: Annotated[int, Description("How often.", "N", least=1, python="how often it turns.")] = 3
    back: Annotated[bool, Description("Turn back.", names=("--backwards",))] = False
    told: Annotated["Any", Description("Who is told.", in_shell=False)] = None


@takes(Turn)
def turn(options: Turn) -> tuple[Any, ...]:
    """Turn a wheel.

    Args:
        {options}

    Returns:
        What was asked.
    """
    return options.wheel, options.often, options.back, options.told


def test_a_function_of_a_record_takes_its_fields() -> None:
    assert turn(4) == (4, 3, False, None)
    assert turn("x", often=2, back=True, told=5) == ("x", 2, True, 5)
    shown = str(inspect.signature(turn))
    assert shown == (
        "(wheel: 'int | str', *, often: int = 3, back: bool = False, told: 'Any' = None) -> tuple[typing.Any, ...]"
    )
    assert turn.__doc__ is not None
    assert turn.__doc__.splitlines()[2:7] == [
        "    Args:",
        "        wheel: which wheel.",
        "        often: how often it turns.",
        "        back: turn back.",
        "        told: who is told.",
    ]
    with pytest.raises(TypeError, match="unexpected keyword argument 'offten'"):
        turn(4, offten=2)  # type: ignore[call-arg]


def test_a_command_of_a_record_has_its_fields_as_options(capsys: pytest.CaptureFixture[str]) -> None:
    seen: list[Turn] = []

    @with_options
    def command(options: Turn, quiet: Quiet = False) -> None:
        seen.append(options)
        assert quiet

    app = typer.Typer(add_completion=False)
    app.command()(command)
    shell = typer.main.get_command(app)
    shell.main(["7", "--often", "2", "--backwards", "--quiet"], standalone_mode=False)
    assert seen == [Turn("7", often=2, back=True)]
    assert [each.name for each in shell.params] == ["wheel", "often", "back", "quiet"]
    with pytest.raises(SystemExit):
        shell.main(["7", "--often", "0"])
    assert "--often" in capsys.readouterr().err


def test_python_takes_settings_as_the_shell_does(tmp_path: Path) -> None:
    texts = brakecli.stability(CASE, ["friction.coefficient=0.25"])
    assert texts.identical(brakecli.stability(CASE, {"friction.coefficient": 0.25}))
    along = brakecli.stability(CASE, vary="friction.coefficient=0:1:3", output=tmp_path / "modes.csv")
    assert along["friction_coefficient"].values.tolist() == [0.0, 0.5, 1.0]
    assert len((tmp_path / "modes.csv").read_text().splitlines()) > 3
    with pytest.raises(UsageError, match="output: holds what vary finds; give vary, or leave output out"):
        brakecli.stability(CASE, output=tmp_path / "modes.h5")
    assert not (tmp_path / "modes.h5").exists()
