"""The base of every settings model: frozen, and unknown keys are errors."""

from pydantic import BaseModel, ConfigDict


class SettingsModel(BaseModel):
    """A frozen group of settings; it is also a form in the Prefect UI."""

    model_config = ConfigDict(frozen=True, extra="forbid")
