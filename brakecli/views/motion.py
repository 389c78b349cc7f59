"""The view of a motion: of a run, of a stored run, or of a measured signal."""

import re
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from brakecli.analysis.regime.decision import Excitation, Regime, Thresholds
from brakecli.results import fields
from brakecli.results.field import Field, named
from brakecli.solver.contact import EVALUATORS
from brakecli.views.render import Renderer, text_of
from brakecli.views.view import Row, Table, View, details, sentence

MOST_LISTED_BURSTS = 12
MOST_SAID = 3
"""Intervals of vibration that a sentence names."""
_WORDS = {
    Regime.RELAXATION: "it vibrates, with stick in every cycle or nearly (relaxation)",
    Regime.QUASI_HARMONIC: "it vibrates, without stick (quasi-harmonic)",
    Regime.DAMPED: "it does not vibrate by itself, what moves it dies away (damped)",
}
_FORCED = "it does not vibrate by itself, the roughness of the wheel shakes it (damped, forced)"
_FEW_STICK = "it vibrates, without stick in most cycles (quasi-harmonic)"
_LENGTH = re.compile(r"(\d+(?:\.\d+)?(?:e[-+]\d+)?) m(?![\w/²·])")
_TORQUE = ("braking_torque", "torque_variation")
_ASIDE = (
    *("excitation", "mean_friction_force", "amplitude_first", "forced_frequency", "growth_rate"),
    *("ringing_frequency", "amplitude_forced", "amplitude_own"),
)


def of_run(numbers: Mapping[str, Any], title: str, output: str, show: Renderer) -> View:
    """A run, by the names and values that `--json` gives them."""
    numbers = above_rounding(numbers)
    resolution = numbers["frequency_resolution"]
    peak = numbers["spectrum_peak"]
    error = abs(numbers["energy"]["relative_closing_error"])
    settled = (
        f"{'' if numbers['settled'] else 'none; the numbers are those '}from {numbers['settled_from']:.4g} s on"
    )
    step = "" if numbers["step"] is None else f" of {numbers['step']:.4g} s"
    below = [
        Row("peak of the spectrum of vx", show.with_error(peak, resolution, "Hz") if peak else "not resolved"),
        Row("settled part", settled),
        Row("scheme", _scheme(numbers)),
        Row("contact", _contact(numbers)),
        Row("modelled", "; ".join(numbers["modelled"])),
        Row("left out", "; ".join(numbers["left_out"]) or "nothing"),
        Row("steps", f"{numbers['steps']}{step}, {numbers['contact_evaluations']} contact evaluations"),
        Row("energy account", f"closes to {error:.1e} of its largest item"),
        Row("time of the loop", text_of(numbers["solve_seconds"], "s", ".3g")),
    ]
    blocks = [*_numbers(numbers, show), *_torque(numbers, show), *_certificate(numbers), *details(*below)]
    return View(title, [motion_sentence(numbers, show)], [*blocks, Row("file", output)])


def of_verdict(numbers: Mapping[str, Any], source: str, show: Renderer) -> View:
    """A verdict with its evidence, by the names and values that `--json` gives them."""
    numbers = above_rounding(numbers)
    unit = str(numbers.get("unit") or "")
    noise_unit = "m/s" if unit == "m/s²" else unit  # an acceleration is judged by its integral
    rows = [*_ringing(numbers, show), *_numbers(numbers, show), *_torque(numbers, show)]
    tones = numbers.get("bursts") or ()
    for tone in tones[:MOST_LISTED_BURSTS]:
        when = f"{tone['start']:.4g} to {tone['end']:.4g} s"
        level = f"{tone['level']:.3g} {unit}"
        rows.append(Row("burst", f"{when}: {show.text(tone['frequency'], 'Hz')}, {level}", detail=True))
    if len(tones) > MOST_LISTED_BURSTS:
        rows.append(Row("bursts", f"{len(tones) - MOST_LISTED_BURSTS} more, see --json", detail=True))
    evidence = []
    for name, value in (numbers.get("evidence") or {}).items():
        unit = noise_unit if name == "noise" else fields.evidence_unit(name)
        evidence.append(Row(name.replace("_", " "), show.text(value, unit)))
    return View(source, [motion_sentence(numbers, show)], [*rows, *details(*evidence)])


def of_verdicts(results: Sequence[Mapping[str, Any]]) -> View:
    """The verdicts on several files, one in a row."""
    columns = {
        "file": [verdict["source"] for verdict in results],
        "regime": [verdict.get("regime", "unreadable") for verdict in results],
        "Hz": [_tone(verdict, text_of(verdict.get("frequency"), form=".5g")) for verdict in results],
        "because": [verdict.get("error") or "; ".join(verdict["reasons"]) for verdict in results],
    }
    return View("", blocks=[Table(columns)])


def motion_sentence(numbers: Mapping[str, Any], show: Renderer, *, full: bool = False) -> str:
    """What a motion is, and why; a `full` sentence names its frequency, its amplitude, stick and lost contact."""
    if numbers.get("status") == "failed":
        return sentence(f"the run failed: {numbers.get('failure', '')}")
    regime = numbers.get("regime")
    reasons = "; ".join(reasons_of(numbers, show))
    if changing := _while_it_changes(numbers, show):
        return changing
    words = {str(name): words for name, words in _WORDS.items()}.get(str(regime), "")
    if regime == Regime.DAMPED and numbers.get("excitation") == Excitation.FORCED:
        words = _FORCED
    if regime == Regime.QUASI_HARMONIC and (numbers.get("stick_fraction") or 0.0) > 0.0:
        words = _FEW_STICK
    if not words:
        bursts = len(numbers.get("bursts") or ())
        if bursts > 1 and reasons.startswith(f"in {bursts} bursts"):
            return sentence(f"it vibrates {reasons}")
        said = f"it vibrates in {bursts} bursts" if bursts > 1 else "this is not decided (undecided)"
        return sentence(f"{said}: {reasons}")
    named_numbers = _named_numbers(numbers, show) if full else []
    return sentence(f"{', '.join([words, *named_numbers])}: {reasons}")


def reasons_of(numbers: Mapping[str, Any], show: Renderer) -> list[str]:
    """Why the regime is what it is; lengths have the prefix that they have elsewhere."""
    return [
        _LENGTH.sub(lambda length: show.text(float(length[1]), "m"), str(reason))
        for reason in numbers.get("reasons", ())
    ]


def _named_numbers(numbers: Mapping[str, Any], show: Renderer) -> list[str]:
    """The numbers of a vibration as parts of a sentence."""
    if (frequency := numbers.get("frequency")) is None:
        return []
    phrases = [f"at {frequency:.4g} Hz"]
    if (amplitude := numbers.get("amplitude")) is not None:
        phrases.append(f"amplitude along the wheel {show.text(float(f'{amplitude:.3g}'), 'm')}")
    for name, what in (("stick_fraction", "stick"), ("contact_loss_fraction", "no contact")):
        if share := numbers.get(name):
            phrases.append(f"{what} {share:.1%} of the time")
    return phrases


def _while_it_changes(numbers: Mapping[str, Any], show: Renderer) -> str:
    """When it vibrates, where speed or load change; empty elsewhere."""
    intervals = numbers.get("vibrations")
    if not intervals:
        return ""
    said = []
    for interval in intervals[:MOST_SAID]:
        tone = "" if interval["frequency"] is None else f"{show.text(interval['frequency'], 'Hz')}, "
        most = f"{tone}{show.text(interval['amplitude'], 'm')}, most at {show.text(interval['speed'], 'm/s')}"
        said.append(f"from {interval['start']:.4g} to {interval['end']:.4g} s ({most})")
    more = f", and in {len(intervals) - MOST_SAID} more intervals" * (len(intervals) > MOST_SAID)
    stands = (numbers.get("evidence") or {}).get("wheel_stands")
    after = ", then rests" if stands else ""
    return sentence(f"it vibrates {', '.join(said)}{more}{after}")


def above_rounding(numbers: Mapping[str, Any]) -> dict[str, Any]:
    """The numbers of a motion, those at rest 0 that are no more than the rounding of steady sliding itself.

    There the torque has the size of its mean. The friction force F strains the links to the energy E, and a
    displacement of 2E/F, that of a spring which takes all of it.
    """
    torque, force = (abs(numbers.get(name) or 0.0) for name in ("braking_torque", "mean_friction_force"))
    links = (numbers.get("energy") or {}).get("links") or 0.0
    sizes = {"torque_variation": torque, "amplitude": 2.0 * links / force if force else 0.0}
    # two dozen sums and products of a step, each of which rounds by half of an epsilon at most
    rounding = 16 * sys.float_info.epsilon
    small = [name for name, size in sizes.items() if abs(numbers.get(name) or 0.0) <= rounding * size]
    return {**numbers, **{name: 0.0 for name in small if numbers.get(name) is not None}}


def _numbers(numbers: Mapping[str, Any], show: Renderer) -> list[Row]:
    """Frequency, amplitude, parts of the time in stick and without contact; on demand what else is known."""
    changes = bool(numbers.get("vibrations"))
    rows = []
    if numbers.get("frequency") is not None:
        rows.append(Row("frequency", _tone(numbers, show.text(numbers["frequency"], "Hz"))))
    spread = numbers.get("amplitude_spread")
    size = numbers.get("amplitude")
    if size is not None:
        amplitude = show.with_error(size, spread if spread is not None and spread < size else None, "m")
        rows.append(Row("amplitude of x", amplitude + _when(numbers), detail=changes))
    shares = _fields_with_values(numbers, "stick_fraction", "contact_loss_fraction")
    for field, share in shares:
        aside_here = changes and field.name != "stick_fraction"
        rows.append(Row(field.title, show.field(field, share), detail=aside_here or not share))
    aside = [Row("regime", str(numbers.get("regime", "")))]
    names = [name for name in _ASIDE if name != "ringing_frequency" or numbers.get("damping_ratio") is None]
    aside += [Row(field.title, show.field(field, value)) for field, value in _fields_with_values(numbers, *names)]
    unsaid = (numbers.get("vibrations") or ())[MOST_SAID:]
    aside += [Row("vibrates", f"{interval['start']:.4g} to {interval['end']:.4g} s") for interval in unsaid]
    aside += [Row("disturbances", text) for text in disturbances(numbers)]
    return [*rows, *details(*aside)]


def _ringing(numbers: Mapping[str, Any], show: Renderer) -> list[Row]:
    """With what a measured vibration has died out."""
    if numbers.get("damping_ratio") is None:
        return []
    frequency, ratio = (
        show.with_error(numbers[name], numbers[f"{name}_error"], unit)
        for name, unit in (("ringing_frequency", "Hz"), ("damping_ratio", ""))
    )
    return [Row("rings at", frequency), Row("damping ratio", ratio)]


def _torque(numbers: Mapping[str, object], show: Renderer) -> list[Row]:
    """The mean braking torque and its variation, where they are known."""
    when = {"torque_variation": _when(numbers)}
    values = _fields_with_values(numbers, *_TORQUE)
    return [Row(field.title, show.field(field, value) + when.get(field.name, "")) for field, value in values]


def _when(numbers: Mapping[str, object]) -> str:
    """From when the amplitude and the variation of the torque are, where a run dies out."""
    run = numbers.get("amplitude_first") is not None
    return ", in the last tenth" * (run and numbers.get("excitation") == Excitation.NONE)


def _fields_with_values(numbers: Mapping[str, object], *names: str) -> list[tuple[Field, object]]:
    """The fields of a verdict that have a value, with it."""
    declared = named(fields.VERDICT, *names)
    return [(field, numbers[field.name]) for field in declared if numbers.get(field.name) is not None]


def _certificate(numbers: Mapping[str, object]) -> list[Row]:
    """What is known of the error of the motion."""
    error = numbers.get("estimated_error")
    certified = numbers.get("certified")
    if certified is None and error is None:
        return []
    bound = "not known" if error is None else f"{'at most ' if certified else ''}{error:.1e} of its largest value"
    by = numbers.get("certified_by")
    return [Row("numerical error of the motion", bound), *details(*[Row("known by", str(by))] * bool(by))]


def _scheme(numbers: Mapping[str, Any]) -> str:
    """The scheme, with its weights, or with its tolerance."""
    name = str(numbers["scheme"])
    if numbers["step"] is not None:
        weights = ", ".join(f"{weight:.4g}" for weight in numbers["theta"])
        return f"{name} ({weights}), {numbers['iteration']}"
    tolerance = numbers["tolerance"]
    return name if tolerance is None else f"{name}, tolerance {tolerance:.4g}"


def _contact(numbers: Mapping[str, Any]) -> str:
    """Which evaluators of the contact took which part of the steps."""
    counts = numbers["evaluators"]
    shares = ", ".join(f"{kind} {count / max(numbers['steps'], 1):.1%}" for kind, count in counts.items())
    on_nodes = any(EVALUATORS[kind].needs_nodes for kind in counts)
    return shares + (f", {numbers['nodes']} nodes" if on_nodes else "")


def _tone(numbers: Mapping[str, object], shown: str) -> str:
    """A frequency; before a motion has settled it is not that of the motion which lasts."""
    return shown if shown == "-" or numbers.get("settled", True) else f"{shown}, not settled"


def disturbances(numbers: Mapping[str, Any]) -> list[str]:
    """Whether neighbours of a motion come to it, where that was asked."""
    rate = numbers.get("lyapunov_exponent")
    error = numbers.get("lyapunov_error")
    if rate is None or error is None:
        return []
    what = "fade" if rate < 0.0 else "grow"
    doubt = "" if abs(rate) > Thresholds.sure_errors * error else ", which is not told from 0"
    return [f"small ones {what} at {abs(rate):.3g} ± {error:.2g} 1/s{doubt}"]
