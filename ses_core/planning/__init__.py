"""The navigation stack: costmap, global plan and trajectory planner of `move_base`."""
