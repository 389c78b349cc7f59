"""What is said of stability, declared as in `fields`: steady sliding, branches, scatter, and advice."""

from brakecli.results.field import Field, integer, named, ratio, within
from brakecli.results.fields import OBJECT, PAIR, POINT, SENTENCE, TEXT, VERDICT

PUSHED = "pushes by which vibrations were sought that no branch from flutter reaches"

# Linear stability

STABILITY = (
    Field("belt_speed", "m/s", "speed U of the wheel's surface"),
    ratio("friction_coefficient", "friction coefficient φ of the case", "friction"),
    ratio("critical_friction", "least friction coefficient at which stability ends", "critical.friction"),
    ratio(
        "critical_error",
        "by which the mean over the waves leaves `critical_friction` open; null where not known",
    ),
    Field("instability", "", "how stability is lost: flutter or divergence", TEXT, "critical."),
    Field("critical_frequency", "Hz", "frequency of the mode that becomes unstable", at="critical.frequency"),
    Field("stable", "", "whether steady sliding is stable at φ", "?"),
    Field("eigenvalues", "1/s", "eigenvalues at φ: real and imaginary parts", OBJECT),
    Field("modes", "", "modes at φ, the one that grows fastest first", OBJECT),
    Field("crossings", "", "all changes of stability along φ", OBJECT),
    ratio("undamped_flutter_friction", "φ of flutter without dashpots", "undamped_flutter"),
    ratio("undamped_divergence_friction", "φ of divergence without dashpots", "undamped_divergence"),
    Field("contact_stiffness", "N/m", "mean stiffness of the contact in steady sliding"),
    Field("contact_stiffness_error", "N/m", "by which the mean over the waves leaves that open"),
    Field("equilibrium", "", "steady sliding; null where there is none", OBJECT),
    Field("no_equilibrium", "", "why there is no steady sliding", TEXT),
    Field("discrete", "", "stability of the difference scheme at its step", OBJECT),
)
THRESHOLDS = (
    ratio(
        "coexists_from",
        "least friction coefficient with a stable vibration beside stable sliding; null where none is known",
    ),
    Field("barrier", "m", "half of peak to peak of x of the unstable cycle at φ; null without one"),
    integer("pushes", PUSHED, "search.pushes"),
    Field("sentence", "", "both thresholds in words; null where stability is not lost", TEXT),
)
"""Fields of limit cycles along friction, beside linear stability."""
VARIED = (
    *named(STABILITY, "critical_friction", "instability"),
    ratio(
        "discrete_critical_friction",
        "critical friction of the difference scheme at its step",
        "discrete.critical_friction",
        label="critical friction of the scheme",
    ),
)
MODES = (
    Field("frequencies", "Hz", "frequency of each mode, 0 of a pair of real eigenvalues", PAIR),
    Field("growth_rates", "1/s", "growth rate of each mode, negative where it decays", PAIR),
    Field("damping_ratios", "1", "damping ratio of each mode, negative where it grows", PAIR),
)
"""Along a key of the case, beside its `value`: what there is, and both modes, each followed by continuity."""
MODE = integer("mode", "number of the mode, by frequency at the first value")
LOCK_IN = (
    Field("parameters", "", "the keys that are varied", OBJECT),
    Field("critical_values", "of the key", "where along the key sliding stops being stable, or starts", OBJECT),
)

# Branches along a key

MOTION = (
    Field("value", "of the key", "value of the key"),
    Field("amplitude", "m", "half of peak to peak of x; 0 in steady sliding"),
    Field("amplitude_y", "m", "half of peak to peak of y", at="extent."),
    Field("amplitude_vx", "m/s", "half of peak to peak of vx", at="extent."),
    Field("mean_x", "m", "mean of x over a period; in steady sliding its place", at="extent."),
    Field("mean_y", "m", "mean of y", at="extent."),
    Field(
        "frequency",
        "Hz",
        "frequency of the motion; of steady sliding that of the mode that is first to grow, or nearest to it",
    ),
    ratio("stick_fraction", "part of the time in stick"),
    ratio("contact_loss_fraction", "part of the time without contact"),
)
"""Of a motion on a branch, and at its special points."""
BRANCH_POINT = (
    *within("motion.", *MOTION),
    Field("stable", "1", "whether disturbances die out", "?"),
    Field(
        "multipliers",
        "1",
        "Floquet multipliers; of steady sliding for a period of its mode, or for 1 s",
        "(4,2)f8",
    ),
)
SPECIAL = (
    Field("kind", "", "what changes there", "S16"),
    *within("motion.", *MOTION),
    Field("error", "of the key", "error of the value"),
    Field("reason", "", "of an end: why it ends; of grazing: what begins or ends, along the branch", TEXT),
)
ONE_BRANCH = (
    Field("kind", "", "steady sliding, limit cycle or forced motion", TEXT),
    Field("note", "", "where it was begun, if not where steady sliding flutters", TEXT),
    Field("unstable_lower", "of the key", "lower ends of the intervals along it in which it is unstable", OBJECT),
    Field("unstable_upper", "of the key", "their upper ends", OBJECT),
    Field("special", "", "special points along it", OBJECT, in_file=False, rows=SPECIAL),
    Field("points", "", "its motions in order", OBJECT, in_file=False, rows=BRANCH_POINT),
)
BRANCH = (
    Field("parameter", "", "the key, or the keys that take the same value", TEXT),
    Field("lower", "of the key", "lower end of the range"),
    Field("upper", "of the key", "upper end of the range"),
    Field(
        "critical", "of the key", "least value at which the motion that continues steady sliding loses stability"
    ),
    Field("critical_error", "of the key", "error of that value"),
    Field("critical_windows_lower", "of the key", "lower ends of the intervals in which it is unstable", OBJECT),
    Field("critical_windows_upper", "of the key", "their upper ends", OBJECT),
    Field("coexists_from", "of the key", "least value with a stable vibration beside stable sliding"),
    Field("barrier", "m", "half of peak to peak of x of the unstable cycle at the value of the case itself"),
    integer("pushes", PUSHED, "explored.search.pushes"),
    Field("sentence", "", "the answer in words", TEXT),
    Field("branches", "", "all branches", OBJECT, in_file=False, rows=ONE_BRANCH),
)

# Scatter

SCATTER = (
    integer("samples", "brakes that were drawn"),
    integer("failed", "samples without an answer, such as shoes that nothing presses onto the wheel"),
    Field("first_failure", "", "why the first of them has none", TEXT),
    Field(
        "probability",
        "",
        "of each regime (or of stable and unstable sliding), of squeal, and that the critical"
        " friction lies below the own",
        OBJECT,
        in_file=False,
    ),
    Field("probability_lower", "", "lower ends of their 95 % intervals", OBJECT, in_file=False),
    Field("probability_upper", "", "upper ends", OBJECT, in_file=False),
    Field(
        "quantiles",
        "",
        "of critical friction, growth rate, frequency and amplitude: 5, 25, 50, 75 and 95 %",
        OBJECT,
        in_file=False,
    ),
    Field("indices_of", "", "what the Sobol indices are about", TEXT, "indices.of"),
    Field(
        "first_order",
        "",
        "part of its variance that each parameter makes alone",
        OBJECT,
        "indices.",
        in_file=False,
    ),
    Field(
        "total",
        "",
        "part of its variance that is gone where the parameter does not scatter",
        OBJECT,
        "indices.",
        in_file=False,
    ),
    Field(
        "total_error", "", "half of the 95 % interval of the total index", OBJECT, "indices.error", in_file=False
    ),
    Field("notes", "", "what is to be known of the numbers", OBJECT),
    Field("sentence", "", "the answer in words", TEXT),
)
SAMPLE = integer("sample", "number of the sample, from 0")
SET = integer("set", "number of its sequence: sets know nothing of each other")
PROBABLE = {"critical_below": "critical friction below the brake's own"}
"""Words for what a sample of a scatter may be, where its name does not say it."""
SCATTERED = (
    *named(POINT, "status", "regime", "excitation"),
    integer("squeal", "whether it squeals (0, 1)"),
    Field("frequency", "Hz", "of the vibration, or of the mode that counts"),
    Field("amplitude", "m", "half of peak to peak of x"),
    Field("growth_rate", "1/s", "of the mode that counts: one that squeals, or the one that grows fastest"),
    ratio(
        "critical_friction",
        "least friction coefficient at which stability ends; 0 where there is none, missing where it never ends",
    ),
    Field("reason", "", "why the regime is as it is, or why there is no answer", SENTENCE),
)
OUTCOME = Field("outcome", "", "what a sample comes to", TEXT)
PROBABILITY = (
    ratio("probability", "part of the samples"),
    ratio("probability_lower", "lower end of its 95 % interval"),
    ratio("probability_upper", "upper end"),
)
SCATTERING = Field("parameter", "", "first key path of a parameter", TEXT)
INDEX = (
    ratio("first_order", "part of the variance that the parameter makes alone"),
    ratio("total", "part of the variance that is gone where it does not scatter"),
    ratio("total_error", "half of the 95 % interval of the latter"),
)

# Advice, in JSON alone

SENSITIVITY = (
    Field("parameter", "", "key of the case", TEXT),
    Field("value", "of the key", "its value, or its values, which are scaled alike"),
    ratio("elasticity", "per cent of critical friction for one per cent of the value; null where it is 0"),
    Field("derivative", "1 per unit", "critical friction by the value; null for lists, and where it jumps"),
    ratio("error", "relative error of both"),
    Field("growth_derivative", "1/s per unit", "growth rate at φ by the value; for lists by their factor"),
)
_LEFT = (
    ratio(
        "squeal_probability",
        "part of such brakes that squeal where stiffnesses and friction scatter by 10 %, or keys as in a study",
        label="squeal under a scatter",
    ),
    ratio("squeal_lower", "lower end of its 95 % interval"),
    ratio("squeal_upper", "upper end"),
    ratio("unstable_elsewhere", "part that is unstable, but not in the band of the study; null without a study"),
    Field("squeal_frequency", "Hz", "median frequency of those that are unstable; null where none vibrates"),
)
CHANGE = (
    Field("parameter", "", "key of the case", TEXT),
    Field("from", "of the key", "its value", at="start"),
    Field("to", "of the key", "the nearest value with the margin; null where there is none"),
    Field("until", "of the key", "the end of the interval of safe values; null on rough pads"),
    ratio("critical_friction", "critical friction there; null where no friction makes it unstable"),
    Field("check", "", "regime of a run with this advice followed; null where none was made", TEXT),
    *within("squeal.", *_LEFT),
    Field("lowest", "of the key", "least value that may be advised"),
    Field("highest", "of the key", "largest value that may be advised"),
)
CHECK_RUN = (
    Field("parameter", "", "key that was changed", TEXT),
    Field("value", "of the key", "its new value"),
    *named(VERDICT, "regime", "excitation", "frequency", "reasons"),
    Field("duration", "s", "time that was simulated"),
    Field("seconds", "s", "what the run has cost"),
)
ADVICE = (
    ratio("critical_friction", "least friction coefficient at which stability ends; 0 where there is none"),
    Field("instability", "", "how it is lost: flutter or divergence", TEXT, "stability.critical."),
    *within("thresholds.", *named(THRESHOLDS, "coexists_from", "barrier")),
    ratio("friction_coefficient", "friction coefficient φ of the case", "stability.friction"),
    ratio("margin", "`critical_friction` over `friction_coefficient`, less 1"),
    ratio("wanted_margin", "the margin that is asked for"),
    Field("stable", "", "whether steady sliding is stable at φ; missing where nothing slides", "?"),
    *within("squeal.", *_LEFT),
    Field("sensitivities", "", "all numbers of the case, those that move it most first", OBJECT, rows=SENSITIVITY),
    Field(
        "advice",
        "",
        "all keys that may be advised: those that a run confirms, the smallest change first",
        OBJECT,
        rows=CHANGE,
    ),
    Field("check", "", "a run of the case with the first advice followed", OBJECT, rows=CHECK_RUN),
    Field("notes", "", "what the answer rests on", OBJECT),
    Field("conclusion", "", "the answer in a sentence", TEXT),
)
