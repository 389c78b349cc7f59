"""What all tables of case and sweep files share: kinds of numbers, rules between keys, and their JSON Schema."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import nullcontext, suppress
from functools import cache
from operator import attrgetter
from typing import Annotated, Any, ClassVar, Self, cast, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    TypeAdapter,
    ValidationError,
    WrapValidator,
    model_validator,
)
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import InitErrorDetails, PydanticCustomError, core_schema

from brakecli.errors import KeyPath, Problem, found_text
from brakecli.solver.contact import EVALUATORS
from brakecli.solver.schemes import SCHEMES

# magnitudes of all numbers but 0, so that products neither vanish nor overflow
SMALLEST = 1e-100
LARGEST = 1e100
ROUNDED = 1e-9  # relative difference of two numbers of a file that are the same
MOST_WRONG_ENTRIES = 20  # of one list that are reported
MOST_SINES = 2000  # of a surface that is not given as sines: a resolved case must not be larger than a case may be
MISSING = "is missing"


def described(description: str, default: object = ..., **options: Any) -> Any:
    """A key, which is required if it has no default."""
    return Field(default, description=description, **options)


def quantity(unit: str, description: str, default: object = ..., **options: Any) -> Any:
    """A key that holds a number or numbers."""
    return described(description, default, json_schema_extra={"unit": unit}, **options)


def one_of(names: Callable[[], Iterable[str]]) -> tuple[object, ...]:
    """A text that is one of some names. They are asked for at every check, so that a row may join a registry."""

    def checked(value: object) -> object:
        if value not in tuple(names()):
            raise PydanticCustomError("enum", "is not one of the choices")
        return value

    return BeforeValidator(checked), Field(
        json_schema_extra=lambda schema: schema.update(enum=[*dict.fromkeys(names())])
    )


def _within_scale(value: float) -> float:
    if value and not SMALLEST <= abs(value) <= LARGEST:
        raise PydanticCustomError("magnitude", "magnitude is not between 1e-100 and 1e100")
    return value


def _few_errors(values: object, handler: Callable[[object], object]) -> object:
    """Report only the first wrong entries of a list: thousands of them help nobody, and take seconds."""
    try:
        return handler(values)
    except ValidationError as error:
        if error.error_count() <= MOST_WRONG_ENTRIES:
            raise
        what = f"has {error.error_count()} wrong entries, of which the first {MOST_WRONG_ENTRIES} are reported"
        raise ValidationError.from_exception_data(
            "list", [*_again(error, MOST_WRONG_ENTRIES), _as_error(Problem((), what, "correct these first"))]
        ) from None


from_list = (Field(strict=False), WrapValidator(_few_errors))  # TOML has lists, a frozen case holds tuples
_scaled = AfterValidator(_within_scale)
Number = Annotated[float, _scaled]
Positive = Annotated[float, Field(gt=0), _scaled]
NonNegative = Annotated[float, Field(ge=0), _scaled]
Angle = Annotated[float, Field(ge=-90, le=90), _scaled]
Whole = Annotated[float, Field(ge=1, multiple_of=1), _scaled]
Tolerance = Annotated[float, Field(ge=1e-13, le=1e-2)]
Weight = Annotated[float, Field(ge=0, le=1), _scaled]
Weights = Annotated[tuple[Weight, ...], *from_list]
Series = Annotated[tuple[Number, ...], *from_list]
Lengths = Annotated[tuple[Positive, ...], *from_list]
Wholes = Annotated[tuple[Whole, ...], *from_list]
Schedule = Annotated[tuple[Number, ...], Field(min_length=1), *from_list]
Title = Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f-\x9f]*$", description="one line for people to read")]


def _add_alternatives(schema: JsonSchemaValue, kind: "type[Table]") -> None:
    if groups := [{"required": [*group]} for group in kind.alternatives]:
        schema |= {"oneOf": groups} if kind.one_is_needed else {"not": {"allOf": groups}}


class Table(BaseModel):
    """A table of a file: frozen, without unknown keys, and with rules between its keys."""

    model_config = ConfigDict(
        strict=True,
        frozen=True,
        extra="forbid",
        allow_inf_nan=False,
        ser_json_inf_nan="constants",  # values of an axis, which its key then refuses
        json_schema_extra=_add_alternatives,
    )

    alternatives: ClassVar[tuple[tuple[str, ...], ...]] = ()  # groups of keys that exclude each other
    one_is_needed: ClassVar[bool] = True  # of these groups
    needless: ClassVar[dict[KeyPath, tuple[KeyPath, ...]]] = {}  # keys that an override of one replaces

    def _broken_rules(self) -> Iterator[Problem]:
        """Yield a problem for every rule between keys that does not hold."""
        groups = self.alternatives if self.one_is_needed else ((), *self.alternatives)
        present = [key for key in dict.fromkeys(sum(groups, ())) if getattr(self, key) is not None]
        missing = [[key for key in group if key not in present] for group in groups if {*present} <= {*group}]
        if present and not missing:
            # the first that is given completely, otherwise in part
            chosen = max(
                self.alternatives, key=lambda group: ({*group} <= {*present}) + bool({*group} & {*present})
            )
            key = next(key for key in present if key not in chosen)
            others = " and ".join(other for other in chosen if other in present)
            yield self.wrong(key, f"is given together with {others}", "keep one of the two")
        elif len(missing) == 1:
            for key in missing[0]:
                yield Problem((key,), MISSING, f"give {' and '.join((*present, *missing[0]))} together")
        elif missing and all(missing):
            choices = ", or ".join(" and ".join(group) for group in missing)
            yield Problem((missing[0][0],), MISSING, f"give {choices}", instead=sum(map(tuple, missing), ()))

    def different_lengths(self, key: str, other: str) -> Iterator[Problem]:
        """Yield a problem if a list is not as long as another one; either may be absent."""
        values = getattr(self, key)
        others = getattr(self, other)
        if None not in (values, others) and len(values) != len(others):
            yield self.wrong(
                key,
                f"has {entries(values)}, but {other} has {len(others)}",
                f"give one value for each {other.removesuffix('s')}",
            )

    def wrong(self, key: str, what: str, remedy: str) -> Problem:
        """The problem with the value of a key, which may be one of an inner table: `output.sample_interval`."""
        return Problem(tuple(key.split(".")), what + found_text(attrgetter(key)(self)), remedy)

    def broken(self, *rules: tuple[object, str, str, str]) -> Iterator[Problem]:
        """Yield a problem for each rule that is broken: whether it is, then the key, what is wrong, what to do."""
        yield from (self.wrong(*problem) for broken, *problem in rules if broken)

    def _fill(self) -> None:
        """Give the keys that were left out their values, where these depend on other keys."""

    @model_validator(mode="wrap")
    @classmethod
    def _find_every_problem(cls, data: object, handler: Callable[[object], Self]) -> Self:
        """Check the rules between keys even where some keys are wrong by themselves, and report all at once."""
        if isinstance(data, cls):
            return data  # valid by construction
        errors: list[InitErrorDetails] = []
        try:
            table = handler(data)
        except ValidationError as error:
            if not isinstance(data, dict):
                raise
            errors = [*_again(error)]
            table = cls._without({str(details["loc"][0]) for details in errors}, data)
        # A rule that needs a wrong key meets no attribute: it waits until that key is right.
        with suppress(AttributeError) if errors else nullcontext():
            table._fill()
            for problem in table._broken_rules():
                errors.append(_as_error(problem))
        if errors:
            raise ValidationError.from_exception_data(cls.__name__, errors)
        return table

    @classmethod
    def _without(cls, wrong: set[str], data: dict[str, Any]) -> Self:
        """The table with the keys that are wrong by themselves left out, not even set to their defaults."""
        values = {key: data[key] for key in (cls.model_fields.keys() & data.keys()) - wrong}
        for key in values:
            values[key] = _adapter(cls, key).validate_python(values[key])
        table = cast(Self, cls.model_construct(**values))  # the mypy plugin loses Self here
        for key in wrong:
            table.__dict__.pop(key, None)
        return table


class OverCase(Table):
    """A table of a file that names its case."""

    title: Title = ""
    case: str = described("the case's file, seen from the file that names it", min_length=1)


@cache
def _adapter(kind: type[Table], key: str) -> TypeAdapter[object]:
    """What makes the value of one key."""
    form: Any = Annotated[kind.model_fields[key].annotation, kind.model_fields[key]]
    return TypeAdapter(form)


def entries(values: tuple[object, ...]) -> str:
    """How many entries a list has, in words."""
    return "1 entry" if len(values) == 1 else f"{len(values)} entries"


def _as_error(problem: Problem) -> InitErrorDetails:
    kind = PydanticCustomError("rule", "{problem}", {"problem": problem})
    return InitErrorDetails(type=kind, loc=problem.path, input=None)


def _again(error: ValidationError, most: int | None = None) -> Iterator[InitErrorDetails]:
    """The errors of a validation, or the first of them, in a form that can be raised again."""
    for details in error.errors(include_url=False)[:most]:
        yield InitErrorDetails(
            type=PydanticCustomError(details["type"], details["type"], details.get("ctx")),
            loc=details["loc"],
            input=details["input"],
        )


@cache
def tables_within(kind: type[Table]) -> dict[KeyPath, type[Table]]:
    """Every table of a kind of table, itself included, by its key path."""
    tables: dict[KeyPath, type[Table]] = {(): kind}
    for key, field in kind.model_fields.items():
        for inner in (field.annotation, *get_args(field.annotation)):
            if isinstance(inner, type) and issubclass(inner, Table):
                tables |= {(key, *path): table for path, table in tables_within(inner).items()}
    return tables


class _TomlSchema(GenerateJsonSchema):
    """TOML has no null: a key without a value is left out."""

    def nullable_schema(self, schema: core_schema.NullableSchema) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> JsonSchemaValue:
        described = super().default_schema(schema)
        if described.get("default", 0) is None:
            del described["default"]
        return described


def json_schema(kind: type[Table]) -> JsonSchemaValue:
    """The JSON Schema (draft 2020-12) of a kind of table, such as a whole case file.

    It accepts everything that is valid; most rules between keys are beyond it.
    """
    return _schema_with(kind, (*SCHEMES, *EVALUATORS))


@cache
def _schema_with(kind: type[Table], names: tuple[str, ...]) -> JsonSchemaValue:
    """The schema as it is while the registries hold these names."""
    return {"$schema": _TomlSchema.schema_dialect, **kind.model_json_schema(schema_generator=_TomlSchema)}


def key_schema(kind: type[Table], path: KeyPath) -> JsonSchemaValue:
    """The JSON Schema of one key of a table, of an inner table, or of an entry of a list; its unit is included."""
    schema = node = json_schema(kind)
    for step in path:
        node = {"unit": node.get("unit"), **node["items"]} if isinstance(step, int) else node["properties"][step]
        node = schema["$defs"][node["$ref"].rpartition("/")[2]] if "$ref" in node else node
    return node
