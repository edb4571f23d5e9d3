"""The base of every settings model: frozen, no unknown keys, no NaN."""

from pydantic import BaseModel, ConfigDict


class Settings(BaseModel):
    """Validated, immutable settings of one part.  Physical numbers carry their unit in the key and have bounds."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, validate_default=True)
