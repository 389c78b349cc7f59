"""The declaration of what a result holds: every name once, and read from where it says."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from brakecli.results import fields
from brakecli.results.field import Field, plain

TABLES = {name: rows for name, rows in vars(fields).items() if isinstance(rows, tuple) and name[0].isupper()}


@dataclass(frozen=True)
class Part:
    size: float | None = 2.0
    by_name: Any = None

    def words(self) -> str:
        return "two"


@dataclass(frozen=True)
class Report:
    part: Part | None


@pytest.mark.parametrize("name", TABLES)
def test_a_table_has_each_name_once_with_unit_and_meaning(name: str) -> None:
    rows = TABLES[name]
    names = [row.name for row in rows]
    assert sorted(set(names)) == sorted(names)
    for row in rows:
        assert row.meaning
        assert row.kind[0] != "f" or row.units or "critical" in row.name or row.name == "coexists_from"
        assert not row.group or row.kind == fields.OBJECT


def test_a_value_is_found_along_attributes_keys_and_methods() -> None:
    report = Report(Part(by_name={"x": 3.0}))
    assert Field("size", "1", "", at="part.size").read(report) == 2.0
    assert Field("x", "1", "", at="part.by_name.x").read(report) == 3.0
    assert Field("words", "", "", fields.TEXT, "part.words").read(report) == "two"
    with pytest.raises(AttributeError):
        Field("length", "1", "").read(report)


def test_what_does_not_exist_is_none_or_what_stands_for_it() -> None:
    assert Field("size", "1", "", at="part.size").read(Report(None)) is None
    assert Field("size", "1", "", at="part.size", missing=0).read(Report(Part(None))) == 0


def test_objects_and_lists_of_objects_are_read_by_their_own_rows() -> None:
    rows = (Field("size", "1", ""),)
    assert Field("part", "", "", rows=rows).read(Report(Part())) == {"size": 2.0}
    many = Report(Part(by_name=[Part(1.0), Part(None)]))
    found = Field("parts", "", "", at="part.by_name", rows=rows).read(many)
    assert found == [{"size": 1.0}, {"size": None}]


def test_values_are_as_json_holds_them() -> None:
    assert plain((1.0, 2 + 3j, {"x": ("y",)})) == [1.0, [2.0, 3.0], {"x": ["y"]}]
    assert plain(np.array([[1.0, np.nan]])) == [[1.0, None]]
    assert plain(np.array(["größer".encode()])) == ["größer"]
    assert plain(np.array([1, 2])) == [1, 2]
