"""What is allowed: `configs/budgets.yaml`, and how a figure stands beside its budget."""

from __future__ import annotations

from importlib.resources import files

import yaml
from pydantic import Field, TypeAdapter

from drivers.interface.settings import Settings
from tests.benchmarks.figure import Figure


class Budget(Settings):
    """The bounds of one figure; those that are not given do not bind."""

    unit: str = "ms"
    at_most: float | None = Field(None, ge=0.0, description="of the median; 0: it must not happen at all")
    p99_at_most: float | None = Field(None, gt=0.0, description="of the 99th percentile")
    mean_at_most: float | None = Field(None, gt=0.0, description="of the mean")
    at_least: float | None = Field(None, gt=0.0, description="for figures where more is better")
    ratio_at_most: float | None = Field(None, gt=0.0, description="of the median over the peer's")
    p99_ratio_at_most: float | None = Field(None, gt=0.0, description="of the 99th percentile over the peer's")
    published: float | None = Field(None, gt=0.0, description="what the paper's authors measured, a mean on their machine")
    note: str = Field("", description="where the bound comes from, or what is measured")

    def broken_by(self, figure: Figure) -> tuple[str, ...]:
        """Return what the figure breaks, each as a short text; a bounded quantity that was not measured is broken too."""
        upper = (
            ("p50", figure.value, self.at_most),
            ("p99", figure.p99, self.p99_at_most),
            ("mean", figure.mean, self.mean_at_most),
            ("p50 ratio", figure.ratio, self.ratio_at_most),
            ("p99 ratio", figure.p99_ratio, self.p99_ratio_at_most),
        )
        broken = [f"{what} over {bound:g}" for what, value, bound in upper if bound is not None and not _within(value, bound)]
        if self.at_least is not None and not figure.value >= self.at_least:
            broken.append(f"under {self.at_least:g}")
        if figure.unit != self.unit:
            broken.append(f"measured in {figure.unit}, allowed in {self.unit}")
        return tuple(broken)

    def __str__(self) -> str:
        """Return the bounds in one line."""
        bounds = (
            ("<= {:g}", self.at_most),
            ("p99 <= {:g}", self.p99_at_most),
            ("mean <= {:g}", self.mean_at_most),
            (">= {:g}", self.at_least),
            ("ratio <= {:g}", self.ratio_at_most),
            ("p99 ratio <= {:g}", self.p99_ratio_at_most),
        )
        return ", ".join(text.format(bound) for text, bound in bounds if bound is not None) or "stated only"


def _within(value: float | None, bound: float) -> bool:
    return value is not None and value <= bound


def load_budgets() -> dict[str, Budget]:
    """Read the shipped budgets, by the figure's name."""
    text = (files("configs") / "budgets.yaml").read_text(encoding="utf-8")
    return TypeAdapter(dict[str, Budget]).validate_python(yaml.safe_load(text))
