"""Models that scenario files select by name: dynamics, cost terms and seed distributions."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

#: Largest magnitude of a number, and largest count, so that neither overflows in calculations.
LARGEST, MOST = 1e12, 10**9


def _check_size(value: float) -> float:
    if abs(value) > LARGEST:
        raise ValueError(f"it must be from {-LARGEST:g} to {LARGEST:g}")
    return value


def _check_count(value: int) -> int:
    if value > MOST:
        raise ValueError(f"it must be at most {MOST}")
    return value


# Strict, because truth values are numbers to Python.
_Size, _Count = AfterValidator(_check_size), AfterValidator(_check_count)
Real = Annotated[float, Field(strict=True, allow_inf_nan=False), _Size]
NonNegative = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0), _Size]
Positive = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0), _Size]
PositiveInteger = Annotated[int, Field(strict=True, gt=0), _Count]


class Kind(BaseModel):
    """Base class of immutable pydantic models that scenario files select by their `kind`.

    A subclass that declares `family`, such as `Dynamics`, is a family. Every class below it that
    gives a default to the field `kind` is registered in the family under that name; a class that
    inherits the default is not. A field annotated with the family accepts every registered kind, as
    an instance or as a mapping such as `{kind: goal, ...}`.

    A model that was defined before a kind was registered accepts it after
    `model_rebuild(force=True)`, which `Scenario.load` calls.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    family: ClassVar[dict[str, type[Kind]]] = {}

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        super().__pydantic_init_subclass__(**kwargs)
        kind = cls.model_fields.get("kind")
        if kind is not None and not kind.is_required() and "kind" in cls.__annotations__:
            cls.family[kind.default] = cls

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        members = cls.__dict__.get("family")
        if not members:
            return handler(source)
        return core_schema.tagged_union_schema(
            {name: handler.generate_schema(member) for name, member in members.items()},
            discriminator=_kind_of,
        )


def _kind_of(value: Any) -> Any:
    return value.get("kind") if isinstance(value, dict) else getattr(value, "kind", None)
