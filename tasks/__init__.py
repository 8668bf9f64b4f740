"""One Prefect task per stage: load, call the core, save."""
