"""Draw the brakes of a study, and those of its Sobol indices."""

import numpy as np
from scipy import stats

from brakecli.errors import RefusedError, found_text
from brakecli.solver.arrays import Floats
from brakecli.studies.scattering.study import SCRAMBLINGS, Study

_MOST_FOR_INDICES = 1 << 12  # samples of each of the two sets that indices compare
MOST_SAMPLES = 1_000_000
"""Samples of a study, a choice: so many know a probability to a thousandth."""
MOST_VALUES = 20_000_000
"""Values of all samples, those of the indices included; a choice."""


def sample_values(study: Study) -> Floats:
    """Values of the parameters: sets of samples, samples, parameters. Each set is a sequence of its own.

    Samples become as many as the sequences need: a power of two in each for Sobol's. Raises RefusedError where
    they are too many.
    """
    _refuse_many(study)
    count = len(study.parameter)
    many = -(-study.samples // SCRAMBLINGS)
    rngs = [np.random.default_rng([study.seed, number]) for number in range(SCRAMBLINGS)]
    if study.sampling == "random":
        parts = rngs[0].random((1, study.samples, count))
    elif study.sampling == "sobol":
        power = max(many - 1, 1).bit_length()
        parts = np.array([stats.qmc.Sobol(count, seed=rng).random_base2(power) for rng in rngs])
    else:
        parts = np.array([stats.qmc.LatinHypercube(count, seed=rng).random(many) for rng in rngs])
    return _values(study, parts)


def for_indices(study: Study) -> Floats:
    """Two sets of samples, A and B, then for each parameter A with its values from B: sets, samples, parameters.

    I. M. Sobol', Mathematics and Computers in Simulation 55 (2001) 271; A. Saltelli et al., Computer Physics
    Communications 181 (2010) 259.
    """
    count = len(study.parameter)
    power = min(study.samples, _MOST_FOR_INDICES).bit_length() - 1
    rng = np.random.default_rng([study.seed, SCRAMBLINGS])
    both = stats.qmc.Sobol(2 * count, seed=rng).random_base2(power)
    a = both[:, :count]
    b = both[:, count:]
    mixed = np.repeat(a[None], count, axis=0)
    for number in range(count):
        mixed[number, :, number] = b[:, number]
    return _values(study, np.concatenate([a[None], b[None], mixed]))


def has_indices(study: Study) -> bool:
    """Whether Sobol indices are computed; with correlations the share of one parameter is not its own."""
    return study.indices_of != "none" and study.correlation is None


def _refuse_many(study: Study) -> None:
    """Raise RefusedError where samples and their values would take too much memory."""
    excess = f"samples: are too many{found_text(study.samples)}"
    keys = sum(len(parameter.paths) for parameter in study.parameter)
    if study.samples > MOST_SAMPLES:
        raise RefusedError(f"{excess}; {MOST_SAMPLES} are the most, take fewer")
    of_indices = min(study.samples, _MOST_FOR_INDICES) * (len(study.parameter) + 2) if has_indices(study) else 0
    if (study.samples + of_indices) * keys > MOST_VALUES:
        remedy = 'take fewer samples or keys, or set indices_of = "none"'
        raise RefusedError(f"{excess} for {keys} keys; {remedy}")


def _values(study: Study, parts: Floats) -> Floats:
    """Values of the parameters by probabilities; correlated by their normal scores (a Gaussian copula)."""
    least = 2.0**-53  # a normal value has no end
    parts = np.clip(parts, least, 1.0 - least)
    if study.correlation is not None:
        parts = stats.norm.cdf(stats.norm.ppf(parts) @ np.linalg.cholesky(np.array(study.correlation)).T)
        parts = np.clip(parts, least, 1.0 - least)
    return np.stack([law.values(parts[..., n]) for n, law in enumerate(study.parameter)], axis=-1)
