"""Identification models, and their table."""

from identify.models.equations import Equations as Equations
from identify.models.explicit import ExplicitModel as ExplicitModel
from identify.models.implicit import ImplicitModel as ImplicitModel
from identify.models.model import AbstractModel as AbstractModel
from identify.models.power import PowerModel as PowerModel
from identify.plugins import Table

MODELS: Table[AbstractModel] = Table(
    "models",
    AbstractModel,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "explicit": ExplicitModel,
        "implicit": ImplicitModel,
        "power": PowerModel,
    },
)
