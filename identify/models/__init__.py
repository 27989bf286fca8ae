"""Identification models, and their table."""

from idbench.identify.models.equations import Equations as Equations
from idbench.identify.models.explicit import ExplicitModel as ExplicitModel
from idbench.identify.models.implicit import ImplicitModel as ImplicitModel
from idbench.identify.models.model import AbstractModel as AbstractModel
from idbench.identify.models.power import PowerModel as PowerModel
from idbench.identify.plugins import Table

MODELS: Table[AbstractModel] = Table(
    "models",
    AbstractModel,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "explicit": ExplicitModel,
        "implicit": ImplicitModel,
        "power": PowerModel,
    },
)
