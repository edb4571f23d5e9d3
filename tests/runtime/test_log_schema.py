import math
import zlib
from dataclasses import dataclass, replace

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist, JointTrajectory
from drivers.interface.geometry import SE2
from drivers.interface.samples import EmergencyStop, OperatorEvent, Stamp
from planners.planner import Diagnostics, Plan
from runtime.cycle import Verdict
from runtime.log.exact.columns import Kind
from runtime.log.exact.part import consumed_schemas, decided_schemas
from runtime.log.exact.schema import Schema
from runtime.log.header import SCHEMA_VERSION
from tests.runtime.log_cycles import bits, make_cycles

CYCLE = make_cycles(4)[3]


def row(schema: Schema, tick: int) -> dict[str, list[object]]:
    """What a log would hold of a tick, through Arrow."""
    cells = {}
    for name, column in schema.columns.items():
        start, end = [0, *column.ends][tick], column.ends[tick]
        cells[name] = column.values[start:end] if column.kind is Kind.IMAGE else column.flat().to_pylist()[start:end]
    return cells


@pytest.mark.parametrize("cycle", make_cycles(8))
def test_everything_sensed_comes_back_bit_for_bit(cycle) -> None:  # type: ignore[no-untyped-def]
    for name, schema in consumed_schemas().items():
        schema.put(getattr(CYCLE.sensed, name))
        schema.put(getattr(cycle.sensed, name))
        assert bits(schema.take(row(schema, 1))) == bits(getattr(cycle.sensed, name))


def test_awkward_numbers_keep_their_bits() -> None:
    schema = Schema("/x", tuple[BodyTwist, ...])
    twists = (BodyTwist(math.nan, -0.0, math.inf), BodyTwist(-math.inf, 5e-324, 0.1 + 0.2))
    schema.put(twists)
    assert bits(schema.take(row(schema, 0))) == bits(twists)


def test_an_action_without_fields_is_told_from_the_others() -> None:
    schema = Schema("/x", OperatorEvent)
    event = OperatorEvent(Stamp(1, 2, 3), EmergencyStop())
    schema.put(event)
    assert schema.take(row(schema, 0)) == event


def test_empty_and_missing_arrays_keep_their_shape() -> None:
    schema = Schema("/x", JointTrajectory | None)
    trajectory = JointTrajectory(5, np.zeros(0), np.zeros((0, 7)), np.zeros((0, 7)))
    schema.put(None)
    schema.put(trajectory)
    assert schema.take(row(schema, 0)) is None
    assert bits(schema.take(row(schema, 1))) == bits(trajectory)


def test_missing_cells_are_an_error_and_never_a_default() -> None:
    schema = Schema("/x", SE2)
    with pytest.raises(ValueError, match="too few values of /x"):
        schema.take({"x": [1.0], "y": [2.0]})


def test_a_number_of_the_wrong_kind_is_refused_rather_than_rounded() -> None:
    schema = Schema("/x", Stamp)
    schema.put(Stamp(1.5, 2, 3))  # type: ignore[arg-type]
    with pytest.raises((ValueError, TypeError)):
        schema.columns["captured_ns"].flat()


@dataclass(frozen=True, slots=True)
class Odd(Diagnostics):
    flag: bool
    score: np.float32
    words: tuple[str, ...]


def test_diagnostics_of_any_class_may_follow_each_other() -> None:
    schema = Schema("/x", Plan)
    schema.put(CYCLE.plan)
    schema.put(replace(CYCLE.plan, diagnostics=Odd(True, np.float32(0.5), ("a", "b"))))
    schema.put(CYCLE.plan)
    first, second, third = (row(schema, tick) for tick in range(3))
    assert first == third
    assert first["diagnostics.type"] == ["Cost"]
    assert first["diagnostics.candidates"] == [300.0]
    assert first["diagnostics.reason.text"] == ["clear"]
    assert first["diagnostics.flag"] == []
    assert (second["diagnostics.flag"], second["diagnostics.score"]) == ([1.0], [0.5])
    assert second["diagnostics.words.text"] == ["('a', 'b')"]


def test_every_value_of_a_verdict_has_a_column_of_its_own_name() -> None:
    columns = Schema("/x", Verdict).columns
    assert {"command.base.vx", "asked.base.wz", "response", "faults.device", "reachable.highest.vy"} <= columns.keys()


def test_a_hint_without_columns_is_named() -> None:
    with pytest.raises(TypeError, match=r"no columns for.*complex"):
        Schema("/x", tuple[complex, ...])


def test_the_schema_is_raised_with_its_columns() -> None:
    """A log lays its columns out by name; one that a reader expects and an older log lacks would be misread.

    A change of these columns asks for a new SCHEMA_VERSION, and for the checksum of its columns here.
    """
    schemas = {**consumed_schemas(), **decided_schemas()}
    columns = sorted(f"{s.entity} {column.name} {column.kind.name}" for s in schemas.values() for column in s.columns.values())
    assert (SCHEMA_VERSION, zlib.crc32("\n".join(columns).encode())) == (5, 1978736674)
