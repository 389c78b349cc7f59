"""Every number and text of a report, declared once: its name, unit, meaning, type, and where the report holds it.

JSON, the attributes and variables of result files, the records of a sweep, labels in the terminal and the tables
of the documentation (`make tables`) are all made from these rows. `docs/result-format.md` describes the attributes
that all files have in common, `docs/regimes.md` the evidence, and `docs/stability.md` the objects of a report on
stability, which have the attributes of their classes. Those rows stand in `stability_fields`.
"""

import re
from dataclasses import replace

from brakecli.results.field import Field, integer, named, ratio, within
from brakecli.solver.quantities import HISTORY as QUANTITIES
from brakecli.solver.quantities import TIME

TEXT = "S"
OBJECT = "O"
SENTENCE = "S240"
MOST_WINDOWS = 16
WINDOWS = f"({MOST_WINDOWS},)f8"
PAIR = "(2,)f8"

# A run

VERDICT = within(
    "verdict.",
    Field("regime", "", "regime of the motion", "S16"),
    Field("excitation", "", "where the energy of a sustained motion comes from", "S16"),
    Field("frequency", "Hz", "fundamental frequency of vx of a sustained motion"),
    Field("forced_frequency", "Hz", "frequency at which the wave passes that moves x most, of a forced motion"),
    Field(
        "growth_rate",
        "1/s",
        "where the motion is linear: growth rate of its slowest mode, slopes of passing waves included",
    ),
    Field("ringing_frequency", "Hz", "frequency of that mode"),
    Field(
        "amplitude",
        "m",
        "half of peak to peak of x: median of the cycles; where it dies out, of the last tenth of the run",
        label="amplitude of x",
    ),
    Field("amplitude_first", "m", "of a damped motion: half of peak to peak of x in the first tenth of the run"),
    Field("amplitude_spread", "m", "by which the amplitude varies or drifts; missing if unknown"),
    Field("amplitude_forced", "m", "on a rough wheel: what the roughness forces"),
    Field("amplitude_own", "m", "on a rough wheel: what the shoe adds"),
    Field("frequency_resolution", "Hz", "distance of two lines in the spectrum"),
    Field(
        "torque_variation",
        "N m",
        "braking torque, peak to peak; where it dies out, of the last tenth; missing if it rings or "
        "samples miss impacts",
        label="torque variation (peak to peak)",
    ),
    integer("settled", "whether a settled part was found (0, 1); otherwise the second half is judged"),
    Field("settled_from", "s", "start of the settled part, or of the second half"),
    Field("mean_friction_force", "N", "mean friction force on the shoe, from `settled_from` on"),
    Field("braking_torque", "N m", "mean torque of the friction force, from `settled_from` on"),
    ratio("stick_fraction", "part of the time in stick; a median where the motion lasts", label="stick"),
    ratio(
        "contact_loss_fraction",
        "part of the time without contact; a median where the motion lasts",
        label="lost contact",
    ),
    Field("reasons", "", "why the regime is as it is", OBJECT),
    Field(
        "evidence",
        "",
        "answers by which a row of the table decided, and numbers beside them",
        OBJECT,
        group="regime/evidence",
    ),
    Field("thresholds", "", "numbers that decide a verdict", OBJECT, group="regime/thresholds"),
)
DYING = (
    Field("ringing_frequency_error", "Hz", "standard error of the frequency of a measured record that dies out"),
    Field("damping_ratio", "1", "damping ratio of a measured record that dies out, by its logarithmic decrement"),
    Field("damping_ratio_error", "1", "standard error of that damping ratio"),
)
"""What else a measured record shows that dies out; a run has the eigenvalues instead."""
UNIT = Field("unit", "", "unit of a measured record and of its bursts", TEXT)
MEASURED_UNITS = {"displacement": "m", "velocity": "m/s", "force": "N", "torque": "N m"}
MEASURED_UNITS |= {"acceleration": "m/s²", "pressure": "Pa"}
_EVIDENCE_UNITS = {
    "1/s": r"growth.*|lyapunov.*|exponent.*|even(_.*)?|rate_.*",
    "m/s": r"amplitude_v.*|level(_without_waves)?",
    "m": r"amplitude.*",
    "Hz": r"frequency.*|line_freq.*|ringing.*",
    "W": r"power_.*|friction_error.*|roughness_error.*",
    "s": r"(settled_)?duration|seconds|slowest.*|period_.*|(time_)?to_limit",
}
"""Patterns of the names of the evidence, the first that fits; all others are pure numbers."""


def evidence_unit(name: str) -> str:
    """The unit of a number of the evidence; empty for a pure number."""
    return next((unit for unit, names in _EVIDENCE_UNITS.items() if re.fullmatch(names, name)), "")


ENERGY = (
    Field("kinetic", "J", "change of the kinetic energy from the start to the end"),
    Field("links", "J", "change of the energy stored in the links"),
    Field("contact", "J", "change of the energy stored in the contact"),
    Field("belt", "J", "work of the moving wheel on the shoe, ∫ F_x U dt"),
    Field("friction", "J", "heat of sliding"),
    Field("dashpots", "J", "loss in the dashpots of both links"),
    Field("load", "J", "work against the pressing force"),
    Field("roughness", "J", "work of the passing roughness"),
    Field("scheme", "J", "energy that the difference scheme itself removes; 0 for weights of one half"),
    Field("stored", "J", "the larger of the stored energies, all three together, at the start and at the end"),
    Field("closing_error", "J", "sum that the other items leave, 0 for an exact account"),
    ratio("relative_closing_error", "closing error over the largest item, `stored` included"),
)
VIBRATION = (
    Field("start", "s", "start of an interval of vibration"),
    Field("end", "s", "its end"),
    Field("frequency", "Hz", "frequency where vx is largest; missing where it is not known"),
    Field("amplitude", "m", "half of peak to peak of x there"),
    Field("speed", "m/s", "speed of the wheel's surface there"),
)
VIBRATIONS = Field(
    "vibrations",
    "",
    "where speed or load change: the intervals in which it vibrates",
    OBJECT,
    at="over_time.vibrations",
    in_file=False,
    rows=VIBRATION,
)
EXPONENT = within(
    "verdict.",
    Field(
        "lyapunov_exponent",
        "1/s",
        "on a rough wheel, speed and load constant: growth rate of small disturbances in the second half",
    ),
    Field(
        "lyapunov_error",
        "1/s",
        "standard error of that rate, with the drift of what has not settled, and with a trend that is sure",
    ),
)
RUN = (
    Field("status", "", "how the run has ended: done or failed", TEXT),
    Field("failure", "", "time and reason of a failure", TEXT, at="motion.work.failure_sentence"),
    *VERDICT,
    *EXPONENT,
    VIBRATIONS,
    Field(
        "spectrum_peak",
        "Hz",
        "highest peak of the spectrum; missing where it is not resolved",
        label="peak of the spectrum of vx",
    ),
    Field("scheme", "", "time-stepping scheme", TEXT, "motion.system.method."),
    Field("theta", "1", "weights of the layers", OBJECT, "motion.system.method."),
    Field("iteration", "", "how the equations of a step are solved", TEXT, "motion.system.method."),
    Field("step", "s", "time step, after it was fitted to the sample interval", at="motion.system."),
    ratio("tolerance", "largest relative error of the histories that is asked for", "certificate."),
    integer("certified", "whether the error is certain to stay below the tolerance (0, 1)", "certificate."),
    ratio(
        "estimated_error",
        "relative error of the histories, where the case gives no step; missing where nothing is known of it",
        "certificate.known_error",
    ),
    ratio(
        "error_by_steps", "part of it by the steps, where a run knows its own error", "certificate.known_by_steps"
    ),
    ratio("error_by_nodes", "part of it by the contact's nodes, likewise", "certificate.known_by_nodes"),
    ratio(
        "error_amplification",
        "by how much the motion multiplies an error of its start, at most",
        "certificate.amplification",
    ),
    Field("certified_until", "s", "up to here the error stays below the tolerance", at="certificate."),
    Field("certified_by", "", "how the error was determined", TEXT, at="certificate.method"),
    Field("evaluators", "", "steps that each evaluator took", OBJECT, "motion.work.", group="evaluators"),
    integer("nodes", "cells of the quadrature, 0 where it could not be needed", "motion.system."),
    integer("steps", "time steps", "motion.work."),
    integer("contact_evaluations", "evaluations of the contact force", "motion.work."),
    integer("most_evaluations_in_a_step", "most evaluations in one step", "motion.work.most_evaluations"),
    integer("unconverged_steps", "steps that did not converge", "motion.work."),
    integer("non_unique_steps", "steps that met a point where their solution need not be unique", "motion.work."),
    Field("energy", "", "the account of energies", OBJECT, "motion.", group="energy", rows=ENERGY),
    Field("modelled", "", "parts of the model that the run has used", OBJECT),
    Field("left_out", "", "parts of the model that the run has left out, and why this is safe", OBJECT),
    Field("adjustments", "", "how step, duration, start and profiles were made to fit", OBJECT, at="check."),
    Field("warnings", "", "what a careful user should know", OBJECT),
    Field("solve_seconds", "s", "time of the loop", at="motion.work.solve_seconds", in_file=False),
)
HISTORY = (
    Field("time", TIME.units, TIME.long_name, rising=True),
    *(Field(name, q.units, q.long_name, "i1" if name == "state" else "f8") for name, q in QUANTITIES.items()),
)
FREQUENCY = Field("frequency", "Hz", "frequency", rising=True)
WELCH = (
    integer("first_sample", "number of the first sample used, from 0", "start"),
    integer("segments", "segments averaged"),
    Field("window", "", "window of each segment", TEXT),
)
SPECTRUM = {
    field.name: Field(field.name, f"({field.units})2 Hz-1", f"power spectral density of: {field.meaning}")
    for field in HISTORY
    if field.name not in ("time", "state")
}
UNCONVERGED = (
    Field("event", "1", "steps that did not converge"),
    Field("time", "s", "time of an unconverged step", rising=True),
    Field("residual", "N", "residual of an unconverged step; missing where it is no number"),
)
EVENTS = (
    integer("event", "number of an event, from 0"),
    Field("time", "s", "time of an event"),
    Field("kind", "", "what happens: stick, slip, turn, lift-off or touch", "S8"),
    *(Field(name, QUANTITIES[name].units, QUANTITIES[name].long_name) for name in ("x", "y", "vx", "vy")),
)
EARLIER = (integer("earlier", "number of earlier events, which are not kept"),)

INTERVAL = integer("interval", "interval of vibration, from 0")
WINDOW_TIME = Field("time", "s", "middle of a window of time", rising=True)
OVER_TIME = (
    Field("speed", "m/s", "speed of the wheel's surface"),
    Field("load_force", "N", "pressing force", at="load"),
    Field("frequency", "Hz", "frequency of the highest peak of vx; missing where it does not vibrate"),
    Field("amplitude", "m", "half of peak to peak of x, without its trend"),
    ratio("stick_fraction", "part of the time in stick"),
    Field("braking_torque", "N m", "mean torque of the friction force"),
)
SHORT_TIME = Field("vx", "(m/s)2 Hz-1", "power spectral density of vx in each window", "(1,)f8", at="density")

# A sweep

POINT = (
    Field("status", "", "how the computation of the point has ended: done, failed or crashed", "S8"),
    Field("reason", "", "why the regime is as it is, or why the point failed", SENTENCE),
    Field("warning", "", "first warning of the run, empty if there is none", SENTENCE),
    integer("warning_count", "number of warnings"),
    *named(RUN, "regime", "excitation", "frequency", "amplitude", "amplitude_first"),
    *named(RUN, "amplitude_forced", "amplitude_own", "stick_fraction", "contact_loss_fraction"),
    *named(RUN, "mean_friction_force", "braking_torque", "settled", "settled_from"),
    Field("duration", "s", "time that was simulated", at="motion.system.sampled_duration"),
    *named(RUN, "steps", "contact_evaluations", "unconverged_steps", "estimated_error"),
)
CRITICAL = (
    Field("critical_status", "", "how the search for the critical value has ended", "S24", at="outcome"),
    Field("critical", "", "critical value: steady sliding loses its stability there", at="value"),
    Field("critical_lower", "", "lower end of the bracket of the critical value", at="lower"),
    Field("critical_upper", "", "upper end of the bracket of the critical value", at="upper"),
    Field("critical_error", "", "error bar of the critical value", at="error", label="±"),
    Field("critical_bias", "", "critical value of the scheme at its step less the exact one", at="bias"),
    Field("critical_eigenvalue", "", "critical value by eigenvalues", at="eigenvalue"),
    Field("critical_windows_lower", "", "where each interval of instability begins", WINDOWS, at="columns.lower"),
    Field("critical_windows_upper", "", "where each interval of instability ends", WINDOWS, at="columns.upper"),
    Field("critical_windows_lower_error", "", "error bars of these beginnings", WINDOWS, at="columns.lower_error"),
    Field("critical_windows_upper_error", "", "error bars of these ends", WINDOWS, at="columns.upper_error"),
    Field("critical_sustained", "", "least value at which vibration lasts from the case's start", at="sustained"),
    Field("sustained_status", "", "how the search for that value has ended", "S24", at="sustained_outcome"),
    Field("coexists_from", "", "least value with a stable vibration beside stable sliding"),
    Field("barrier", "m", "half of peak to peak of x of the unstable cycle at the case's own value"),
    Field("critical_sentence", "", "all of this in words", SENTENCE, at="sentence"),
)
"""Numbers have the unit of the parameter that is looked for."""
DIFFERENCE = (integer("hysteresis", "whether the motions on the way up and down differ (0, 1)"),)
STARTS = (integer("attractor", "number of the attractor that the point comes to, 0 if undecided"),)
ATTRACTOR = (
    integer("attractor", "number of the attractor"),
    *(replace(field, at="") for field in named(VERDICT, "regime", "excitation", "frequency")),
    Field("amplitude", "m", "half of peak to peak of x; 0 in steady sliding", label="amplitude of x"),
    ratio("stick_fraction", "part of the time in stick"),
    ratio("contact_loss_fraction", "part of the time without contact"),
    integer("points", "number of points that come to it"),
    ratio("share", "part of the points that come to it", "share.value"),
    ratio("share_lower", "lower end of its 95 % interval", "share.lower"),
    ratio("share_upper", "upper end", "share.upper"),
)
DIRECTION = Field("direction", "", "direction in which the motion was followed", TEXT)
WINDOW = Field("window", "1", "number of an interval of instability, from 0")
BASE_POINT = Field("point", "1", "the base case")
LISTED_POINT = integer("point", "number of the point in its table, from 0")
SWEEP = (
    Field("title", "", "title of the sweep, or of its case", TEXT, at="loaded."),
    integer("points", "number of points", "findings."),
    integer("failed_points", "number of points that failed", "findings.failed"),
    Field("failures", "", "first 100 failures, with parameters and reason", OBJECT, "findings.", in_file=False),
    integer("resumed_points", "number of points that an earlier run had finished", "resumed", in_file=False),
    Field("regimes", "", "number of points of each regime", OBJECT, at="findings.", in_file=False),
    Field(
        "attractors",
        "",
        "of a sweep over initial states: what its points come to; null for others",
        OBJECT,
        at="findings.attractors",
        in_file=False,
        rows=ATTRACTOR,
    ),
    Field("dimensions", "", "names of the dimensions", OBJECT, at="findings.", in_file=False),
    Field("axes", "", "parameters and values along each axis", OBJECT, in_file=False),
    Field("seconds", "s", "time of the command", in_file=False),
    Field("points_per_second", "1/s", "points computed, over the time of the command", in_file=False),
    ratio("overhead", "part of the workers' time that they did not spend on points", in_file=False),
    Field(
        "findings", "", "sentences on hysteresis, short runs and wide error bars", OBJECT, at="findings.sentences"
    ),
    Field("warnings", "", "what a careful user should know", OBJECT, at="notes", in_file=False),
)

# A comparison of schemes

_COMPARED = ("x", "y", "vx", "vy", "friction_force", "normal_force")
ENTRY_PLACE = Field("entry", "1", "a method at one step or tolerance")
ENTRY = (
    Field("method", "", "the method in a few words", TEXT, at="label"),
    Field("scheme", "", "time-stepping scheme", TEXT, "kind."),
    Field("theta", "", "weights of the layers; in the file one text", TEXT, "kind."),
    Field("start", "", "how the second layer is found", TEXT, "kind."),
    Field("iteration", "", "how the equations of a step are solved", TEXT, "kind."),
    Field("evaluator", "", "how the contact force is computed", TEXT, "kind."),
    integer("nodes", "quadrature nodes, 0 where none are needed", "kind."),
    Field("step", "s", "time step; missing where the scheme finds its steps itself", at="method."),
    ratio("tolerance", "tolerance of a scheme that finds its steps itself"),
    ratio("error", "largest relative error of x, y, vx and vy", "errors."),
    *(ratio(f"error_{x}", f"largest relative error of {x}", f"errors.largest.{x}") for x in _COMPARED),
    *(ratio(f"mean_error_{x}", f"relative error of {x}, mean over time", f"errors.mean.{x}") for x in _COMPARED),
    ratio("amplitude_error", "relative error of the amplitude of the settled motion", "errors.amplitude"),
    Field("phase_error", "rad", "error of the phase of the settled motion", at="errors.phase"),
    ratio("critical_bias", "critical friction of the scheme at its step less the exact one"),
    ratio("observed_order", "order by which the error falls from the step before", "order"),
    Field("step_limit", "s", "largest stable step; missing where any is stable, or unknown", at="stable_step"),
    integer("steps", "time steps", "work.", missing=0),
    integer("contact_evaluations", "evaluations of the contact force", "work.", missing=0),
    integer("iterations", "iterations of all steps together"),
    integer("unconverged_steps", "steps that did not converge", "work.", missing=0),
    Field("wall_seconds", "s", "median time of the loop alone"),
    integer("on_front", "whether no other entry is better in both error and time (0, 1)"),
    Field("failure", "", "why there is no result, empty if there is one", TEXT),
)
COMPARISON = (
    Field("title", "", "title of the case", TEXT),
    Field("duration", "s", "how much of the motion was compared", at="comparison."),
    Field("sample_interval", "s", "interval of the compared samples: the largest step", at="comparison.interval"),
    ratio("reference_error", "upper bound of the error of the reference", "comparison."),
    Field("reference_seconds", "s", "time of the loop of the reference", at="comparison."),
    integer("repeats", "number of repetitions; each time is their median", "comparison."),
    integer("left_out", "entries left out because the time was used up", "comparison."),
    ratio("target_error", "the error to be met", "target"),
    Field(
        "recommended",
        "",
        "cheapest entry that meets the target; in the file the number of the entry",
        OBJECT,
        rows=ENTRY,
    ),
    ratio("margin", "`target_error` over the error of the recommended entry"),
    Field("entries", "", "all entries", OBJECT, at="comparison.", rows=ENTRY, in_file=False),
)
