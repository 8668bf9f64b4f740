"""The ideas: geometry, scenarios, synthesis, simulation, learning. Pure: no disk, no Prefect."""
