"""Render: a mesh and a picture of every environment, for PyBullet and for people."""

from pathlib import Path

from prefect import task
from prefect.cache_policies import NO_CACHE

from ses_core.navigation import environment_task
from ses_core.recipes import ArtifactRef, Recipe
from ses_core.simulation.rendering import obj_text, render
from storage.artifact_store import LocalArtifactStore
from storage.environment_files import read_environments
from storage.materialize import Materialized, materialize
from storage.stages import RENDER
from tasks.outcome import conclude


@task(name="render worlds", cache_policy=NO_CACHE)
def render_worlds(
    environments: ArtifactRef, *, store: LocalArtifactStore, anew: bool = False
) -> Materialized:
    """Build each environment's world: merged boxes in one mesh, and a preview."""

    def build(directory: Path) -> None:
        # matplotlib takes half a second to import: only who draws pays for it.
        from ses_core.pictures.gallery import contact_sheet

        for environment in read_environments(store.path(environments)).environments:
            name = environment.environment_id
            mesh = render(environment_task(environment).world.grid)
            (directory / f"{name}.obj").write_text(obj_text(mesh, name=name), encoding="utf-8")
            picture = contact_sheet(environment.cells[None], environment.observed[None])
            (directory / f"{name}.png").write_bytes(picture)

    return conclude(materialize(store, Recipe(RENDER, inputs=(environments,)), build, anew=anew))
