"""Power spectral densities and cycles of signals that are known."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import welch

from brakecli.analysis import spectrum as spectra
from brakecli.analysis.spectrum import SPECTRAL, peak, spectrum
from brakecli.solver.history import History
from tests.analysis.histories import INTERVAL, history_of


def history(vx: NDArray[np.float64]) -> History:
    return history_of(len(vx), vx=vx)


def sine(frequency: float, samples: int = 20000, amplitude: float = 0.03) -> NDArray[np.float64]:
    wave: NDArray[np.float64] = amplitude * np.sin(2.0 * np.pi * frequency * INTERVAL * np.arange(samples) + 0.3)
    return wave


def test_density_integrates_to_the_variance() -> None:
    lines = spectrum(history(5.0 + sine(173.3)), 0)
    spacing = lines.frequency[1]
    # Parseval's identity; the ends of windows that do not close on a period weigh within a percent.
    assert lines.density["vx"].sum() * spacing == pytest.approx(0.5 * 0.03**2, rel=0.01)


def test_white_noise_has_a_flat_density() -> None:
    noise = np.random.default_rng(1).normal(0.0, 2.0, 1 << 16)
    density = spectrum(history(noise), 0).density["vx"]
    # One-sided: variance over half the sampling rate; 9 segments leave a scatter of 1/3 on each of 7000 lines.
    assert density[5:-5].mean() == pytest.approx(4.0 / (0.5 / INTERVAL), rel=0.02)


@pytest.mark.parametrize("frequency", [40.0, 173.3, 1234.56])
def test_peak_lies_within_a_tenth_of_a_bin(frequency: float) -> None:
    lines = spectrum(history(sine(frequency)), 0)
    found = peak(lines.frequency, lines.density["vx"])
    assert found == pytest.approx(frequency, abs=0.1 * lines.frequency[1])


def test_a_long_history_takes_segments_of_bounded_length(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spectra, "LONGEST_SEGMENT", 256)
    read: list[int] = []

    whole = history(sine(500.0))

    def watched(name: str, start: int, stop: int) -> NDArray[np.float64]:
        read.append(stop - start)
        return whole.read(name, start, stop)

    lines = spectrum(replace(whole, read=watched), 1000)
    assert lines.segments == (19000 - 256) // 128 + 1
    assert max(read) <= 256 + 15 * 128
    assert peak(lines.frequency, lines.density["vx"]) == pytest.approx(500.0, abs=4.0)


@pytest.mark.parametrize(
    ("value", "samples"), [(0.0, 1), (-0.0, 2), (1.0, 3), (5e-324, 17), (1e-310, 2), (1e15, 1000)]
)
def test_constant_signals_have_no_density_and_no_nan(value: float, samples: int) -> None:
    lines = spectrum(history(np.full(samples, value)), 0)
    assert len(lines.frequency) == len(lines.density["vx"])
    for name in SPECTRAL:
        assert np.all(np.isfinite(lines.density[name]))
        # Removing the mean of a constant leaves its rounding.
        assert lines.density[name].max() <= 1e-28 * max(value * value, 1e-300)
    assert peak(lines.frequency, lines.density["y"]) is None


def test_the_smallest_signals_keep_their_shape() -> None:
    scaled = spectrum(history(sine(173.3, amplitude=1e-140)), 0)
    assert peak(scaled.frequency, scaled.density["vx"]) == pytest.approx(173.3, abs=0.5)


@pytest.mark.parametrize("samples", [2, 17, 100, 1001, 20000])
def test_density_is_that_of_scipy(samples: int) -> None:
    noise = np.random.default_rng(3).normal(1.0, 2.0, samples)
    lines = spectrum(history(noise), 0)
    size = round(1.0 / (lines.frequency[1] * INTERVAL))
    _, density = welch(noise, 1.0 / INTERVAL, nperseg=size, noverlap=size // 2)
    # Both sum the same numbers, but for the scale that is taken out here and put back.
    np.testing.assert_allclose(lines.density["vx"], density, rtol=1e-12, atol=1e-15 * density.max())


@pytest.mark.parametrize("samples", [1500, 4000, 20000])
def test_a_peak_is_known_to_the_distance_of_two_frequencies(samples: int) -> None:
    lines = spectrum(history(sine(174.0, samples)), 0)
    found = peak(lines.frequency, lines.density["vx"], samples * INTERVAL)
    assert found == pytest.approx(174.0, abs=float(lines.frequency[1]))
