"""Every number and text of a result, declared once: its name, unit, meaning, type, and where a report holds it.

JSON, the attributes and variables of result files, the records of a sweep, labels in the terminal and the tables
of the documentation (`make tables`) are all made from these rows.
"""

from brakecli.files.field import Field, json_only, named, within
from brakecli.solver.quantities import HISTORY as QUANTITIES
from brakecli.solver.quantities import TIME

TEXT, OBJECT, SENTENCE = "S", "O", "S240"

# All result files

ORIGIN = (
    Field("format", "", "always brakecli", TEXT),
    Field("format_version", "1", "version of the form of the file", "i8"),
    Field("kind", "", "what the file holds: run, sweep or comparison", TEXT),
    Field("complete", "1", "1 once the whole result is in the file", "i8"),
    Field("title", "", "title of the case or of the sweep", TEXT),
    Field("case_toml", "", "the case as it was read, to the letter", TEXT),
    Field("resolved_toml", "", "the case that was run: overrides applied, every default filled in", TEXT),
    *(
        Field(f"{library}_version", "", f"version of {library}", TEXT)
        for library in ("brakecli", "numpy", "scipy", "numba", "h5py", "hdf5")
    ),
)

# A run

VERDICT = (
    *within(
        "verdict",
        Field("regime", "", "regime of the motion", "S16"),
        Field("excitation", "", "where the energy of a sustained motion comes from", "S16"),
        Field("frequency", "Hz", "fundamental frequency of vx of a sustained motion"),
        Field("amplitude", "m", "half of peak to peak of x, settled part", label="amplitude of x"),
        Field("settled", "1", "whether a settled part was found (0, 1); otherwise it is the second half", "i8"),
    ),
    Field("settled_from", "s", "start of the settled part"),
    *within("verdict", Field("mean_friction_force", "N", "mean friction force on the shoe, settled part")),
    Field("braking_torque", "N m", "mean torque of the friction force, settled part"),
    *within(
        "verdict",
        Field("stick_fraction", "1", "part of the time in stick, settled part", label="stick"),
        Field("contact_loss_fraction", "1", "part of the time off the wheel, settled part", label="lost contact"),
        Field("reasons", "", "why the regime is as it is", OBJECT),
        Field("evidence", "", "numbers by which the rules decided", OBJECT, group="regime/evidence"),
        Field("thresholds", "", "limits of the rules", OBJECT, group="regime/thresholds"),
    ),
)
ENERGY = (
    Field("kinetic", "J", "change of the kinetic energy from the start to the end"),
    Field("links", "J", "change of the energy stored in the links"),
    Field("contact", "J", "change of the energy stored in the contact"),
    Field("belt", "J", "work of the moving wheel on the shoe, ∫ F_x U dt"),
    Field("friction", "J", "heat of sliding"),
    Field("dashpots", "J", "loss in the dashpots of both links"),
    Field("load", "J", "work against the pressing force"),
    Field("roughness", "J", "work of the passing roughness"),
    Field("scheme", "J", "what the difference scheme itself takes out; 0 for weights of one half"),
    Field("stored", "J", "the larger of the stored energies, all three together, at the start and at the end"),
    Field("closing_error", "J", "what the other items leave open"),
    Field("relative_closing_error", "1", "closing error over the largest item, `stored` included"),
)
RUN = (
    Field("status", "", "how the run has ended: done or failed", TEXT),
    *within("motion.work", Field("failure", "", "time and reason of a failure", TEXT, source="failure_sentence")),
    *VERDICT,
    Field("spectrum_peak", "Hz", "highest peak of the spectrum above 0 Hz", label="peak of the spectrum of vx"),
    *within(
        "system.method",
        Field("scheme", "", "time-stepping scheme", TEXT),
        Field("theta", "1", "weights of the layers", OBJECT),
    ),
    Field("iteration", "", "how the equations of a step are solved", TEXT),
    Field("step", "s", "time step, after it was fitted to the sample interval"),
    *within(
        "certificate",
        Field("tolerance", "1", "largest relative error of the histories that is asked for"),
        Field("certified", "1", "whether the error is sure to stay below the tolerance (0, 1)", "i8"),
        Field("estimated_error", "1", "relative error of the histories, where the case gives no step"),
        Field("certified_until", "s", "up to here the error stays below the tolerance"),
        Field("certified_by", "", "how the error is known", TEXT, source="method"),
    ),
    *within("motion.work", Field("evaluators", "", "steps that each evaluator took", OBJECT, group="evaluators")),
    Field("nodes", "1", "cells of the midpoint sum, 0 where it could not be needed", "i8", source="system.nodes"),
    *within(
        "motion.work",
        Field("steps", "1", "time steps", "i8"),
        Field("contact_evaluations", "1", "evaluations of the contact force", "i8"),
        Field("most_evaluations_in_a_step", "1", "most evaluations in one step", "i8", source="most_evaluations"),
        Field("unconverged_steps", "1", "steps that did not converge", "i8"),
        Field("non_unique_steps", "1", "steps that met a point where their solution need not be unique", "i8"),
    ),
    *within("motion", Field("energy", "", "the account of energies", OBJECT, group="energy", rows=ENERGY)),
    Field("modelled", "", "what of the model the run has used", OBJECT),
    Field("left_out", "", "what of the model the run has left out, and why that was safe", OBJECT),
    Field("adjustments", "", "how step and duration were made to fit", OBJECT, source="check.adjustments"),
    Field("warnings", "", "what a careful user should know", OBJECT),
    Field("solve_seconds", "s", "time of the loop", source="motion.work.solve_seconds", in_file=False),
)
HISTORY = (
    Field("time", TIME.units, TIME.long_name),
    *(Field(name, q.units, q.long_name, "i1" if name == "state" else "f8") for name, q in QUANTITIES.items()),
)
FREQUENCY = Field("frequency", "Hz", "frequency")
WELCH = (
    Field("first_sample", "1", "number of the first sample used, from 0", "i8", source="start"),
    Field("segments", "1", "segments averaged", "i8"),
    Field("window", "", "window of each segment", TEXT),
)
SPECTRUM = {
    field.name: Field(field.name, f"({field.units})2 Hz-1", f"power spectral density of: {field.meaning}")
    for field in HISTORY
    if field.name not in ("time", "state")
}
UNCONVERGED = (
    Field("event", "1", "steps that did not converge"),
    Field("time", "s", "time of an unconverged step"),
    Field("residual", "N", "residual of an unconverged step"),
)
EVIDENCE = (
    Field("envelope_final", "m/s", "rule 6: last value of the envelope of vx"),
    Field("envelope_largest", "m/s", "rule 6: largest value of the envelope of vx"),
    Field("envelope_slope", "1/s", "slope of the logarithm of the envelope's second half"),
    Field("envelope_slope_error", "1/s", "standard error of that slope"),
    Field("forced_share", "1", "rule 7, on a rough wheel: part of the energy on the lines of the roughness"),
    Field("cycles", "1", "rule 9: cycles in the settled part"),
    Field("samples_per_cycle", "1", "rule 10"),
    Field("rises_per_cycle", "1", "rule 9"),
    Field("stick_cycles", "1", "part of the cycles in which a stick begins"),
    Field("stick_episodes_per_cycle", "1", "sticks that begin in a cycle, in the mean"),
    Field("fundamental_share", "1", "part of the energy of vx on `frequency`"),
    Field("harmonic_share", "1", "part of the energy of vx on `frequency` and its multiples"),
    Field("amplitude_y", "m", "half of peak to peak of y, settled part"),
    Field("amplitude_vx", "m/s", "half of peak to peak of vx, settled part"),
    Field("amplitude_vy", "m/s", "half of peak to peak of vy, settled part"),
    Field("largest_vx_over_belt_speed", "1", "1 where stick limits the growth"),
    Field("harmonics", "1", "amplitudes of vx at 2 to 5 times `frequency`, over that at `frequency`", OBJECT),
    Field("line_frequencies", "Hz", "strongest lines of vx: at most 8, each above 0.001 of its energy", OBJECT),
    Field("line_shares", "1", "their parts of the energy", OBJECT),
    Field("line_forced", "1", "1 where a line sits on a forced one, 0 where the shoe adds it by itself", OBJECT),
    Field("power_belt", "W", "constant speed and load only: mean power that the wheel gives"),
    Field("power_friction", "W", "mean power of the heat of sliding"),
    Field("power_dashpots", "W", "mean power lost in the dashpots"),
    Field("power_load", "W", "mean power against the pressing force"),
    Field("power_rest", "W", "what is left: work of the roughness, and change of what is stored"),
)

# A sweep

POINT = (
    Field("status", "", "how the computation of the point has ended: done, failed or crashed", "S8"),
    Field("reason", "", "why the regime is as it is, or why the point failed", SENTENCE),
    Field("warning", "", "first warning of the run, empty if there is none", SENTENCE),
    Field("warning_count", "1", "number of warnings", "i8"),
    *named(RUN, "regime", "excitation", "frequency", "amplitude", "stick_fraction", "contact_loss_fraction"),
    *named(RUN, "mean_friction_force", "braking_torque", "settled", "settled_from"),
    *named(RUN, "steps", "contact_evaluations", "unconverged_steps", "estimated_error"),
)
CRITICAL = (
    Field("critical_status", "", "how the search for the critical value has ended", "S24", source="outcome"),
    Field("critical", "", "critical value: steady sliding loses its stability there", source="value"),
    Field("critical_lower", "", "lower end of the bracket of the critical value", source="lower"),
    Field("critical_upper", "", "upper end of the bracket of the critical value", source="upper"),
    Field("critical_error", "", "error bar of the critical value, bias included", source="error", label="±"),
    Field("critical_bias", "", "critical value of the scheme at its step less the exact one", source="bias"),
    Field("critical_eigenvalue", "", "critical value by eigenvalues", source="eigenvalue"),
    Field(
        "critical_sustained", "", "least value at which vibration lasts from the case's start", source="sustained"
    ),
    Field("sustained_status", "", "how the search for that value has ended", "S24", source="sustained_outcome"),
)
"""Numbers have the unit of the parameter that is looked for."""
DIFFERENCE = (Field("hysteresis", "1", "whether the motions on the way up and down differ (0, 1)", "i8"),)
DIRECTION = Field("direction", "", "direction in which the motion was followed", TEXT)
BASE_POINT = Field("point", "1", "the base case")
SWEEP = (
    Field("title", "", "title of the sweep, or of its case", TEXT, source="loaded.title"),
    Field("points", "1", "number of points", "i8", source="findings.points"),
    Field("failed_points", "1", "number of points that failed", "i8", source="findings.failed"),
    *json_only(
        Field("failures", "", "the first 100 failures, with parameters and reason", OBJECT, "findings.failures"),
        Field("resumed_points", "1", "number of points that an earlier run had finished", "i8", source="resumed"),
        Field("regimes", "", "number of points of each regime", OBJECT, source="findings.regimes"),
        Field("dimensions", "", "names of the dimensions", OBJECT, source="findings.dimensions"),
        Field("axes", "", "parameters and values along each axis", OBJECT),
        Field("seconds", "s", "time of the command"),
    ),
    Field("findings", "", "sentences on hysteresis", OBJECT, source="findings.sentences"),
    *json_only(Field("warnings", "", "what a careful user should know", OBJECT, source="notes")),
)

# A comparison of schemes

_COMPARED = ("x", "y", "vx", "vy", "friction_force", "normal_force")
ENTRY_PLACE = Field("entry", "1", "a method at one step or tolerance")
ENTRY = (
    Field("method", "", "the method in a few words", TEXT, source="label"),
    *within(
        "kind",
        Field("scheme", "", "time-stepping scheme", TEXT),
        Field("theta", "", "weights of the layers; in the file one text", TEXT),
        Field("start", "", "how the second layer is found", TEXT),
        Field("iteration", "", "how the equations of a step are solved", TEXT),
        Field("evaluator", "", "how the contact force is computed", TEXT),
        Field("nodes", "1", "quadrature nodes, 0 where none are needed", "i8"),
    ),
    Field("step", "s", "time step; missing where the scheme finds its steps itself", source="method.step"),
    Field("tolerance", "1", "tolerance of a scheme that finds its steps itself"),
    *within(
        "errors",
        Field("error", "1", "largest relative error of x, y, vx and vy"),
        *(Field(f"error_{x}", "1", f"largest relative error of {x}", source=f"largest.{x}") for x in _COMPARED),
        *(
            Field(f"mean_error_{x}", "1", f"relative error of {x}, mean over time", source=f"mean.{x}")
            for x in _COMPARED
        ),
        Field("amplitude_error", "1", "relative error of the amplitude of the settled motion", source="amplitude"),
        Field("phase_error", "rad", "error of the phase of the settled motion", source="phase"),
    ),
    Field("critical_bias", "1", "critical friction of the scheme at its step less the exact one"),
    Field("observed_order", "1", "order by which the error falls from the step before", source="order"),
    Field("step_limit", "s", "largest stable step; missing where any is stable, or unknown", source="stable_step"),
    *within(
        "work",
        Field("steps", "1", "time steps", "i8", missing=0),
        Field("contact_evaluations", "1", "evaluations of the contact force", "i8", missing=0),
    ),
    Field("iterations", "1", "iterations of all steps together", "i8"),
    Field("unconverged_steps", "1", "steps that did not converge", "i8", "work.unconverged_steps", missing=0),
    Field("wall_seconds", "s", "median time of the loop alone"),
    Field("on_front", "1", "whether no other entry is better in both error and time (0, 1)", "i8"),
    Field("failure", "", "why there is no result, empty if there is one", TEXT),
)
COMPARISON = (
    Field("title", "", "title of the case", TEXT),
    *within(
        "comparison",
        Field("duration", "s", "how much of the motion was compared"),
        Field("sample_interval", "s", "where it was compared: the largest step", source="interval"),
        Field("reference_error", "1", "how good the reference is, at least"),
        Field("reference_seconds", "s", "time of the loop of the reference"),
        Field("repeats", "1", "turns that times are medians of", "i8"),
        Field("left_out", "1", "entries that there was no time for", "i8"),
    ),
    Field("target_error", "1", "the error to be met", source="target"),
    Field("recommended", "", "cheapest entry that meets the target; in the file its place", OBJECT, rows=ENTRY),
    Field("margin", "1", "`target_error` over the error of the recommended entry"),
    *json_only(Field("entries", "", "all entries", OBJECT, source="comparison.entries", rows=ENTRY)),
)

# Linear stability, in JSON alone

EQUILIBRIUM = (
    Field("x", "m", "tangential displacement of the shoe"),
    Field("y", "m", "normal displacement of the shoe"),
    Field("normal_force", "N", "normal contact force on the shoe"),
    Field("stiffness", "N/m", "mean stiffness of the contact"),
    Field("contact_fraction", "1", "part of the pad that touches"),
)
MODE = (
    Field("growth", "1/s", "growth rate, negative where the mode decays"),
    Field("frequency", "Hz", "frequency"),
    Field("damping_ratio", "1", "damping ratio, negative where the mode grows"),
    Field("shape", "1", "size of y/x; null where x does not move"),
    Field("shape_phase", "deg", "phase of y/x"),
)
CROSSING = (
    Field("friction", "1", "friction coefficient at which stability changes"),
    Field("instability", "", "flutter or divergence", TEXT),
    Field("frequency", "Hz", "frequency of the mode"),
    Field("lost", "", "whether stability is lost or regained there", "?"),
)
DISCRETE = (
    Field("spectral_radius", "1", "factor of the fastest disturbance in a step"),
    Field("growth", "1/s", "its logarithm over the step"),
    Field("step_limit", "s", "largest stable step of the frictionless shoe; null where any step is stable"),
    Field("critical_friction", "1", "friction coefficient at which the factor passes one"),
    Field("bias", "1", "its distance from the exact one"),
)
_CRITICAL_FRICTION = within(
    "critical",
    Field("critical_friction", "1", "least friction coefficient at which stability is lost", source="friction"),
    Field("instability", "", "how it is lost: flutter or divergence", TEXT),
    Field("critical_frequency", "Hz", "frequency of the mode that is lost", source="frequency"),
)
STABILITY = (
    Field("belt_speed", "m/s", "speed U of the wheel's surface"),
    Field("friction_coefficient", "1", "friction coefficient φ of the case", source="friction"),
    *_CRITICAL_FRICTION,
    Field("stable", "", "whether steady sliding is stable at φ", "?"),
    Field("eigenvalues", "1/s", "eigenvalues at φ: real and imaginary parts", OBJECT),
    Field("modes", "", "modes at φ, the one that grows fastest first", OBJECT, rows=MODE),
    Field("crossings", "", "all changes of stability along φ", OBJECT, rows=CROSSING),
    Field("undamped_flutter_friction", "1", "φ of flutter without dashpots", source="undamped_flutter"),
    Field("undamped_divergence_friction", "1", "φ of divergence without dashpots", source="undamped_divergence"),
    Field("contact_stiffness", "N/m", "mean stiffness of the contact in steady sliding"),
    Field("equilibrium", "", "steady sliding; null where there is none", OBJECT, rows=EQUILIBRIUM),
    Field("no_equilibrium", "", "why there is no steady sliding", TEXT),
    Field("discrete", "", "what the scheme makes of the same motion at its step", OBJECT, rows=DISCRETE),
)
VARIED = (
    *named(_CRITICAL_FRICTION, "critical_friction", "instability"),
    Field(
        "discrete_critical_friction",
        "1",
        "the same in the scheme",
        source="discrete.critical_friction",
        label="as the scheme has it",
    ),
)
"""Along a key of the case, beside its `value`."""
