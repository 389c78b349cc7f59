"""What the tables of a case file have in common: kinds of numbers, rules between keys, every problem at once."""

from collections.abc import Iterator
from contextlib import nullcontext, suppress
from typing import Annotated, Any, ClassVar, NamedTuple, Self, cast

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ModelWrapValidatorHandler,
    ValidationError,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    model_validator,
)
from pydantic_core import ErrorDetails, InitErrorDetails, PydanticCustomError

SMALLEST, LARGEST = 1e-100, 1e100
"""Magnitudes between which every number other than zero must lie, so that products neither vanish nor overflow."""

MOST_WRONG_ENTRIES = 20
"""Most wrong entries that are told of one list."""


def _within_scale(value: float) -> float:
    if value and not SMALLEST <= abs(value) <= LARGEST:
        raise PydanticCustomError("magnitude", "magnitude is not between 1e-100 and 1e100")
    return value


def quantity(unit: str, description: str) -> Any:  # pydantic's Field is typed so, too
    """Field metadata: the unit and what the number is."""
    return Field(description=description, json_schema_extra={"unit": unit})


def _few_errors(values: Any, handler: ValidatorFunctionWrapHandler) -> Any:
    """Report the first wrong entries of a list alone: thousands of them help nobody, and take seconds."""
    try:
        return handler(values)
    except ValidationError as error:
        if error.error_count() <= MOST_WRONG_ENTRIES:
            raise
        errors = [_repeated(each) for each in error.errors(include_url=False)[:MOST_WRONG_ENTRIES]]
        what = f"has {error.error_count()} wrong entries, of which the first {len(errors)} are told"
        errors.append(_rule(Broken((), what, "correct these first")))
        raise ValidationError.from_exception_data("list", errors) from None


# TOML has lists, a frozen case holds tuples.
from_list = (Field(strict=False), WrapValidator(_few_errors))
Number = Annotated[float, AfterValidator(_within_scale)]
Positive = Annotated[float, Field(gt=0), AfterValidator(_within_scale)]
NonNegative = Annotated[float, Field(ge=0), AfterValidator(_within_scale)]
Angle = Annotated[float, Field(ge=-90, le=90), AfterValidator(_within_scale)]
Tolerance = Annotated[float, Field(ge=1e-13, le=1e-2)]
Weight = Annotated[float, Field(ge=0, le=1), AfterValidator(_within_scale)]
Series = Annotated[tuple[Number, ...], *from_list]
Lengths = Annotated[tuple[Positive, ...], *from_list]
Schedule = Annotated[tuple[Number, ...], Field(min_length=1), *from_list]
from_text = Field(strict=False)  # TOML has texts, a case holds members of an enum


class Broken(NamedTuple):
    """A rule between several keys that a table breaks: where, and what is wrong with the value found there."""

    key: tuple[str | int, ...]
    what: str
    remedy: str
    found: object = None


class Table(BaseModel):
    """A table of the case file: frozen, without unknown keys, and with rules between its keys."""

    model_config = ConfigDict(
        strict=True,
        frozen=True,
        extra="forbid",
        allow_inf_nan=False,
        json_schema_extra=lambda schema, model: _tell_alternatives(schema, model),
    )

    alternatives: ClassVar[tuple[tuple[str, ...], ...]] = ()
    """Groups of keys of which exactly one is given …"""
    one_is_needed: ClassVar[bool] = True
    """… or, if this is not set, at most one."""

    def _broken_rules(self) -> Iterator[Broken]:
        """Yield every rule between keys that does not hold."""
        given = [group for group in self.alternatives if any(getattr(self, key) is not None for key in group)]
        if not given:
            choices = ", or ".join(" and ".join(group) for group in self.alternatives)
            if choices and self.one_is_needed:
                yield Broken((self.alternatives[0][0],), "is missing", f"give {choices}")
        elif len(given) > 1:
            key = next(key for key in given[1] if getattr(self, key) is not None)
            other = " and ".join(given[0])
            yield Broken((key,), f"is given together with {other}", "keep one of the two", getattr(self, key))
        else:
            for key in given[0]:
                if getattr(self, key) is None:
                    yield Broken((key,), "is missing", f"give {' and '.join(given[0])} together")

    def _fill(self) -> None:
        """Give the keys that were left out their values, where these depend on other keys."""

    @model_validator(mode="wrap")
    @classmethod
    def _tell_everything(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """Check the rules between keys even where some keys are wrong by themselves, and report all at once."""
        errors: list[InitErrorDetails] = []
        try:
            table = handler(data)
        except ValidationError as error:
            if not isinstance(data, dict):
                raise
            found = error.errors(include_url=False)
            errors = [_repeated(each) for each in found]
            table = cls._without({str(each["loc"][0]) for each in found}, data)
        # A rule that needs a wrong key meets no attribute: it waits until that key is right.
        with suppress(AttributeError) if errors else nullcontext():
            table._fill()
            for broken in table._broken_rules():
                errors.append(_rule(broken))
        if errors:
            raise ValidationError.from_exception_data(cls.__name__, errors)
        return table

    @classmethod
    def _without(cls, wrong: set[str], data: dict[str, Any]) -> Self:
        """The table with the keys that are wrong by themselves left out, not even set to their defaults."""
        values = {key: data[key] for key in (cls.model_fields.keys() & data.keys()) - wrong}
        for key in values:
            kind = cls.model_fields[key].annotation
            if isinstance(kind, type) and issubclass(kind, Table):
                values[key] = kind.model_validate(values[key])
        table = cast(Self, cls.model_construct(**values))  # the mypy plugin loses Self here
        for key in wrong:
            table.__dict__.pop(key, None)
        return table


def _rule(broken: Broken) -> InitErrorDetails:
    error = PydanticCustomError("rule", "rule", {"what": broken.what, "remedy": broken.remedy})
    return InitErrorDetails(type=error, loc=broken.key, input=broken.found)


def _repeated(error: ErrorDetails) -> InitErrorDetails:
    kind = PydanticCustomError(error["type"], error["type"], error.get("ctx"))
    return InitErrorDetails(type=kind, loc=error["loc"], input=error["input"])


def _tell_alternatives(schema: dict[str, Any], model: type[Table]) -> None:
    groups = [{"required": list(group)} for group in model.alternatives]
    if groups and model.one_is_needed:
        schema["oneOf"] = groups
    elif groups:
        schema["not"] = {"allOf": groups}
