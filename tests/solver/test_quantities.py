"""The vocabulary covers what the code computes with and stores."""

from brakecli.solver.coefficients import Coefficients
from brakecli.solver.quantities import COEFFICIENTS, HISTORY, ContactState, Failure


def test_every_coefficient_and_every_column_has_its_words() -> None:
    assert tuple(COEFFICIENTS) == Coefficients._fields
    for quantity in (*COEFFICIENTS.values(), *HISTORY.values()):
        assert quantity.long_name
        assert quantity.units


def test_states_and_failures_are_those_of_the_contract_and_say_what_to_do() -> None:
    assert [int(state) for state in ContactState] == [-1, 0, 1, 2]
    assert {"; " in failure.sentence for failure in Failure if failure} == {True}
