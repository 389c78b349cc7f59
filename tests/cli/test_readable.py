"""What any command writes, every reader reads: random runs, stops, sweeps, branches and all other kinds."""

import json
import math
import random
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

import brakecli
from brakecli.errors import OtherKindError, UsageError
from brakecli.results.contents import INFO, contents
from brakecli.results.field import values_of
from brakecli.results.read import open_result
from brakecli.views.reports import of_run
from tests.campaign import campaign, counts
from tests.commands import ROOT
from tests.commands import brakecli as command

pytestmark = pytest.mark.usefixtures("compiled")

FOUND = sorted((ROOT / "tests" / "cli" / "unreadable").glob("*.toml"))
"""Runs that were written once, and that nothing could read."""
OF_RUNS = 0.6  # of the draws, are runs


def shoe(chance: random.Random) -> dict[str, object]:
    """A shoe that may squeal, stick, fly or rest; its first mode is of 20 to 2,000 Hz."""

    def between(low: float, high: float) -> float:
        return math.exp(chance.uniform(math.log(low), math.log(high)))

    mass = between(0.1, 50.0)
    first = between(20.0, 2000.0)
    stiffness = mass * (2.0 * math.pi * first) ** 2
    half = between(1e-3, 0.1)
    damping = between(1e-4, 0.05) * math.sqrt(stiffness * mass)
    load = between(0.1, 1e4)
    return {
        "shoe.mass": mass,
        "wheel.radius": between(0.1, 1.0),
        "wheel.angular_speed": chance.choice((-1, 1, 1)) * between(0.01, 30.0),
        "link1.stiffness": stiffness,
        "link1.damping": damping,
        "link1.angle_deg": chance.uniform(-30.0, 30.0),
        "link2.stiffness": between(0.3, 3.0) * stiffness,
        "link2.damping": chance.choice((0.0, damping)),
        "link2.angle_deg": chance.uniform(-5.0, 30.0),
        "load.force": load,
        "friction.coefficient": between(0.05, 3.0),
        "contact.half_length": half,
        "contact.stiffness": between(0.3, 10.0) * stiffness / half,
        "initial.at": chance.choice(("rest", "equilibrium")),
        "initial.vx": chance.uniform(-1.0, 1.0) * between(1e-3, 1.0),
        "solver.duration": chance.uniform(5.0, 40.0) / first,
        "output.sample_interval": 1.0 / (first * between(2.0, 40.0)),
    }


def rough(case: dict[str, object], chance: random.Random) -> None:
    """Waves of the wheel, flat enough to roll over or so high that the shoe flies."""
    count = chance.randrange(1, 4)
    height = 10.0 ** chance.uniform(-7.0, -4.0)
    case["roughness.wheel.amplitudes"] = [height * chance.random() for _ in range(count)]
    case["roughness.wheel.wavelengths"] = [chance.uniform(0.005, 0.05) for _ in range(count)]
    case["solver.duration"] = 0.2 * float(str(case["solver.duration"]))
    case["output.sample_interval"] = 0.2 * float(str(case["output.sample_interval"]))


def stop(case: dict[str, object], chance: random.Random) -> None:
    """Speed or load over time, to rest, through rest, or away from the wheel."""
    seconds = float(str(case["solver.duration"]))
    count = chance.randrange(2, 5)
    times = sorted(chance.uniform(0.0, 1.2) * seconds for _ in range(count))
    key, values = chance.choice((("wheel.angular_speed", "wheel.angular_speeds"), ("load.force", "load.forces")))
    first = float(str(case.pop(key)))
    case[key.partition(".")[0] + ".times"] = times
    case[values] = [first, *(first * chance.choice((0.0, -0.2, 1e-3, chance.random())) for _ in times[1:])]


def stepped(case: dict[str, object], chance: random.Random) -> None:
    """Steps of a given length, some of which are far too long and end the run, or are counted."""
    case["solver.step"] = case["output.sample_interval"]
    case["solver.iteration"] = chance.choice(("newton", "fixed-point"))
    case["solver.allow_unconverged"] = chance.random() < 0.5


def by_itself(case: dict[str, object], chance: random.Random) -> None:
    """As long as it takes, within few steps."""
    case["solver.duration"] = "settled"
    case["solver.budget"] = 20_000


def with_events(case: dict[str, object], chance: random.Random) -> None:
    case["output.events"] = True


Change = Callable[[dict[str, object], random.Random], None]
RUNS: tuple[tuple[Change, ...], ...] = (
    (),
    (rough,),
    (stop,),
    (stop, rough),
    (stepped,),
    (stepped, rough),
    (stepped, stop),
    (by_itself,),
    (with_events,),
    (rough, with_events),
    (stop, with_events),
)
FRICTION = "friction.coefficient"
OTHERS = {
    "listed": 'case = "c.toml"\npoints = "points.csv"\n',
    "grid": f'case = "c.toml"\n[[axis]]\nparameter = "{FRICTION}"\nvalues = [0.1, 0.9]\n',
    "loop": f'case = "c.toml"\n[[axis]]\nparameter = "{FRICTION}"\nvalues = [0.1, 0.5, 0.9]\ndirection = "both"\n',
    "starts": 'case = "c.toml"\n[[axis]]\nparameter = "initial.vx"\nvalues = [0.0, 0.5]\n',
    "critical": f'case = "c.toml"\n[critical]\nparameter = "{FRICTION}"\nlower = 0.0\nupper = 2.0\n'
    'method = "eigenvalue"\n',
    "scatter": f'case = "c.toml"\nsamples = 16\nmethod = "eigenvalue"\n[[parameter]]\nkey = "{FRICTION}"\n'
    'distribution = "uniform"\nlow = 0.1\nhigh = 1.0\n',
}
ALONE = ["o.toml", "--jobs", "1"]
VARY = ["stability", "c.toml", "--vary", f"{FRICTION}=0.1:1.5:5"]
BRANCH = ["branch", "c.toml", "--parameter", f"{FRICTION}=0.1:1.5"]
COMPARE = ["compare-schemes", "c.toml", "--schemes", "two-layer", "--steps", "1e-4,5e-5", "--budget", "0.5"]


def written(folder: Path, chance: random.Random) -> str:
    """Write some result as r.h5, if the case has one; what was done."""
    case = shoe(chance)
    if chance.random() < OF_RUNS:
        changes = chance.choice(RUNS)
        kind = " ".join(each.__name__ for each in changes) or "run"
        words = ["run", "c.toml"]
        for each in changes:
            each(case, chance)
    else:
        kind = chance.choice([*OTHERS, "vary", "branch", "compare"])
        commands = {"vary": VARY, "branch": BRANCH, "compare": COMPARE, "scatter": ["scatter", *ALONE]}
        words = commands.get(kind, ["sweep", *ALONE])
        (folder / "o.toml").write_text(OTHERS.get(kind, ""))
        (folder / "points.csv").write_text(f"{FRICTION},shoe.mass\n0.1,1.0\n0.9,2.0\n0.5,0.5\n")
    text = "".join(f"{key} = {json.dumps(value)}\n" for key, value in case.items())
    (folder / "c.toml").write_text(text)
    done = command(*words, "-o", "r.h5", "--force", "-q", cwd=folder)
    assert done.code in (0, 1, 2, 3), (kind, text, done)
    assert "Traceback" not in done.err, (kind, text, done)
    assert (folder / "r.h5").exists() == (done.code in (0, 1)), (kind, text, done)
    return f"{kind}\n{text}"


def info(path: Path) -> None:
    with open_result(path) as result:
        assert values_of(INFO, contents(result))["whole"]


Reader = Callable[[Path], object]
READERS: list[Reader] = [info, brakecli.load, brakecli.classify, lambda path: brakecli.diff(path, path).same]
SHOWN: list[Reader] = [
    lambda path: brakecli.plot(path, output=path.with_name("p.png"), force=True).clear(),
    brakecli.report,
]
"""Readers that draw, which takes seconds: they read one result in so many, the first among them."""
SPARED = 12


def read_by_all(path: Path, what: str, readers: list[Reader]) -> None:
    """Each reader answers, or says that it is for results of another kind, or that there is nothing to show."""
    for reader in readers:
        try:
            reader(path)
        except (OtherKindError, UsageError):
            pass
        except Exception as error:
            raise AssertionError(f"{reader}: {what}") from error


@pytest.fixture
def without_advice(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages of runs without advice, which takes seconds and is about the case, not about what a file holds."""
    monkeypatch.setattr(of_run, "MOST_WORK", -1.0)


@pytest.mark.usefixtures("without_advice")
@pytest.mark.parametrize("number", counts(8, 30, 600))
def test_every_reader_reads_what_was_written(tmp_path: Path, number: int) -> None:
    chance = random.Random(number)
    read = 0
    for place in range(number):
        what = written(tmp_path, chance)
        if (tmp_path / "r.h5").exists():
            read_by_all(tmp_path / "r.h5", what, READERS + SHOWN * (place % SPARED == 0))
            (tmp_path / "r.h5").unlink()
            read += 1
    assert read > 0.8 * number


@pytest.mark.usefixtures("without_advice")
@pytest.mark.parametrize(
    "path",
    [pytest.param(each, marks=[campaign] * (each.stem != "stop-nofrequency"), id=each.stem) for each in FOUND],
)
def test_what_once_was_unreadable_is_read(tmp_path: Path, path: Path) -> None:
    shutil.copy(path, tmp_path / "c.toml")
    done = command("run", "c.toml", "-o", "r.h5", "--json", "-q", cwd=tmp_path)
    assert done.code in (0, 1)
    numbers = done.json
    assert numbers["estimated_error"] is None or numbers["estimated_error"] < 1.0
    assert "e+" not in done.err
    read_by_all(tmp_path / "r.h5", path.stem, READERS + SHOWN)
