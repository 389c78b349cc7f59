"""All sentences that are made in tests are read: none holds a number that is not known."""

import re
from typing import Any

from brakecli.analysis.regime.decision import Decision, Row
from brakecli.analysis.regime.verdict import Verdict
from brakecli.results.field import Field

_UNKNOWN = re.compile(r"(?<![\w./-])(nan|inf)(?![\w./])")
_GIVEN = "found nan", "found inf"  # of a user, as a message repeats it


def unknown_in(value: Any) -> list[str]:
    """The sentences in a value that hold nan or inf; a word alone, such as a unit in a forged file, is none."""
    texts = value if isinstance(value, list | tuple) else [value]
    said = [text for text in texts if isinstance(text, str) and " " in text and _UNKNOWN.search(text)]
    return [text for text in said if not any(given in text for given in _GIVEN)]


def read_all() -> None:
    """From now on, fail wherever a verdict or a result holds such a text."""
    decision = Row.decision
    verdict = Verdict.__init__
    read = Field.read

    def decision_read(self: Row[Any, Any], answers: Any) -> Decision:
        found = decision(self, answers)
        assert not unknown_in(found.sentence), found
        return found

    def verdict_read(self: Verdict, *args: Any, **more: Any) -> None:
        verdict(self, *args, **more)
        assert not unknown_in(self.reasons), self.reasons

    def field_read(self: Field, report: object) -> Any:
        value = read(self, report)
        if self.units == "" and not self.rows and (texts := unknown_in(value)):
            raise AssertionError(f"{self.name}: {texts}")
        return value

    for kind, name, new in (
        (Row, "decision", decision_read),
        (Verdict, "__init__", verdict_read),
        (Field, "read", field_read),
    ):
        setattr(kind, name, new)
