"""The options of each command that Python has as well, a record each."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from os import PathLike
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

from brakecli.analysis.branches.pushes import MOST_PUSHES, PUSHES
from brakecli.api.options import Description

if TYPE_CHECKING:
    import xarray as xr

    from brakecli.case.read import LoadedCase
    from brakecli.studies.scattering.study import LoadedStudy
    from brakecli.studies.sweeps.plan import LoadedSweep

    File: TypeAlias = str | PathLike[str]
    Result: TypeAlias = str | PathLike[str] | xr.Dataset | xr.DataTree
    Source: TypeAlias = str | PathLike[str] | LoadedCase
    Changes: TypeAlias = Mapping[str, Any] | list[str]
    Keys: TypeAlias = str | tuple[str, ...]
    Counter: TypeAlias = bool | Callable[[str, int, int], None]


def setting(meaning: str, python: str) -> Description:
    """The option that sets keys."""
    return Description(meaning, "KEY.PATH=VALUE", names=("--set",), shell=list[str], python=python)


def target(meaning: str, default: str, python: str = "a result file to keep; none if left out.") -> Description:
    """The option that names the file to write."""
    return Description(meaning, "PATH", names=("--output", "-o"), default=default, python=python)


def in_python(meaning: str) -> Description:
    """An option that the shell does not have."""
    return Description(meaning, in_shell=False)


IN_PYTHON = "path of a case file or of a result, or what `load` gave."
CHANGED = 'keys of the case to change, as `{"friction.coefficient": 0.4}`'
SET = "Set a key of the case, the value in TOML; repeatable."
Case = Annotated[
    "Source", Description('Case file, or "-" for standard input.', "CASE.toml", by_place=True, python=IN_PYTHON)
]
Settings = Annotated["Changes | None", setting(SET, f"{CHANGED}.")]
Progress = Annotated["Counter", in_python("as for `run`.")]
Force = Annotated[bool, Description("Replace an existing output.", python="replace that file if it exists.")]
Pushes = Annotated[
    int,
    Description(
        "Five times as many pushes seek further vibrations; 0 for none.",
        "N",
        least=0,
        most=MOST_PUSHES,
        python="five times as many seek vibrations that no branch from flutter reaches; 0 for none.",
    ),
]
Jobs = Annotated[
    int | None,
    Description(
        "Worker processes",
        "N",
        names=("--jobs", "-j"),
        least=1,
        most=4096,
        default="one for each core; none for a second of work",
        python="worker processes; one for each core if left out.",
    ),
]
Scheduler = Annotated[
    Any,
    Description(
        "Compute on a dask cluster: the scheduler's address, as tcp://host:8786",
        "ADDRESS",
        default="that in DASK_SCHEDULER_ADDRESS, if there is one",
        python="compute on a dask cluster: its client, the cluster, or the address of its scheduler. If left out "
        "it is the address in the environment's `DASK_SCHEDULER_ADDRESS`, if there is one.",
    ),
]
SchedulerFile = Annotated[str | None, Description("The same cluster, given by the scheduler's file.", "FILE")]


@dataclass(frozen=True)
class Run:
    """Options of `run`."""

    case: Annotated[
        "Source",
        Description(
            'Case file, "-" for standard input, or a result file, whose case is run again.',
            "CASE.toml",
            by_place=True,
            python=IN_PYTHON,
        ),
    ]
    settings: Annotated[
        "Changes | None",
        setting(
            SET,
            f'{CHANGED}; a table as `{{"solver": {{"tolerance": 1e-4}}}}` replaces the one that the case has. A '
            "measured profile may be an array of places and heights (m): "
            '`{"roughness.wheel.profile": np.column_stack([places, heights])}`.',
        ),
    ] = None
    _: KW_ONLY
    output: Annotated["File | None", target("Result file", "the case's name with .h5, here")] = None
    progress: Annotated[
        "Counter",
        in_python(
            "True shows how far it is, as the command does; or a function that is called with what is counted, "
            "how many are done, and how many there are (0 if unknown)."
        ),
    ] = False
    force: Force = False


@dataclass(frozen=True)
class Stability:
    """Options of `stability`."""

    case: Case
    settings: Settings = None
    _: KW_ONLY
    vary: Annotated[
        "Mapping[Keys, Iterable[float] | Mapping[str, Any]] | str | None",
        Description(
            "Follow both modes along a key, or along several alike.",
            "KEY[,KEY]=START:STOP:NUM",
            python="one key, or several that take the same value, with values that rise or fall, as "
            '`{"friction.coefficient": np.linspace(0, 1, 101)}`: follows both modes along them. A range is '
            'written as in a sweep: `{"friction.coefficient": {"start": 0, "stop": 1, "num": 101}}`.',
        ),
    ] = None
    pushes: Pushes = PUSHES
    output: Annotated[
        "File | None", target("File of --vary: .h5 or .csv", "none", "a file of `vary` to keep, .h5 or .csv.")
    ] = None
    progress: Progress = False
    force: Force = False


@dataclass(frozen=True)
class Branch:
    """Options of `branch`."""

    case: Case
    settings: Settings = None
    _: KW_ONLY
    parameter: Annotated[
        "Mapping[Keys, tuple[float, float]] | str",
        Description(
            "Follow all motions along a key, or along several that take the same value.",
            "KEY[,KEY]=LOW:HIGH",
            python='one key with both ends of its range, as `{"friction.coefficient": (0.0, 1.0)}`; a tuple of '
            "keys takes the same value.",
        ),
    ]
    start: Annotated[
        "Result | Sequence[Result] | None",
        Description(
            "Also follow the motion that the end of this run comes to; repeatable.",
            "FILE.h5",
            shell=list[str],
            python="what `run` gave, or the path of a result, whose end comes to a motion that is followed, too; "
            "or a list of them.",
        ),
    ] = None
    switch: Annotated[bool, Description("Also follow the motions of twice the period from each flip.")] = False
    pushes: Pushes = PUSHES
    output: Annotated["File | None", target("Result file, .h5", "none")] = None
    progress: Progress = False
    force: Force = False


@dataclass(frozen=True)
class Advise:
    """Options of `advise`."""

    case: Case
    settings: Settings = None
    _: KW_ONLY
    keys: Annotated[
        "str | Iterable[str] | None",
        Description(
            "Keys that may be advised, with * for any part; masses, stiffnesses, dampings, angles and load if "
            "left out.",
            "KEY,…",
        ),
    ] = None
    margin: Annotated[
        float,
        Description(
            "Part of its friction by which the case is to stay stable above it.",
            "PART",
            least=0.0,
            most=10.0,
        ),
    ] = 0.2
    scatter: Annotated[
        "File | LoadedStudy | None",
        Description(
            "Rank by the squeal that is left where keys scatter as in a study.",
            "STUDY.toml",
            python="path of a study file, or what `load` gave: advice is ranked by the probability of squeal that "
            "is left. If left out, stiffnesses and friction scatter by 10 %, and the smallest change comes first.",
        ),
    ] = None
    progress: Progress = False


@dataclass(frozen=True)
class Sweep:
    """Options of `sweep`."""

    source: Annotated[
        "Source | LoadedSweep",
        Description(
            'Sweep file, or "-" for standard input.',
            "SWEEP.toml",
            by_place=True,
            python="path of a sweep file, or what `load` gave; with `axes`, `points` or `critical` a case.",
        ),
    ]
    settings: Annotated[
        "Changes | None",
        setting("Set a key of the base case or of [critical]; repeatable.", "keys of the base case to change."),
    ] = None
    _: KW_ONLY
    axes: Annotated[
        "Mapping[Keys, Iterable[Any]] | None",
        in_python(
            'values of each key, as `{"friction.coefficient": [0.3, 0.5]}`; a tuple of keys takes the same '
            "values. A range is written as in a file: "
            '`{"friction.coefficient": {"start": 0.1, "stop": 0.5, "num": 5}}`.'
        ),
    ] = None
    points: Annotated[
        "Mapping[str, Iterable[Any]] | None",
        in_python(
            'points in place of a grid: the values of each key at all of them, as `{"shoe.mass": [10.0, 12.0], '
            '"friction.coefficient": [0.3, 0.5]}` or as a data frame; the dataset has the dimension `point`.'
        ),
    ] = None
    critical: Annotated[
        "Changes | None",
        in_python('the keys of `[critical]`, as `{"parameter": "friction.coefficient", "lower": 0, "upper": 2}`.'),
    ] = None
    direction: Annotated[
        "str | Mapping[Keys, str] | None",
        in_python(
            '"up", "down" or "both" follows the motion along the only axis, each point from the end of the one '
            'before; of several axes name one, as `{"friction.coefficient": "both"}`. With "both" the dataset has '
            "the dimension `direction` as well."
        ),
    ] = None
    output: Annotated[
        "File | None",
        target(
            "Result file",
            "the sweep's name with .h5, here",
            "a result file to keep; with it, an interrupted sweep goes on where it was.",
        ),
    ] = None
    jobs: Jobs = None
    scheduler: Scheduler = None
    scheduler_file: SchedulerFile = None
    task_size: Annotated[
        int | None, Description("Points in each task", "N", least=1, default="as many as take 0.2 s")
    ] = None
    progress: Progress = False
    force: Annotated[
        bool,
        Description(
            "Replace an existing output, and drop finished points of another sweep.",
            python="replace that file if it exists, and drop finished points of another sweep.",
        ),
    ] = False


@dataclass(frozen=True)
class Scatter:
    """Options of `scatter`."""

    source: Annotated[
        "File | LoadedStudy",
        Description(
            'Study, or "-" for standard input.',
            "STUDY.toml",
            by_place=True,
            python="path of a study file, or what `load` gave.",
        ),
    ]
    settings: Annotated[
        "Changes | None",
        setting(
            "Set a key of the study, as samples, or of its case; repeatable.",
            'keys of the study to change, as `{"samples": 4096}`, or of its case.',
        ),
    ] = None
    _: KW_ONLY
    output: Annotated[
        "File | None",
        target(
            "Result file",
            "the study's name with .h5, here",
            "a result file to keep; with it, an interrupted study of runs goes on where it was.",
        ),
    ] = None
    jobs: Jobs = None
    scheduler: Scheduler = None
    scheduler_file: SchedulerFile = None
    progress: Progress = False
    force: Force = False


WHAT = "What was measured: displacement, velocity, acceleration, force, torque or pressure (of .wav, if left out)."
Quantity = Annotated[str | None, Description(WHAT, "QUANTITY")]


@dataclass(frozen=True)
class Signal:
    """How a signal was measured, and on what, in options that `classify` and `plot` share."""

    _: KW_ONLY
    column: Annotated[
        str | int | None, Description("Column of the signal, by name or number; channel of a .wav.", "NAME")
    ] = None
    time_column: Annotated[str | int | None, Description("Column of the time, by name or number.", "NAME")] = None
    sample_rate: Annotated[float | None, Description("Samples per second.", "HZ")] = None
    unit: Annotated[
        str | None, Description("Unit of the signal, as mm/s or g; SI, or that of the file, if left out.", "UNIT")
    ] = None
    time_unit: Annotated[
        str | None, Description("Unit of the time column, as ms; that of the file, or s, if left out.", "UNIT")
    ] = None
    belt_speed: Annotated[
        float | None,
        Description(
            "Speed of the wheel's surface, if known.",
            "M/S",
            python="speed of the wheel's surface (m/s), if known.",
        ),
    ] = None
    stiffness: Annotated[
        float | None,
        Description(
            "Stiffness behind a measured force, if known.",
            "N/M",
            python="stiffness behind a measured force (N/m), if known.",
        ),
    ] = None


@dataclass(frozen=True)
class Classify(Signal):
    """Options of `classify`."""

    source: Annotated[
        "Result",
        Description(
            "Results of runs; with --quantity measured signals: text files, .wav, datasets of HDF5 files "
            "(FILE.h5:/path).",
            "FILE",
            by_place=True,
            shell=list[str],
            python="what `run` gave, or the path of a result, or of a measured signal.",
        ),
    ]
    quantity: Quantity = None
    _: KW_ONLY
    thresholds: Annotated[
        "Mapping[str, float] | None",
        Description(
            "Change a threshold of the verdict; repeatable.",
            "NAME=VALUE",
            names=("--threshold",),
            shell=list[str],
            python="those to change, by name.",
        ),
    ] = None


@dataclass(frozen=True)
class Plot(Signal):
    """Options of `plot`."""

    result: Annotated[
        "Result",
        Description(
            "Result of any kind; with --quantity a measured signal, as for classify.",
            "FILE",
            by_place=True,
            python="what another function gave, or the path of a result; with `quantity` that of a measured "
            "signal.",
        ),
    ]
    quantity: Quantity = None
    _: KW_ONLY
    output: Annotated[
        "File | None",
        target("Picture", "FILE.png, here", "a picture to write, .png, .pdf or .svg; none if left out."),
    ] = None
    select: Annotated[
        "Changes | None",
        Description(
            "Draw the nearest value of a sweep's axis; repeatable.",
            "KEY=VALUE",
            shell=list[str],
            python='values of a sweep\'s axes of which the nearest are drawn, as `{"friction.coefficient": 0.4}`.',
        ),
    ] = None
    variable: Annotated[
        str | None,
        Description(
            "Draw this number of a sweep; of branches the amplitude of x, y or vx, the mean, or another number; "
            "of a run x, y, vx, vy, friction_force, normal_force, torque or contact_fraction.",
            "NAME",
        ),
    ] = None
    section: Annotated[
        str | None,
        Description(
            "Draw the Poincaré section of a run in place of its histories: its states once in each period of a "
            'passing "wave", or at its events stick, slip, turn, lift-off or touch.',
            "NAME",
        ),
    ] = None
    force: Force = False


@dataclass(frozen=True)
class Report:
    """Options of `report`."""

    results: Annotated[
        "Sequence[Result]",
        Description(
            "Results of any kind; two or three of one kind stand beside each other.",
            "FILE.h5…",
            by_place=True,
            shell=list[str],
            python="what other functions gave, or paths of results: of runs, sweeps, comparisons, stability with "
            "`vary`, branches or scatter; two or three of one kind stand beside each other.",
        ),
    ]
    _: KW_ONLY
    output: Annotated[
        "File | None",
        target(
            "Page, .html, or .pdf with weasyprint",
            "report.html, here",
            "the page to write, .html or .pdf; none if left out.",
        ),
    ] = None
    full: Annotated[bool, Description("Add the case, the evidence, accuracy, warnings, and how to repeat it.")] = (
        False
    )
    progress: Progress = False
    force: Force = False


@dataclass(frozen=True)
class Diff:
    """Options of `diff`."""

    first: Annotated[
        "Result",
        Description(
            "Result of any kind.",
            "A.h5",
            by_place=True,
            python="what another function gave, or the path of a result of any kind.",
        ),
    ]
    second: Annotated["Result", Description("Result of the same kind.", "B.h5", by_place=True)]
    _: KW_ONLY
    output: Annotated[
        "File | None",
        target("Picture of both", "none", "a picture of both to write, .png, .pdf or .svg; none if left out."),
    ] = None
    variable: Annotated[
        str | None, Description("What is drawn of two runs, vx if left out, or of two other results.", "NAME")
    ] = None
    force: Force = False
