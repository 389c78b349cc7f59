"""What `make bench` has reached may not be lost, neither at once nor by and by."""

import math
import tomllib
from importlib import import_module
from typing import Any

# benchmarks are not type-checked
reached: Any = import_module("benchmarks.performance.reached")
matching: Any = import_module("benchmarks.performance.matching")

OLD = {"LSODA: S at 1e-02": 5.0, "LSODA: S at 1e-03": 8.0, "SciPy: B": 20.0}


def test_a_ratio_that_falls_by_more_than_the_limit_is_named_with_both_numbers() -> None:
    assert reached.fallen(OLD, OLD | {"SciPy: B": 20.0 * 0.8501}) == []
    assert reached.fallen(OLD, OLD | {"SciPy: B": 16.0}) == ["SciPy: B: 20 was reached, 16 now (-20 %)"]
    assert len(reached.fallen(OLD, {name: 0.84 * value for name, value in OLD.items()})) == 3
    assert len(reached.fallen(OLD, OLD | {"SciPy: B": math.nan})) == 1


def test_a_ratio_that_is_not_measured_any_more_fails_a_whole_run() -> None:
    some = {"SciPy: B": 21.0, "LSODA: S at 1e-02": 5.0}
    assert reached.fallen(OLD, some, whole=False) == []
    assert reached.fallen(OLD, some) == ["LSODA: S at 1e-03: 8 was reached, not measured now"]


def test_a_program_that_was_not_there_is_named_once() -> None:
    assert reached.fallen(OLD, {"SciPy: B": 21.0}) == ["LSODA: none of 2 ratios was measured; install it"]


def test_many_small_losses_do_not_add_up() -> None:
    kept = OLD
    now = OLD
    failures = 0
    for _ in range(3):
        now = {name: 0.9 * value for name, value in now.items()}
        failures += bool(reached.fallen(kept, now))
        kept = reached.raised(kept, now)
    assert kept == OLD
    assert failures == 2


def test_what_is_kept_is_the_best_of_both_and_all_that_is_new() -> None:
    new = {"SciPy: B": 30.0, "LSODA: S at 1e-02": 4.9, "heyoka.py: S": 2.0}
    assert reached.raised(OLD, new) == OLD | {"SciPy: B": 30.0, "heyoka.py: S": 2.0}


def test_the_file_is_read_as_it_is_written() -> None:
    assert tomllib.loads(reached.written(OLD)) == OLD
    stored = reached.read()
    assert len(stored) > 50
    assert tomllib.loads(reached.written(stored)) == stored
    assert reached.fallen(stored, stored) == []


def test_the_table_has_a_row_for_all_errors_with_its_largest_loss() -> None:
    new = {"LSODA: S at 1e-02": 5.5, "LSODA: S at 1e-03": 7.2, "heyoka.py: S": 2.0}
    assert reached.lines(OLD, new)[2:] == [
        "| LSODA: S | 1e-02, 1e-03 | 5, 8 | 5.5, 7.2 | -10 % |",
        "| SciPy: B |  | 20 | – |  |",
        "| heyoka.py: S |  | – | 2 |  |",
        "",
    ]


def test_what_is_guarded_are_the_ratios_of_the_page_at_each_error() -> None:
    entries = [
        matching.Entry(who, "", lambda: None, error=error, seconds=[0.0, seconds])
        for who, error, seconds in (("brakecli", 1e-4, 1.0), ("SciPy", 1e-3, 20.0), ("diffrax", 1e-3, 2.0))
    ]
    assert reached.side_by_side("S", entries) == {"SciPy: S at 1e-02": 20.0, "SciPy: S at 1e-03": 20.0}
